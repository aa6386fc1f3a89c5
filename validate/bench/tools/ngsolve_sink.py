"""NGSolve's sink (`verify.ngsolve_sink`) on the cells that every entry gets: the ``options`` there and ``grading`` (the
cells), ``transient``, ``steps`` in each interval of time, ``method`` (its order, 2 to 4), ``tolerance``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scenes.loading import load
from validate.bench.problem import graded, numbers, quarter, solved
from validate.verify import ngsolve_sink

Answer = tuple[int, list[list[float]]]


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Answer], Callable[[Answer], dict[str, Any]]]:
    """Assemble and solve the quarter on its mesh; read the numbers."""
    sink = load("sink", [])
    grid = graded(quarter(sink), options["grading"], 1, options["order"], options["layers"])
    mesh = ngsolve_sink.mesh_of(grid)

    def solve() -> Answer:
        problem = ngsolve_sink.Problem(sink, mesh, grid, options | {"steady": not options["transient"]})
        return sum(problem.space.FreeDofs()), solved(options, problem, problem.space.ndof)

    return solve, lambda answer: numbers(options, *answer)
