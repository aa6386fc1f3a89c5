"""This toolkit's heat problem on a given mesh: ``options`` are ``degree`` and ``cuts``; what each phase takes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fem3d import operators
from fem3d.factorization import factorize
from meshes import symmetry
from scenes.loading import load
from validate.bench import cells
from validate.bench.phases import Phases


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Phases], Callable[[Phases], dict[str, Any]]]:
    """Assembly, factorization and solves, each timed."""
    scene = symmetry.reduce(load("sink", []).scene()).scene
    given = cells.graded(scene, 1e-2, options["cuts"], options["degree"])

    def solve() -> Phases:
        phases = Phases()
        with phases.timed("assembly"):
            heat = operators.assemble(scene, cells.anew(given))
            matrix = heat.inner_stiffness
        with phases.timed("factorization"):
            factors = factorize(matrix)
        load_vector = heat.mass.sum(axis=0)[: heat.free]
        with phases.timed("one solve", repeats=5):
            for _ in range(5):
                factors.solve(load_vector)
        phases.unknowns = heat.free
        return phases

    return solve, Phases.read
