"""The full-order path of this toolkit: scikit-fem's hexahedra, Picard's iteration, SDIRK of order 3, scipy's splu.

``options``: ``degree`` 1 or 2, ``grading`` (the accuracy the cells are graded for), ``cuts``, ``transient`` and
``steps`` in each interval of time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fem3d.study import Quantities
from meshes import symmetry
from scenes.loading import load
from validate.bench.problem import QUANTITIES, at_times, graded, numbers, step_times
from validate.verify import reference

Answer = tuple[int, list[Quantities]]


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Answer], Callable[[Answer], dict[str, Any]]]:
    """Assemble and solve the quarter on its mesh; read the numbers."""
    sink = load("sink", [])
    part = symmetry.reduce(sink.scene())
    mesh = graded(part.scene, options["grading"], options["cuts"], options["degree"])

    def solve() -> Answer:
        full = reference.assemble(part.scene, mesh)
        if not options["transient"]:
            rise = reference.steady(full)
            return len(full.free), [reference.quantities(sink, part, full, rise)]
        times = step_times(options["steps"])
        marched = reference.transient(full, times)
        found = [reference.quantities(sink, part, full, *marched[i]) for i in at_times(times)]
        return len(full.free), found

    def read(answer: Answer) -> dict[str, Any]:
        unknowns, found = answer
        return numbers(options, unknowns, [[float(f[q]) for q in QUANTITIES] for f in found])

    return solve, read
