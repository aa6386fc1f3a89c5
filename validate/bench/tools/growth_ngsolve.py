"""The heat problem in NGSolve with its sparse Cholesky: ``options`` are ``degree`` and ``cuts``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import ngsolve as ng

from meshes import symmetry
from scenes.loading import load
from validate.bench import cells
from validate.bench.phases import Phases
from validate.bench.tools import hexahedra


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Phases], Callable[[Phases], dict[str, Any]]]:
    """Assembly (of both matrices, as the others), factorization and solves, each timed."""
    brick = cells.graded(symmetry.reduce(load("sink", []).scene()).scene, 1e-2, options["cuts"], 1)
    mesh = hexahedra.of(brick, (options["degree"],) * 3)

    def solve() -> Phases:
        phases = Phases()
        with phases.timed("assembly"):
            space = ng.H1(mesh, order=options["degree"], dirichlet="substrate")
            u, v = space.TnT()
            materials = {box.name: box.material for box in brick.boxes}
            k = mesh.MaterialCF({n: m.thermal_conductivity for n, m in materials.items()})
            c = mesh.MaterialCF({n: m.heat_capacity for n, m in materials.items()})
            stiffness = ng.BilinearForm(k * ng.grad(u) * ng.grad(v) * ng.dx, symmetric=True).Assemble().mat
            mass = ng.BilinearForm(c * u * v * ng.dx, symmetric=True).Assemble().mat
        with phases.timed("factorization"):
            inverse = stiffness.Inverse(space.FreeDofs(), inverse="sparsecholesky")
        one, found = mass.CreateColVector(), mass.CreateColVector()
        one[:] = 1.0
        with phases.timed("one solve", repeats=5):
            for _ in range(5):
                found.data = inverse * one
        phases.unknowns = sum(space.FreeDofs())
        return phases

    return solve, Phases.read
