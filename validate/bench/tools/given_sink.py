"""This toolkit's 3D solver on a given grid, as the other programs get it: no grid is sought, no error estimated.

``options``: ``degree`` of the elements, ``layers`` that across thin layers, ``grading`` (the cells), ``transient``,
``accuracy`` of the coupled iteration and of the steps, ``generations`` of Krylov fields, ``electric`` "full" or, in
the steady state, "uniform" as in `ngsolve_sink`. In full the current's pattern is followed where the iteration finds
that it matters.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from fem3d.adaptivity import nested
from fem3d.problems import conductors
from fem3d.problems.assembly import assemble
from fem3d.problems.heat import HeatProblem
from fem3d.results import outputs
from fem3d.results.probes import reading
from fem3d.results.study import Quantities
from fem3d.runs import sink_quantities
from fem3d.solution import steady, transient
from fem3d.spaces.domain import boxes
from meshes import symmetry
from scenes.loading import load
from scenes.sink import Sink
from validate.bench.entries import UNIFORM
from validate.bench.problem import QUANTITIES, TIMES, graded
from validate.verify.methods import Uniform, settle

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
        state = steady.coupled(heat, conductors.find(heat, nested.SOLVED * accuracy), True, study.voltage, accuracy)
        if not options["transient"]:
            return heat.free, 0, study.steady(outputs.of_steady(state, part))
        base = transient.Base.of_steady(state)
        shift = transient.shift(transient.time_constant(state), study.earliest)
        reduced = base.project(transient.Krylov(base, shift).fields(options["generations"]))
        answer = transient.march(base, reduced, study.end, accuracy)
        traces = study.traces(outputs.of_transient(answer, part, np.array(TIMES)))
        return heat.free, len(answer.trajectory.steps), traces

    def read(answer: Answer) -> dict[str, Any]:
        unknowns, steps, quantities = answer
        if not options["transient"]:
            return {"values": {q: [float(quantities[q])] for q in QUANTITIES}, "unknowns": unknowns, "steps": steps}
        values = {q: (quantities[q.replace("_rise", "")] - sink.room_temperature).tolist() for q in QUANTITIES[:3]}
        return {
            "values": {**values, "current_A": quantities["current_A"].tolist()},
            "unknowns": unknowns,
            "steps": steps,
        }

    return solve, read


def _uniform(sink: Sink, heat: HeatProblem, accuracy: float) -> Quantities:
    """The steady state with a current density that does not vary."""
    scene, space = heat.domain.scene, heat.domain.space
    beam = space.on(np.flatnonzero(heat.domain.body == [box.name for box in scene.boxes].index("beam")))
    probes = {probe.name: probe for probe in scene.probes}
    peak, end, mean = (reading(heat, probes[name]).row[: heat.free] for name in ("peak", "end", "mean"))

    def weighed(rise: np.ndarray) -> np.ndarray:
        return heat.take(beam.load(beam.value(heat.field(rise))))[: heat.free]

    uniform = Uniform(sink, peak, end, mean, weighed)
    problem = SimpleNamespace(load=uniform.load, factors=lambda *_: heat.solve_steady, size=heat.free)
    values = uniform.quantities(settle(problem, accuracy))
    return dict(zip(QUANTITIES, map(np.array, values), strict=True))
