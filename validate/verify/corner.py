"""The order in unknowns of the current of an L-shaped conductor on tetrahedra: halved everywhere, and where needed.

At the inner corner the potential goes like r^(2/3), so that cells of size h miss h^(4/3) of the current whatever their
degree (Strang and Fix, An Analysis of the Finite Element Method, chapter 8). Uniform cells number h^-3; where those
along the edge alone are halved, their number goes like 1/h, and less fast where cells stay long along it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.rows import Row
from fem3d.adaptivity.loop import Search, Verdict
from fem3d.adaptivity.tetrahedra import Tetrahedra
from fem3d.runs import scene as scene_run
from scenes.model import Boundary, Box, Material, Probe, Scene
from validate.verify.expected import observed_order, order_row

FAMILY, CASE = "observed orders of convergence in space", "L-shaped conductor, tetrahedra of degree 3"
WIDTH, ARM = 1e-5, 4  # m; in widths
UNIFORM, LOCAL = 4_000, 10_000  # unknowns from which on a mesh is the last: some 1 s and 4 s
FIRST = 1_000  # unknowns from which on local refinement is local: on fewer cells all others follow
Finer = Callable[[Search, Any, Verdict], Any]


def rows() -> Iterator[Row]:
    """The orders of uniform refinement, on the last two meshes, and of local refinement, which is uneven from level to
    level, from the first of `FIRST` unknowns to the last."""
    uniform = levels(lambda search, mesh, verdict: halved(mesh), UNIFORM)[-2:]
    local = levels(lambda search, mesh, it: mesh.refined(it.goals, it.falls, it.worst, search.enough), LOCAL)
    local = [level for level in local if level[0] >= FIRST]
    for named, theory, series in (("uniformly halved", 4 / 9, uniform), ("halved where it is missed", 4 / 3, local)):
        (few, coarse), (many, fine) = series[0], series[-1]
        order, note = observed_order([coarse, fine], many / few), "a square corner: 1 - 2 ln2/pi"
        yield order_row(FAMILY, CASE, f"current by unknowns, {named}", theory, order, note, series is local)


def halved(mesh: Tetrahedra) -> Tetrahedra:
    """The mesh with all cells halved along all axes, as if no edge were sharp."""
    nowhere = np.zeros((3, mesh.laid.cells.nvertices), bool)
    return replace(mesh, laid=mesh.laid.finer(np.ones((3, mesh.size.cells), bool), nowhere), levels=mesh.levels + 1)


def levels(finer: Finer, most: int) -> list[tuple[int, float]]:
    """The unknowns and the relative error of the current of each mesh, until one has ``most`` unknowns."""
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
    # What the mesh itself leaves, without what is known of that.
    study = replace(study, extrapolated=False)
    search, levels = Search(study, True, False, lambda _: None), list[tuple[int, float]]()
    while mesh is not None and (not levels or levels[-1][0] < most):
        verdict = search.judge(mesh, len(levels))
        assert verdict.answer is not None
        assert verdict.answer.steady is not None
        current = float(verdict.answer.steady.quantities["current"])
        levels.append((verdict.answer.heat.size, abs(current / exact - 1)))
        mesh = finer(search, mesh, verdict)
    return levels
