"""The heat problem in scikit-fem with scipy's splu: ``options`` are ``degree`` (1 or 2) and ``cuts``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from meshes import symmetry
from scenes.loading import load
from validate.bench import cells
from validate.bench.phases import Phases
from validate.bench.tools.skfem_sink import factors, matrices
from validate.verify import reference


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Phases], Callable[[Phases], dict[str, Any]]]:
    """Assembly, factorization and solves, each timed."""
    brick = cells.graded(symmetry.reduce(load("sink", []).scene()).scene, 1e-2, options["cuts"], 1)
    mesh, owner = reference.hexahedra(brick)

    def solve() -> Phases:
        phases = Phases()
        with phases.timed("assembly"):
            _, free, stiffness, _ = matrices(mesh, owner, brick.boxes, options["degree"])
        with phases.timed("factorization"):
            solved = factors(stiffness)
        with phases.timed("one solve", repeats=5):
            for _ in range(5):
                solved(np.ones(len(free)))
        phases.unknowns = len(free)
        return phases

    return solve, Phases.read
