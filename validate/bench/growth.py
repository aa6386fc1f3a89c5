"""How time and memory grow with the unknowns of the quarter's heat problem: each phase's exponent, and which phase
rises most."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from meshes.grid import Grid
from scenes.loading import load
from scenes.model import Scene
from validate.bench import measure, problem
from validate.bench.entries import NGSOLVE, Entry

CUTS = (1, 2, 4, 7, 12, 18)
PATHS = (
    ("this toolkit, degree 2", "own", 2),
    ("this toolkit, degree 4", "own", 4),
    ("scikit-fem and scipy, degree 2", "scikit-fem", 2),
    ("NGSolve, order 2", "ngsolve", 2),
)
QUICK = (PATHS[0], PATHS[3])
FOR_DEGREE_4 = (1, 2, 3, 5, 8)
LARGE = 4000  # unknowns above which exponents are fitted
SOLVES = 5


def run(quick: bool, count: int, installed: frozenset[str], progress: Callable[[str], None]) -> dict[str, Any]:
    """``rows`` for each path and size, in their order, and their ``exponents``."""
    entries = [
        Entry(name, f"{cuts}", "growth", {"path": path, "degree": degree, "cuts": cuts})
        for name, path, degree in (PATHS if not quick else QUICK)
        for cuts in (CUTS if degree == 2 else FOR_DEGREE_4)[: 2 if quick else None]
        if path != "ngsolve" or NGSOLVE in installed
    ]
    rows = measure.in_turns(entries, count, progress, patient=False)
    for row in rows:
        row["path"] = row.pop("tool")
        if not row["failure"]:
            row["own_MB"] = row["peak_MB"] - row["imported_MB"]
    return {"rows": rows, "exponents": exponents(rows)}


def exponents(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """For each path the slopes of log time, by phase, and of log memory over log unknowns, from LARGE unknowns on;
    ``rises``: the phase with the largest slope, ``largest``: the one that takes most at the largest size."""
    fits = []
    for path in dict.fromkeys(row["path"] for row in rows):
        mine = [r for r in rows if r["path"] == path and not r["failure"] and r["unknowns"] >= LARGE]
        if len(mine) < 2:
            continue
        n, phases = np.log([r["unknowns"] for r in mine]), mine[0]["phases"]
        sizes = {p: [max(r["phases"][p], 1e-6) for r in mine] for p in phases}
        sizes["memory"] = [max(r["own_MB"], 0.1) for r in mine]
        slopes = {name: float(np.polyfit(n, np.log(size), 1)[0]) for name, size in sizes.items()}
        largest = max(phases, key=mine[-1]["phases"].__getitem__)
        rises = max(phases, key=slopes.__getitem__)
        fits.append({"path": path, "exponents": slopes, "rises": rises, "largest": largest})
    return fits


def prepare(options: dict[str, Any]) -> tuple[Callable[[], dict[str, Any]], Callable[[Any], dict[str, Any]]]:
    """Assembly, factorization and solves, each timed (s of the processor); the making of the mesh is not. ``path`` is
    "own", "scikit-fem" with scipy's splu, or "ngsolve" with its sparse Cholesky."""
    path, degree, scene = options["path"], options["degree"], problem.quarter(load("sink", []))
    grid = problem.graded(scene, 1e-2, options["cuts"], 1 if path == "scikit-fem" else degree)
    assembly = _assembly(path, scene, grid, degree)

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


def _assembly(path: str, scene: Scene, grid: Grid, degree: int) -> Callable[[], Any]:
    """What assembles stiffness and mass, which ``factors(0, 1)`` makes solves of."""
    if path == "ngsolve":
        from validate.verify import ngsolve_sink

        mesh = ngsolve_sink.mesh_of(grid)
        return lambda: ngsolve_sink.Matrices(mesh, grid, degree, degree)
    if path == "scikit-fem":
        from validate.bench.tools import skfem_sink
        from validate.verify import reference

        full = skfem_sink.assembly(scene, grid, degree)
        return lambda: reference.Inner(full())
    from fem3d.problems.assembly import assemble
    from fem3d.spaces.domain import boxes

    def toolkit() -> SimpleNamespace:
        heat = assemble(boxes(scene, grid))
        return SimpleNamespace(size=heat.free, factors=lambda *_: heat.solve_steady)

    return toolkit
