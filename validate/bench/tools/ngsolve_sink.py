"""NGSolve's sink (`verify.ngsolve_sink`) on the cells that every entry gets: ``order``, ``layers`` and ``electric`` as
there, ``grading`` (the cells), ``transient``, ``steps`` in each interval of time, ``method`` (its order, 2 to 4),
``tolerance``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scenes.loading import load
from validate.bench.problem import Answer, graded, quarter, stepped
from validate.verify import ngsolve_sink


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Answer], Callable[[Answer], dict[str, Any]]]:
    """Assemble and solve the quarter on its mesh; read the numbers."""
    sink, orders = load("sink", []), (options["order"], options["layers"])
    grid = graded(quarter(sink), options["grading"], 1, *orders)
    mesh, steady = ngsolve_sink.mesh_of(grid), not options["transient"]
    return stepped(options, lambda: ngsolve_sink.Problem(sink, mesh, grid, *orders, options["electric"], steady))
