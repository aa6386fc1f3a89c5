"""The same sink at another voltage, from the mesh, the factors and the reduced problem of a run that is there already.

The power that the electrodes supply to each current field scales with the voltage; nothing else changes. One step of
the full problem at the new state shows whether the fields still hold it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem3d.adaptivity import goal_parts, trace_errors
from fem3d.adaptivity.mesh import Answer
from fem3d.adaptivity.nested import Solution
from fem3d.problems.current_fields import combined
from fem3d.results import outputs
from fem3d.results.study import Study
from fem3d.solution import continuation
from fem3d.solution.reduced import Reduced, project
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base

BY_RESISTANCE = ("current_A", "power_W", "heat_out_W", "end_flow_W")
LEFT_OUT = 0.02  # the first run's fields may miss this fraction of the accuracy at the new voltage


def solve(study: Study, before: Answer, factor: float) -> Answer | None:
    """The answer at ``factor`` times the voltage of ``before``; None where its meshes or fields don't suffice, or
    see no steady state: that is for the full solution to say.
    """
    state, response = before.fine.state, before.response
    if response is None:
        reduced = project(state.heat, state.conductor, state.fields, state.patterns)
    else:
        reduced = response.reduced
    reduced = replace(reduced, supply=reduced.supply * factor)
    solution = _solution(study, state, reduced, factor)
    if solution is None:
        return None
    fine, moved = solution
    # What the meshes miss is a share of the rise; how far that drives the resistance grows with the rise.
    old, new = (max(abs(float(s.quantities[name])) for name in study.rises) for s in (before.fine, fine))
    errors = {}
    for name, value in fine.quantities.items():
        share = before.errors[name] / abs(float(before.fine.quantities[name]))
        grows = max(1.0, new / old) if name in BY_RESISTANCE else 1.0
        errors[name] = abs(float(value)) * (share * grows + moved)
    if max(errors[name] / abs(float(fine.quantities[name])) for name in errors) > study.accuracy:
        return None
    if response is not None:
        response = trace_errors.repeat(study, Base.of_steady(fine.state), reduced, fine.out, response)
    return replace(before, steady=fine, errors=errors, response=response)


def _solution(study: Study, before: SteadyState, reduced: Reduced, factor: float) -> tuple[Solution, float] | None:
    heat, conductor = before.heat, before.conductor
    point = continuation.find(reduced)
    if conductor is None or point.folded:
        return None
    lift, n = heat.lifts[0], heat.free
    rise = lift + heat.whole(reduced.basis @ point.a)
    patterns = [replace(p, supply=p.supply * factor) for p in before.patterns]
    density = combined(patterns, point.c)
    source = conductor.joule_load(density, rise) + heat.loads[0]
    answer = lift + heat.whole(heat.solve_steady(source[:n]))
    probes = heat.domain.probes
    goals = [goal_parts.goal_row(heat, probes[name], rise) for name in study.goals.values()]
    rows = [row for row in goals if row is not None]
    moved = max(abs(float(row[:n] @ (answer - rise)[:n]) / float(row[:n] @ answer[:n])) for row in rows)
    if moved > LEFT_OUT * study.accuracy:
        return None
    potential = before.potential
    hotter = abs(factor) > 1 or before.follows_pattern
    if hotter and conductor.warms:
        # The current patterns are those of the first voltage's heat: see whether they still hold.
        true = conductor.solve(rise, factor * before.drive * conductor.voltages[0], potential)
        load = conductor.joule_load(true.density, rise) + heat.loads[0]
        if heat.norm(heat.solve_steady((load - source)[:n])) > LEFT_OUT * study.accuracy * heat.norm(rise[:n]):
            return None
    joule = conductor.joule(density, rise)
    names = patterns[0].currents
    state = replace(
        before, drive=factor * before.drive, rise=answer, source=source, joule=joule, patterns=patterns,
        power=float(sum(joule.values())),
        currents={n: float(point.c @ np.array([p.currents[n] for p in patterns])) for n in names},
        potential=None if potential is None else factor * potential, density=density,
    )  # fmt: skip
    out = outputs.of_steady(state, study.part)
    return Solution(state, out, study.steady(out)), moved
