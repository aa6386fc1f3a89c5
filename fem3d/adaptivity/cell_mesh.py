"""Meshes of tetrahedra, refined by their error indicators, and of hexahedra, refined everywhere.

The spaces are of degrees 1 to 3 on tetrahedra, 1 and 2 on hexahedra and where memory is short.

On cells of any shape an error bound adds absolute contributions and allows for slow rates: it holds, and is often ten
times the error. Earlier meshes show by how much. Let the errors of a reading J on two meshes be the same fraction i of
their estimates E, the inverse of the effectivity index (Ainsworth and Oden, A Posteriori Error Estimation in Finite
Element Analysis, Wiley 2000). Then |J_2 - J_1| = i (E_1 - E_2), and `corrected` states i E_2 with a safety factor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import skfem

from fem3d.adaptivity.brick_mesh import Bricks
from fem3d.adaptivity.estimator import Estimator, tail
from fem3d.adaptivity.goal_errors import Level, Record
from fem3d.adaptivity.mesh import ADVICE, AIM, LARGE, Indicators, Mesh, warn_of_accuracy
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.problems.heat import HeatProblem
from fem3d.results.outputs import Study
from fem3d.spaces import edge_exponents
from fem3d.spaces.domain import Domain, box_domain, group_domain
from fem3d.spaces.size import START_UP, Size, allowed_memory, fits_memory, memory_limit, size_of_cells, size_of_grid
from meshes import grading
from meshes import grid as grids
from meshes.columns import Columns
from meshes.grouped import check
from meshes.grouped.check import Placed
from meshes.grouped.model import refine
from meshes.grouped.read import read
from scenes.errors import TooLargeError
from scenes.free.grid import crowding
from scenes.model import AnyScene, MeshScene
from scenes.result import Step

# Errors of extrapolated readings are at most this part of their estimates: none of 46 random plates, Gmsh meshes and
# stacks exceeds 0.70 of this bound.
AS_IT_IS = 0.5
UNMOVED = 1e-8  # relative: smaller errors, and readings that move less, show rounding alone
# A reading that moves by more than its estimate falls is wrong by more than estimated. Its bound is then twice its
# fraction, where the estimate fell to this part or less: by less it may fall by chance.
FELL = 0.8
# Largest number of unknowns of a refined mesh unless run.memory is given: about a minute of one processor, for a
# transient and for a steady state. A larger mesh is solved as it is.
FEWER, MOST_UNKNOWNS = 60_000, 150_000


def corrected(level: Level, history: Sequence[Record], unseen: np.ndarray | float = 1.0) -> Level:
    """Return a level with errors and indicators corrected by the ``history`` of earlier meshes.

    No error is below ``level.least``, nor below its estimate where this is no smaller than on the mesh before, which
    was then refined for other readings, or where a law of the temperature causes errors away from edges. Unless all
    indicators fall from mesh to mesh, they are multiplied by ``unseen`` (3, cells).
    """
    indicated = {n: level.scales[n] * float(level.goals[n].sum()) for n in level.errors}
    record = Record({n: float(v) for n, v in level.fine.quantities.items()}, level.errors, level.scales, indicated)
    part, larger = _fractions(record, history)
    fell = {n for n, e in (history[-1].indicated if history else {}).items() if indicated[n] <= FELL * e}
    slow = unseen if len(fell) < len(indicated) else 1.0
    shares, linear = dict[str, float](), not level.problems.nonlinear
    for n, estimate in level.errors.items():
        most = AS_IT_IS if n in level.extrapolated else 1.0
        share = max(min(part, most) if n in fell and linear else most, level.least[n] / max(estimate, 1e-300))
        slower = float((level.goals[n] * slow).sum() / max(level.goals[n].sum(), 1e-300))
        shares[n] = max(min(share, 1.0) * max(slower, 1.0), larger.get(n, 0.0))
    errors = {n: shares[n] * estimate for n, estimate in level.errors.items()}
    goals = {n: shares.get(n, part) * indicators for n, indicators in level.goals.items()}
    return replace(level, errors=errors, goals=goals, record=record)


def _fractions(now: Record, history: Sequence[Record]) -> tuple[float, Mapping[str, float]]:
    """Return the fraction of each estimate that is stated, the largest |J - J_k| / (E_k - E) of all readings and
    earlier meshes k times a safety factor, at most 1; and a factor above 1 for readings with larger errors."""
    fractions, larger = dict[str, float](), dict[str, float]()
    for before in history:
        for n, estimate in before.errors.items():
            moved, after, rounding = abs(now.values[n] - before.values[n]), now.errors[n], UNMOVED * before.scales[n]
            if min(estimate, moved) > rounding and after > UNMOVED * now.scales[n]:
                fraction = moved / max(estimate - after, 1e-300)
                fractions[n] = max(fractions.get(n, 0.0), fraction)
                if fraction > 1 and after <= FELL * estimate:
                    larger[n] = max(larger.get(n, 0.0), 2 * fraction)
    # One of n readings may be right by chance. Of 37 random plates, combs and stacks with vias no error is above 0.67
    # of this bound on a later mesh, against finer meshes.
    safety, largest = 1 + max(len(fractions), 1) ** -0.5, max(fractions.values(), default=1.0)
    return min(max(safety * largest, 0.25), 1.0), larger


@dataclass(frozen=True, eq=False)
class CellMesh(Mesh):
    """A scene on tetrahedra or hexahedra.

    Attributes
    ----------
    source: the scene on the cells of its file, or on tetrahedra of its boxes.
    why: the reason why boxes are not on bricks.
    degree: the highest degree of the elements.
    levels: how many times the mesh was refined.
    history: estimates of earlier levels, which correct later estimates.
    """

    source: Placed | Columns
    why: str = ""
    degree: int = 3
    levels: int = 0
    history: tuple[Record, ...] = ()

    @property
    def scene(self) -> AnyScene:
        return self.source.scene

    @property
    def cells(self) -> skfem.Mesh:
        """scikit-fem's mesh."""
        return self.source.mesh.mesh if isinstance(self.source, Placed) else self.source.mesh

    @cached_property
    def domain(self) -> Domain:
        if isinstance(self.source, Placed):
            return group_domain(self.source, self.degree)
        return box_domain(self.source.scene, self.source.mesh, self.degree)

    def with_scene(self, scene: Any) -> CellMesh:
        return replace(self, source=replace(self.source, scene=scene), history=())

    @cached_property
    def size(self) -> Size:
        """Cells, unknowns and memory."""
        return size_of_cells(self.domain)

    @property
    def simplex(self) -> bool:
        """Whether cells are tetrahedra."""
        return len(self.cells.t) == 4

    @property
    def _room(self) -> float:
        """The largest growth factor of the unknowns, limited by memory, and by time unless run.memory is given."""
        # Factors grow like n^(4/3) in three dimensions (George, SIAM J. Numer. Anal. 10, 1973).
        room = (memory_limit(self.scene) - START_UP) / (self.size.memory - START_UP)
        most = MOST_UNKNOWNS if self.scene.steady else FEWER
        return float(min(np.inf if self.scene.memory else most / self.size.unknowns, max(room, 0.0) ** (3 / 4)))

    @property
    def last(self) -> bool:
        # Fewer than 1.5 times the unknowns change little; hexahedra are cut into eight.
        return self._room < (1.5 if self.simplex else 8.0)

    @cached_property
    def at_vertices(self) -> np.ndarray:
        """(2, 3, vertices): the exponents of edges, for heat and for current."""
        return edge_exponents.at_vertices(self.domain)

    @cached_property
    def estimator(self) -> Estimator:
        return Estimator.of_cells(self.at_vertices.min(axis=1)[:, self.cells.t].min(axis=1), self.cells, self.degree)

    def examine(self, study: Study, problems: Problems, fine: Solution) -> Level:
        return corrected(super().examine(study, problems, fine), self.history, 1.0 if self.simplex else self._unseen)

    @property
    def _unseen(self) -> np.ndarray:
        """(3, cells): factors on indicators of hexahedra, where one contribution does not show whether contributions
        grow with the degree (`fem3d.adaptivity.estimator`). Layers are at least as thick as cells of the file."""
        corners, estimator = self.cells.p[:, self.cells.t], self.estimator
        stretch = np.linalg.cond((corners[:, 1:4] - corners[:, :1]).T) / 2**self.levels
        return np.asarray(np.maximum((3 + np.pi * stretch) / 5 / tail(estimator.degrees, estimator.slowest), 1.0))

    def refine(self, indicators: Indicators, target: float) -> CellMesh | None:
        """Cut cells with more than their share of the error, largest indicators first, as far as there is room."""
        record = () if indicators.record is None else (indicators.record,)
        if self.last:
            return None
        start = replace(self, history=(*self.history, *record))
        if not self.simplex:
            return start.refine_all()
        by_axis = np.max(indicators.goals, axis=0)
        missing = by_axis.sum(axis=0)
        missing *= max(indicators.worst / max(float(missing.sum()), 1e-300), 1.0)
        too_much = missing > grading.threshold([missing], AIM * target)
        shorter = self._longest(by_axis) & too_much
        order = np.argsort(-missing)
        most = np.searchsorted(np.cumsum(missing[order]), 0.9 * missing.sum()) + 1  # nearly all of the error
        count = min(int(most), int(too_much.sum()))
        while count:
            marked = np.zeros_like(shorter)
            marked[:, order[:count]] = shorter[:, order[:count]]
            finer = start._finer(marked)
            growth = finer.cells.t.shape[1] / shorter.shape[1]
            # A level has at most three times the cells; in a mesh of few the neighbours of a single one may be many.
            if growth <= min(self._room, 3.0 if count > 1 else np.inf):
                return finer
            count //= 2
        return None

    def refine_all(self) -> CellMesh | None:
        finer = None if self.last else self._finer(self._longest())
        return finer if finer and fits_memory(self.scene, finer.size) else None

    def _longest(self, by_axis: np.ndarray | float = 1.0) -> np.ndarray:
        """Return (3, cells) the axes along which to halve each cell, for indicators per axis (3, cells): axes longer
        than half the longest on which indicator times size is no small part. Cells may stay long along an edge."""
        size: np.ndarray = np.ptp(self.cells.p[:, self.cells.t], axis=1)
        varies = by_axis * size
        size[varies < 0.05 * varies.max(axis=0)] = 0.0
        return size > 0.5 * size.max(axis=0)

    def _finer(self, shorter: np.ndarray) -> CellMesh:
        """Return the mesh with cells cut that are to be ``shorter`` along an axis (3, cells).

        Cells of a file are bisected three times to halve their length; boxes are cut near vertices at which gradients
        are infinite. Hexahedra are all cut into eight.
        """
        if isinstance(self.source, Placed):
            mesh = refine(self.source.mesh, np.where(shorter.any(axis=0), 3, 0))
            return replace(self, source=replace(self.source, mesh=mesh), levels=self.levels + 1)
        sharp = self.at_vertices.min(axis=0) < 1
        return replace(self, source=self.source.refined(shorter, sharp), levels=self.levels + 1)

    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        weights = heat.domain.space.on(np.arange(self.size.cells)).weights
        numbers = {
            "cells": self.size.cells, "nodes": heat.size, "refined": self.levels > 0, "lowest_degree": self.degree,
            "highest_degree": self.degree, "volume_m3": float(weights.sum()), "cell_type": "tetra",
        }  # fmt: skip
        if isinstance(self.source, Placed):
            mesh = self.source.mesh
            numbers |= {"volume_groups": sorted(mesh.volumes), "surface_groups": sorted(mesh.surfaces)}
            numbers |= {"file_cells": mesh.file_cells, "cell_type": mesh.file_type}
        return numbers

    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        advice, remarks = ADVICE, list[str]()
        if isinstance(self.source, Placed):
            advice = "give a finer mesh, above all at edges, corners and the rims of electrodes and fixed temperatures"
            remarks += filter(None, [self.source.separation])
        if self.simplex and self.degree < 3:
            remarks.insert(0, f"elements of degree 2, for degree 3 takes more memory: {allowed_memory(self.scene)}")
        return [*warn_of_accuracy(study, relative, f"{self._counted} of degree {self.degree}; {advice}"), *remarks]

    @property
    def _counted(self) -> str:
        return f"{self.size.cells:,} {'tetrahedra' if self.simplex else 'hexahedra'}"

    def plan(self, levels: int | None) -> tuple[Step, ...]:
        cells = f"tetrahedra of the whole scene: {self.why}"
        if isinstance(self.source, Placed):
            cells = f"{self.source.mesh.file_cells} {self.source.mesh.file_type} cells of {self.source.scene.file}"
        how = f"until an estimated error of {self.scene.accuracy:g} is reached or memory or time ends it"
        if levels is not None:
            how = f"{levels} times, to {self._counted}"
        how = f"where readings miss most, {how}" if self.simplex else f"each cell into eight, {how}"
        mesh = Step("mesh", "done", f"{cells}, degree {self.degree}")
        return mesh, Step("refinement", "skipped" if levels == 0 else "done", how)

    def fitting(self) -> CellMesh:
        """Return the mesh with the highest degree that memory has room for: 3 or 2 on tetrahedra.

        Raises TooLargeError where degree 2 does not fit.
        """
        for degree in (3, 2) if self.simplex else (2,):
            mesh = replace(self, degree=degree)
            if fits_memory(self.scene, mesh.size):
                return mesh
        raise TooLargeError(
            f"the {self._counted} of {getattr(self.scene, 'file', 'the scene')} take {mesh.size.memory / 1e9:.2g} GB "
            f"with elements of degree 2, the lowest with an error estimate, and {allowed_memory(self.scene)}; set "
            "run.memory, or use a machine with more memory"
        )


