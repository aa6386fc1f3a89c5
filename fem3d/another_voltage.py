"""The same sink at another voltage, from the reduced problems of a run that is there already.

The power that the electrodes supply to each current field scales with the voltage; nothing else changes. One step of
the full problem at the new state shows whether the fields still hold it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem3d import operating_point, outputs, sink_quantities, steady, time_response
from fem3d.adapt import RISES, Answer, Solution
from fem3d.reduced import Reduced
from fem3d.steady import SteadyState
from meshes.symmetry import Symmetry
from scenes.sink import Sink

BY_RESISTANCE = ("current_A", "power_W", "heat_out_W", "end_flow_W")
LEFT_OUT = 0.02  # part of the accuracy that the first run's fields may miss at the new voltage


def solve(sink: Sink, symmetry: Symmetry, before: Answer, factor: float) -> Answer | None:
    """The answer at ``factor`` times the voltage of ``before``; None where its meshes or fields don't suffice, or
    see no steady state: that is for the full solution to say.
    """
    if before.response is None:
        return None
    reduced = _scaled(before.response.reduced, factor)
    found = _solution(sink, symmetry, before.fine.state, reduced, factor)
    if found is None:
        return None
    fine, moved = found
    # What the meshes miss is a share of the rise; how far that drives the resistance grows with the rise.
    old, new = (abs(float(s.quantities["peak_rise_K"])) for s in (before.fine, fine))
    errors = {}
    for name, value in fine.quantities.items():
        share = before.errors[name] / abs(float(before.fine.quantities[name]))
        grows = max(1.0, new / old) if name in BY_RESISTANCE else 1.0
        errors[name] = abs(float(value)) * (share * grows + moved)
    if max(errors[name] / abs(float(fine.quantities[name])) for name in errors) > sink.accuracy:
        return None
    response = time_response.repeat(sink, symmetry, fine.state, reduced, fine.quantities, before.response)
    return Answer(fine, errors, response, before.levels)


def _scaled(reduced: Reduced, factor: float) -> Reduced:
    return replace(reduced, supply=reduced.supply * factor)


def _solution(
    sink: Sink, symmetry: Symmetry, before: SteadyState, reduced: Reduced, factor: float
) -> tuple[Solution, float] | None:
    heat, conductor = before.heat, before.conductor
    point = operating_point.find(reduced)
    if conductor is None or point.folded:
        return None
    rise = reduced.basis @ point.a
    patterns = [replace(p, supply=p.supply * factor) for p in before.patterns]
    density = steady.combine([p.density for p in patterns], point.c)
    source = steady.joule_load(conductor, density, rise) + heat.constant_source
    answer = heat.solve_steady(source[: heat.free])
    moved = max(
        abs(float(heat.probes[name] @ (answer - rise)) / float(heat.probes[name] @ answer)) for name in RISES.values()
    )
    if moved > LEFT_OUT * sink.accuracy:
        return None
    potential = before.potential
    hotter = abs(factor) > 1 or before.follows_pattern
    if hotter and any(conductor.material(b).temperature_coefficient for b in conductor.blocks):
        # The current patterns are those of the first voltage's heat: see whether they still hold.
        true = conductor.solve(rise, potential)
        drive = next(b.value for b in heat.scene.boundaries if b.name == "electrode-0")
        load = (sink.voltage / drive) ** 2 * steady.joule_load(conductor, true.density, rise) + heat.constant_source
        if heat.norm(heat.solve_steady((load - source)[: heat.free])) > LEFT_OUT * sink.accuracy * heat.norm(rise):
            return None
    joule = steady.box_heat(conductor, density, rise)
    names = patterns[0].currents
    state = replace(
        before, rise=answer, source=source, joule=joule, patterns=patterns, power=float(sum(joule.values())),
        currents={n: float(point.c @ np.array([p.currents[n] for p in patterns])) for n in names},
        potential=None if potential is None else factor * potential,
    )  # fmt: skip
    return Solution(state, sink_quantities.steady(sink, outputs.of_steady(state, symmetry))), moved
