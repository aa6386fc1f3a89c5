"""The order in unknowns of the current of an L-shaped conductor on tetrahedra that are refined where needed.

At the inner corner the potential goes like r^(2/3), so that cells of size h miss h^(4/3) of the current whatever their
degree (Strang and Fix, An Analysis of the Finite Element Method, chapter 8). Uniform cells number h^-3; where cells
along the edge alone are halved, their number goes like 1/h, and less fast where cells stay long along it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.rows import Row
from fem3d.adaptivity.adapt import Search
from fem3d.runs import scene as scene_run
from scenes.model import Boundary, Box, Material, Probe, Scene
from validate.verify.expected import observed_order, order_row

FAMILY, CASE = "observed orders of convergence in space", "L-shaped conductor, tetrahedra of degree 3"
WIDTH, ARM = 1e-5, 4  # m; in widths
FIRST, LAST = 1_000, 10_000  # unknowns: on fewer all cells are refined; from LAST on a mesh is the last


def rows() -> Iterator[Row]:
    """Yield the order from the first mesh of `FIRST` unknowns to the last: it is uneven from level to level."""
    (few, coarse), *_, (many, fine) = [level for level in levels(LAST) if level[0] >= FIRST]
    order = observed_order([coarse, fine], many / few)
    yield order_row(FAMILY, CASE, "current by unknowns", 4 / 3, order, "a square corner: 1 - 2 ln2/pi", at_least=True)


def levels(most: int) -> list[tuple[int, float]]:
    """Return the unknowns and the relative error of the current of each mesh, until one has ``most`` unknowns."""
    metal, far = Material("metal", 1.0, 1.0, 1.0, 1e-6), (ARM + 1) * WIDTH
    boxes = (
        Box("along x", metal, (0.0, 0.0, 0.0), (far, WIDTH, WIDTH)),
        Box("along y", metal, (ARM * WIDTH, WIDTH, 0.0), (far, far, WIDTH)),
    )
    near = (0.0, 0.0, 0.0), (0.0, WIDTH, WIDTH)
    ends = (
        Boundary("plus", "voltage", *near, 1.0),
        Boundary("minus", "voltage", (ARM * WIDTH, far, 0.0), (far, far, WIDTH), 0.0),
    )
    probes = (Probe("current", *near, "current"),)
    # No mesh reaches that accuracy: the last one is the largest.
    scene = Scene("L", boxes, ends, probes, accuracy=1e-9, steady=True, mesh="tetrahedra")
    exact = WIDTH / 1e-6 / (2 * ARM + 1 - 2 * np.log(2) / np.pi)
    study, mesh = scene_run.start(scene)
    # The error of the mesh itself, without the extrapolation.
    study = replace(study, extrapolated=False)
    search, levels = Search(study, True, False, lambda _: None), list[tuple[int, float]]()
    while mesh is not None and (not levels or levels[-1][0] < most):
        verdict = search.judge(mesh, len(levels))
        assert verdict.answer is not None
        assert verdict.answer.steady is not None
        current = float(verdict.answer.steady.quantities["current"])
        levels.append((verdict.answer.heat.size, abs(current / exact - 1)))
        mesh = mesh.refine(verdict.indicators, search.enough)
    return levels