def mesh_of(scene: MeshScene) -> CellMesh:
    """Return the scene on the mesh of its file.

    Raises SceneError where they do not fit together, TooLargeError where the cells take too much memory.
    """
    return CellMesh(check.check(scene, read(scene.path, scene.unit))).fitting()


def choose(study: Study, whole: Study, over_time: bool = False) -> tuple[Study, Mesh]:
    """Return the mesh to begin with for a scene of boxes, and its study.

    A grid of bricks is of the symmetric part. Its planes cross the whole scene: if parts align, bricks need far fewer
    unknowns, for they gain degrees and layers where tetrahedra are halved. Planes that align with no others make a grid
    grow with the square of their number, tetrahedra of the ``whole`` in proportion.

    Raises TooLargeError where both take too much memory.
    """
    scene = study.part.scene
    # With 10 pads beside a meander the unknowns of tetrahedra grow 7.8 times per decade of the accuracy.
    most = LARGE * 7.0 ** max(np.log10(1e-2 / scene.accuracy), 0.0)

    def suits(size: Size) -> bool:
        return size.unknowns <= most and fits_memory(scene, size)

    size = size_of_grid(scene, grids.coarsest(scene, 2))
    if scene.mesh == "bricks" or (not scene.mesh and suits(size)):
        # A response over time has its rows on a grid that is fine enough alone.
        first = replace(Bricks.of(study, over_time), as_far_as_it_goes=not (scene.mesh or over_time))
        if scene.mesh or suits(size_of_grid(scene, first.grid)):
            return study, first
    why = "run.mesh asks for them"
    if scene.mesh != "tetrahedra":
        crowded, every = crowding(grids.graph(whole.part.scene).planes), float(f"{size.unknowns:.2g}")
        why = f"a grid of bricks would take {every:,.0f} unknowns and {size.memory / 1e9:.2g} GB or more, as {crowded}"
    return whole, CellMesh(Columns.of(whole.part.scene), why).fitting()
