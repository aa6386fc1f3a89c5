"""The heat problem of the quarter, by phases: ``options`` are the ``path`` ("own", "scikit-fem" with scipy's splu, or
"ngsolve" with its sparse Cholesky), the ``degree`` and the ``cuts``. The making of the mesh is not timed."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from types import SimpleNamespace
from typing import Any

import numpy as np

from fem3d.assembly import assemble
from fem3d.domain import boxes
from meshes.grid import Grid
from scenes.loading import load
from scenes.model import Scene
from validate.bench import problem
from validate.bench.tools import skfem_sink

with suppress(ImportError):  # it has no entries then
    from validate.verify import ngsolve_sink

SOLVES = 5


def prepare(options: dict[str, Any]) -> tuple[Callable[[], dict[str, Any]], Callable[[Any], dict[str, Any]]]:
    """Assembly, factorization and solves, each timed (s of the processor)."""
    path, degree, scene = options["path"], options["degree"], problem.quarter(load("sink", []))
    grid = problem.graded(scene, 1e-2, options["cuts"], 1 if path == "scikit-fem" else degree)
    assembly = PATHS[path](scene, grid, degree)

    def solve() -> dict[str, Any]:
        times = [time.process_time()]
        matrices = assembly()
        times.append(time.process_time())
        once = matrices.factors(0.0, 1.0)
        times.append(time.process_time())
        for _ in range(SOLVES):
            once(np.ones(matrices.size))
        times.append(time.process_time())
        first, second, solves = np.diff(times).tolist()
        phases = {"assembly": first, "factorization": second, "one solve": solves / SOLVES}
        return {"phases": phases, "unknowns": int(getattr(matrices, "unknowns", matrices.size))}

    return solve, dict


def _own(scene: Scene, grid: Grid, _: int) -> Callable[[], Any]:
    def assembled() -> SimpleNamespace:
        heat = assemble(boxes(scene, grid))
        return SimpleNamespace(size=heat.free, factors=lambda *_: heat.solve_steady)

    return assembled


def _ngsolve(_: Scene, grid: Grid, degree: int) -> Callable[[], Any]:
    mesh = ngsolve_sink.mesh_of(grid)
    return lambda: ngsolve_sink.Matrices(mesh, grid, degree, degree)


PATHS: dict[str, Callable[[Scene, Grid, int], Callable[[], Any]]] = {
    "own": _own, "scikit-fem": skfem_sink.matrices, "ngsolve": _ngsolve,
}  # fmt: skip
"""By path what assembles its stiffness and mass, which ``factors(0, 1)`` makes solves of."""
