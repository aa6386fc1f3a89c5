"""The heat problem of the quarter, by phases: ``options`` are the ``path`` ("own", "scikit-fem" with scipy's splu, or
"ngsolve" with its sparse Cholesky), the ``degree`` and the ``cuts``. The making of the mesh is not timed."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d.assembly import HeatProblem, assemble
from fem3d.domain import boxes
from scenes.loading import load
from validate.bench import problem
from validate.bench.tools.skfem_sink import factors, matrices
from validate.verify import reference

try:
    import ngsolve as ng

    from validate.bench.tools import hexahedra
except ImportError:
    pass  # it has no entries then

SOLVES = 5
Job = Callable[[], dict[str, Any]]


def prepare(options: dict[str, Any]) -> tuple[Job, Callable[[dict[str, Any]], dict[str, Any]]]:
    """Assembly of stiffness and mass, factorization and solves, each timed."""
    return PATHS[options["path"]](options["degree"], options["cuts"]), dict


def _phases(assemble: Callable[[], Any], factorize: Callable[[Any], Callable[[], Any]], unknowns: Any) -> Job:
    """The processor time (s) of each phase, and the unknowns of what was assembled."""

    def solve() -> dict[str, Any]:
        times = [time.process_time()]
        assembled = assemble()
        times.append(time.process_time())
        once = factorize(assembled)
        times.append(time.process_time())
        for _ in range(SOLVES):
            once()
        times.append(time.process_time())
        assembly, factorization, solves = np.diff(times).tolist()
        phases = {"assembly": assembly, "factorization": factorization, "one solve": solves / SOLVES}
        return {"phases": phases, "unknowns": int(unknowns(assembled))}

    return solve


def _own(degree: int, cuts: int) -> Job:
    scene = problem.quarter(load("sink", []))
    grid = problem.graded(scene, 1e-2, cuts, degree)

    def factorize(heat: HeatProblem) -> Callable[[], Any]:
        heat.solve_steady(np.zeros(heat.free))
        return lambda: heat.solve_steady(np.ones(heat.free))

    return _phases(lambda: assemble(boxes(scene, grid)), factorize, lambda heat: heat.free)


def _scikit_fem(degree: int, cuts: int) -> Job:
    grid = problem.graded(problem.quarter(load("sink", [])), 1e-2, cuts, 1)
    mesh, owner = reference.hexahedra(grid)

    def factorize(assembled: Any) -> Callable[[], Any]:
        _, free, stiffness, _ = assembled
        solved = factors(stiffness)
        return lambda: solved(np.ones(len(free)))

    return _phases(lambda: matrices(mesh, owner, grid.boxes, degree), factorize, lambda found: len(found[1]))


def _ngsolve(degree: int, cuts: int) -> Job:
    grid = problem.graded(problem.quarter(load("sink", [])), 1e-2, cuts, degree)
    mesh = hexahedra.of(grid)
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

    return _phases(assembled, factorize, lambda parts: sum(parts[0].FreeDofs()))


PATHS: dict[str, Callable[[int, int], Job]] = {"own": _own, "scikit-fem": _scikit_fem, "ngsolve": _ngsolve}
