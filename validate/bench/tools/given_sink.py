"""This toolkit's 3D solver on a given mesh, as the other programs get it: no mesh is sought, no error estimated.

``options``: ``degree`` of the elements in x and y, ``depth`` in z, ``grading``, ``cuts``, ``across`` (the cells),
``transient``, ``accuracy`` of the coupled iteration and of the steps, ``generations`` of Krylov fields. The electric
problem is solved in full; the current's pattern is followed where the iteration finds that it matters.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d import operators, outputs, sink_quantities, transient
from fem3d import steady as coupled
from fem3d.study import Quantities
from meshes import symmetry
from scenes.loading import load
from validate.bench import cells
from validate.bench.sample import QUANTITIES, TIMES

Answer = tuple[int, int, Quantities]


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Answer], Callable[[Answer], dict[str, Any]]]:
    """Assemble and solve the quarter on its mesh; read the numbers."""
    sink = load("sink", [])
    part = symmetry.reduce(sink.scene())
    study = sink_quantities.study(sink, part)
    given = cells.graded(
        part.scene, options["grading"], options["cuts"], options["degree"], options["across"], options["depth"]
    )

    def solve() -> Answer:
        heat = operators.assemble(part.scene, cells.anew(given), balanced=False)
        state = coupled.solve(heat, sink.voltage, options["accuracy"])
        if not options["transient"]:
            return heat.free, 0, study.steady(outputs.of_steady(state, part))
        base = transient.Base.of_steady(state)
        shift = transient.shift(transient.time_constant(state), study.earliest)
        reduced = base.project(transient.Krylov(base, shift).fields(options["generations"]))
        answer = transient.march(base, reduced, study.end, options["accuracy"])
        traces = study.traces(outputs.of_transient(answer, part, np.array(TIMES)))
        return heat.free, len(answer.trajectory.steps), traces

    def read(answer: Answer) -> dict[str, Any]:
        unknowns, steps, found = answer
        if not options["transient"]:
            return {"values": {q: [float(found[q])] for q in QUANTITIES}, "unknowns": unknowns, "steps": steps}
        values = {q: (found[q.replace("_rise", "")] - sink.room_temperature).tolist() for q in QUANTITIES[:3]}
        return {"values": {**values, "current_A": found["current_A"].tolist()}, "unknowns": unknowns, "steps": steps}

    return solve, read
