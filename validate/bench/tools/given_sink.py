"""This toolkit's 3D solver on a given grid, as the other programs get it: no grid is sought, no error estimated.

``options``: ``degree`` of the elements, ``layers`` that across thin layers, ``grading`` (the cells), ``transient``,
``accuracy`` of the coupled iteration and of the steps, ``generations`` of Krylov fields, ``electric`` "full" or, in
the steady state, "uniform" as in `ngsolve_sink`. In full the current's pattern is followed where the iteration finds
that it matters.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d import conductor, level, outputs, sink_quantities, steady, transient
from fem3d.assembly import assemble
from fem3d.domain import boxes
from fem3d.heat import HeatProblem
from fem3d.probes import reading
from fem3d.study import Quantities
from meshes import symmetry
from reduced1d.equations import room_resistivity
from scenes.loading import load
from scenes.sink import Sink
from validate.bench.entries import UNIFORM
from validate.bench.problem import QUANTITIES, TIMES, graded

Answer = tuple[int, int, Quantities]


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Answer], Callable[[Answer], dict[str, Any]]]:
    """Assemble and solve the quarter on its grid; read the numbers."""
    sink = load("sink", [])
    part = symmetry.reduce(sink.scene())
    study = sink_quantities.study(sink, part)
    grid = graded(part.scene, options["grading"], 1, options["degree"], options["layers"])
    accuracy = options["accuracy"]

    def solve() -> Answer:
        heat = assemble(boxes(part.scene, grid))
        if options["electric"] == UNIFORM:
            return heat.free, 0, _uniform(sink, heat, accuracy)
        state = steady.coupled(heat, conductor.find(heat, level.SOLVED * accuracy), True, study.voltage, accuracy)
        if not options["transient"]:
            return heat.free, 0, study.steady(outputs.of_steady(state, part))
        base = transient.Base.of_steady(state)
        shift = transient.shift(transient.time_constant(state), study.earliest)
        reduced = base.project(transient.Krylov(base, shift).fields(options["generations"]))
        answer = transient.march(base, reduced, study.end, accuracy)
        traces = study.traces(outputs.of_transient(answer, part, np.array(TIMES)))
        return heat.free, len(answer.trajectory.steps), traces

    def read(answer: Answer) -> dict[str, Any]:
        unknowns, steps, found = answer
        if not options["transient"]:
            return {"values": {q: [float(found[q])] for q in QUANTITIES}, "unknowns": unknowns, "steps": steps}
        values = {q: (found[q.replace("_rise", "")] - sink.room_temperature).tolist() for q in QUANTITIES[:3]}
        return {"values": {**values, "current_A": found["current_A"].tolist()}, "unknowns": unknowns, "steps": steps}

    return solve, read


def _uniform(sink: Sink, heat: HeatProblem, accuracy: float) -> Quantities:
    """The steady state with a current density that does not vary, by Picard's iteration."""
    names = [box.name for box in heat.domain.scene.boxes]
    beam = heat.domain.space.on(np.flatnonzero(heat.domain.body == names.index("beam")))
    rho, warms = room_resistivity(sink.silicon, sink.room_temperature)
    rise, change = np.zeros(heat.size), np.inf
    while change > accuracy:
        warm = 1 + warms * beam.value(heat.field(rise))
        # The weights in the quarter's beam make its mean.
        resistance = rho * sink.length / sink.cross_section * (beam.weights * warm).sum() / beam.weights.sum()
        current = sink.voltage / resistance
        load = heat.take(beam.load(rho * (current / sink.cross_section) ** 2 * warm))
        before, rise = rise, heat.whole(heat.solve_steady(load[: heat.free]))
        change = float(np.abs(rise - before).max() / np.abs(rise).max())
    rows = {
        probe.name: reading(heat, probe).row for probe in heat.domain.scene.probes if probe.quantity == "temperature"
    }
    found = {f"{name}_rise_K": np.array(rows[name] @ rise) for name in ("peak", "end", "mean")}
    return {**found, "current_A": np.array(current)}
