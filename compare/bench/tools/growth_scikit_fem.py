"""The heat problem in scikit-fem with scipy's splu as it comes: ``options`` are ``degree`` (1 or 2) and ``cuts``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from compare.bench import cells
from compare.bench.phases import Phases
from fem3d import reference
from meshes import symmetry
from scenes.loading import load


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Phases], Callable[[Phases], dict[str, Any]]]:
    """Assembly, factorization and solves, each timed."""
    scene = symmetry.reduce(load("sink", []).scene()).scene
    given = cells.graded(scene, 1e-2, options["cuts"], options["degree"])

    def solve() -> Phases:
        phases = Phases()
        with phases.timed("assembly"):
            full = reference.assemble(scene, given)
            matrix = csc_matrix(full.stiffness[full.free][:, full.free])
        with phases.timed("factorization"):
            factors = splu(matrix)
        with phases.timed("one solve", repeats=5):
            for _ in range(5):
                factors.solve(np.ones(len(full.free)))
        phases.unknowns = len(full.free)
        return phases

    return solve, Phases.read
