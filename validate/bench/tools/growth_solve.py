"""The heat problem of the quarter, by phases: ``options`` are the ``path`` ("own", "scikit-fem" with scipy's splu, or
"ngsolve" with its sparse Cholesky), the ``degree`` and the ``cuts``. The making of the mesh is not timed."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d.assembly import HeatProblem, assemble
from fem3d.domain import boxes
from meshes.grid import Grid
from scenes.loading import load
from validate.bench import problem
from validate.bench.tools.skfem_sink import Matrices
from validate.verify import reference

try:
    import ngsolve as ng

    from validate.verify import ngsolve_sink
except ImportError:
    pass  # it has no entries then

SOLVES = 5
# Assembly of stiffness and mass, their factorization to a solve, and the unknowns of what was assembled.
Phases = tuple[Callable[[], Any], Callable[[Any], Callable[[], Any]], Callable[[Any], int]]


def prepare(options: dict[str, Any]) -> tuple[Callable[[], dict[str, Any]], Callable[[Any], dict[str, Any]]]:
    """Assembly, factorization and solves, each timed (s of the processor)."""
    path, degree = options["path"], options["degree"]
    grid = problem.graded(
        problem.quarter(load("sink", [])), 1e-2, options["cuts"], 1 if path == "scikit-fem" else degree
    )
    assembly, factorization, unknowns = PATHS[path](grid, degree)

    def solve() -> dict[str, Any]:
        times = [time.process_time()]
        assembled = assembly()
        times.append(time.process_time())
        once = factorization(assembled)
        times.append(time.process_time())
        for _ in range(SOLVES):
            once()
        times.append(time.process_time())
        first, second, solves = np.diff(times).tolist()
        phases = {"assembly": first, "factorization": second, "one solve": solves / SOLVES}
        return {"phases": phases, "unknowns": int(unknowns(assembled))}

    return solve, dict


def _own(grid: Grid, _: int) -> Phases:
    scene = problem.quarter(load("sink", []))

    def factorize(heat: HeatProblem) -> Callable[[], Any]:
        heat.solve_steady(np.zeros(heat.free))
        return lambda: heat.solve_steady(np.ones(heat.free))

    return lambda: assemble(boxes(scene, grid)), factorize, lambda heat: heat.free


def _scikit_fem(grid: Grid, degree: int) -> Phases:
    mesh, owner = reference.hexahedra(grid)

    def factorize(matrices: Matrices) -> Callable[[], Any]:
        solve = matrices.factors(0.0, 1.0)
        return lambda: solve(np.ones(len(matrices.free)))

    return lambda: Matrices(mesh, owner, grid.boxes, degree), factorize, lambda matrices: len(matrices.free)


def _ngsolve(grid: Grid, degree: int) -> Phases:
    mesh = ngsolve_sink.mesh_of(grid)
    materials = {box.name: box.material for box in grid.boxes}

    def assembled() -> tuple[Any, Any, Any]:
        space = ng.H1(mesh, order=degree, dirichlet="substrate")
        u, v = space.TnT()
        k = mesh.MaterialCF({n: m.thermal_conductivity for n, m in materials.items()})
        c = mesh.MaterialCF({n: m.heat_capacity for n, m in materials.items()})
        stiffness = ng.BilinearForm(k * ng.grad(u) * ng.grad(v) * ng.dx, symmetric=True).Assemble().mat
        return space, stiffness, ng.BilinearForm(c * u * v * ng.dx, symmetric=True).Assemble().mat

    def factorize(parts: tuple[Any, Any, Any]) -> Callable[[], Any]:
        space, stiffness, mass = parts
        inverse = stiffness.Inverse(space.FreeDofs(), inverse="sparsecholesky")
        one, found = mass.CreateColVector(), mass.CreateColVector()
        one[:] = 1.0

        def once() -> None:
            found.data = inverse * one

        return once

    return assembled, factorize, lambda parts: sum(parts[0].FreeDofs())


PATHS: dict[str, Callable[[Grid, int], Phases]] = {"own": _own, "scikit-fem": _scikit_fem, "ngsolve": _ngsolve}
