"""A mesh file as the search for an accuracy sees it (`fem3d.adaptivity.mesh.Mesh`): tetrahedra are refined where
readings need it (`fem3d.adaptivity.tetrahedra`), hexahedra, which scikit-fem cuts all or none, of degree 2 once where
that is cheap.

Of hexahedra the levels are few, and errors come from their differences: the difference of two levels
bounds the error of the finer one where errors at least halve from one to the other. From degree 1 to 2 they do, even at
edges; on halved cells just so where a field has a singularity of order one half.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem3d.adaptivity import nested, reach, trace_errors
from fem3d.adaptivity.estimator import Spread
from fem3d.adaptivity.goal_errors import Level, as_balanced
from fem3d.adaptivity.marched import beside, distance, marched
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.adaptivity.tetrahedra import FINER, Tetrahedra, less_accurate
from fem3d.adaptivity.trace_errors import Response
from fem3d.problems.heat import HeatProblem
from fem3d.results import outputs
from fem3d.results.fields.mesh_fields import MeshFields
from fem3d.results.probes import reading
from fem3d.results.study import Study
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base, Transient
from fem3d.spaces.domain import Domain
from fem3d.spaces.file_domain import groups
from fem3d.spaces.integrals import Space
from meshes.grouped.check import check, remarks
from meshes.grouped.place import Placed
from meshes.grouped.read import read
from meshes.grouped.refine import refine
from meshes.symmetry import Symmetry
from scenes.errors import TooLargeError
from scenes.model import MeshScene
from scenes.plan import Step

LARGEST_REFINED = 60_000  # unknowns of a refined mesh; above, the mesh is taken as it is
BETWEEN_DEGREES, BETWEEN_MESHES = 1.0, 1.25  # the error of a level over its difference from the one before, at most
OF_GRADIENT = 3.0  # factor on that for a flow read off the gradient, which converges more slowly than all else
OVER_TIME = 1.5  # factor on that in a transient
# An error is at least this fraction of the fields' own difference, as a difference of two values may vanish by
# chance.
LEAST = 0.2
ROUNDING = 1e-9


def of(scene: MeshScene) -> FileMesh | Tetrahedra:
    """The scene on the mesh of its file; SceneError where they do not fit, TooLargeError for tetrahedra that take too
    much memory."""
    placed = check(scene, read(scene.path, scene.unit))
    if not placed.mesh.simplex:
        return FileMesh(placed)
    mesh = Tetrahedra(OnFile(placed), scene.accuracy)
    if mesh.size.memory > reach.MOST_MEMORY:
        raise TooLargeError(
            f"the {mesh.size.cells:,} tetrahedra of {scene.file} take {mesh.size.memory / 1e9:.2g} GB with elements of "
            f"degree 3, and {reach.MOST_MEMORY / 1e9:g} GB are the most; give a coarser mesh: it is refined where "
            "readings need it"
        )
    return mesh


@dataclass(frozen=True, eq=False)
class OnFile:
    """A scene on the tetrahedra of its file, or on their halves."""

    placed: Placed

    advice = FINER

    @property
    def scene(self) -> MeshScene:
        """The scene."""
        return self.placed.scene

    @property
    def cells(self) -> Any:
        """scikit-fem's mesh."""
        return self.placed.mesh.mesh

    def domain(self) -> Domain:
        """What the groups are on."""
        return groups(self.placed)

    def finer(self, shorter: np.ndarray, sharp: np.ndarray) -> OnFile:
        """With the groups on the parts of cells: three bisections make one half as long, wherever edges are sharp."""
        return OnFile(replace(self.placed, mesh=refine(self.placed.mesh, np.where(shorter.any(axis=0), 3, 0))))

    def of(self, scene: MeshScene) -> OnFile:
        """Another scene, with the same groups, on the mesh."""
        return OnFile(replace(self.placed, scene=scene))

    def remarks(self) -> list[str]:
        """What may not be meant in the mesh."""
        return remarks(self.placed.mesh)

    def statistics(self) -> dict[str, Any]:
        """The file's cells, and its groups."""
        return of_file(self.placed)

    def steps(self, levels: int | None) -> tuple[Step, Step]:
        """The lines of the plan; after a run with the ``levels`` that it has."""
        accuracy = f"an estimated error of {self.placed.scene.accuracy:g}"
        how = f"halved where readings miss most, until {accuracy} is reached or memory ends it"
        if levels is not None:
            how = f"halved where readings missed most, {levels} times, to {self.cells.t.shape[1]} cells"
        skipped = levels == 0
        why = f"degrees 1, 2 and 3 tell {accuracy} or less on the cells of the file" if skipped else how
        what = f"{len(self.placed.mesh.cells)} {self.placed.mesh.file_type} cells of {self.placed.scene.file}, degree 3"
        return Step("mesh", "done", what), Step("refinement", "skipped" if skipped else "done", why)


def of_file(placed: Placed) -> dict[str, Any]:
    """What a result says of a file."""
    mesh = placed.mesh
    named = {"volume_groups": sorted(mesh.volumes), "surface_groups": sorted(mesh.surfaces)}
    return {"file_cells": len(mesh.cells), "cell_type": mesh.file_type, **named}


class FileMesh:
    """A scene on its mesh of hexahedra, or on one refined, with the mesh ``before`` that."""

    def __init__(self, placed: Placed, before: FileMesh | None = None) -> None:
        self.placed, self.before = placed, before
        self._found: Any = None  # a Solution, or a Transient and its traces: what the refined mesh is compared with

    @property
    def given(self) -> FileMesh:
        """That of the file."""
        return self.before or self

    @property
    def _less(self) -> Any:
        """What was found on the mesh before; None where that is none, or has no steady state."""
        return self.before and self.before._found

    @property
    def domain(self) -> Domain:
        """What the groups are on."""
        return groups(self.placed)

    @property
    def levels(self) -> int:
        """How many times it is refined."""
        return int(self.before is not None)

    @property
    def words(self) -> str:
        """The elements, for a person."""
        return f"degree 2{' on a mesh refined once' if self.before else ''}"

    @property
    def refines(self) -> bool:
        """Whether it is still refined: that has eight times the cells, and close to eight times the nodes."""
        mesh = self.placed.mesh
        return self.before is None and 64 * mesh.mesh.nvertices <= LARGEST_REFINED

    def problems(self) -> Problems:
        """The problems of degrees 1 and 2."""
        return nested.problems(groups(self.placed), self.placed.scene.accuracy)

    def examined(self, study: Study, given: Problems, fine: Solution) -> Level:
        """The level of a fine solution, the low one being of degree 1, or of the mesh before."""
        low = self._less or nested.solution(study, given, 0)
        self._found, scales = fine, study.steady_scales(fine.out)
        heat = given.heat
        pairs = [(heat.domain.space, fine.state.heat.field(fine.state.rise), low.state.heat.field(low.state.rise))]
        if fine.state.conductor is not None:
            pairs.append((heat.domain.electric.space, fine.state.hot_potential, low.state.hot_potential))
        errors = self._errors(given.heat, distance(fine.quantities, low.quantities), scales, pairs)
        errors = {n: e + (ROUNDING + fine.state.unsettled) * scales[n] for n, e in errors.items()}
        errors = as_balanced(study, errors, fine, scales)
        return Level(given, fine, low, scales, errors, {}, [], errors)

    def responded(
        self, study: Study, given: Problems, bases: Sequence[Base], shift: float, steady: Level | None, generations: int
    ) -> Response:
        """The response, held against that of degree 1, or of the mesh before."""
        fine = marched(study, bases[0], shift, None if steady is None else steady.fine.out, generations)
        if self._less:
            low, low_traces = self._less
        else:
            low = beside(study, bases[1], shift, fine)
            low_traces = study.traces(outputs.of_transient(low, study.part, fine.checked))
        self._found, times = (fine.answer, fine.traces), np.array([0.1, 1.0]) * study.end
        rises = [t.base.heat.field(t.rises(times)) for t in (fine.answer, low)]
        apart = distance(fine.traces, low_traces)
        pairs = [(given.heat.domain.space, a, b) for a, b in zip(*rises, strict=True)]
        errors = self._errors(given.heat, {n: OVER_TIME * d for n, d in apart.items()}, fine.scales, pairs)
        for n in errors:
            errors[n] += fine.gaps[n] + float(np.max(fine.out.get(f"doubt:{n}", 0.0)))
        return trace_errors.concluded(study, fine, errors, [], [], as_it_is=not self.refines)

    def refined(self, goals: Collection[Spread], falls: Spread | None, worst: float, enough: float) -> FileMesh | None:
        """Every cell in eight, once, whatever is missing."""
        return self.raised()

    def begun(self) -> FileMesh:
        """As it is."""
        return self

    def raised(self) -> FileMesh | None:
        """The same."""
        return FileMesh(replace(self.placed, mesh=refine(self.placed.mesh)), self) if self.refines else None

    def field_error(self, level: Level) -> float:
        """Nothing is known to bound it."""
        return np.inf

    def on(self, scene: MeshScene) -> FileMesh:
        """Another scene, with the same groups, on the mesh."""
        return FileMesh(replace(self.placed, scene=scene), self.before)

    def refined_for_field(self, level: Level) -> None:
        """Nothing is: the mesh is the user's."""

    def _errors(
        self,
        heat: HeatProblem,
        apart: dict[str, float],
        scales: dict[str, float],
        fields: Iterable[tuple[Space, np.ndarray, np.ndarray]],
    ) -> dict[str, float]:
        """The errors of quantities that are so far ``apart`` from those of the level before, as are some ``fields``
        (..., functions) of a space: by the relative difference of these, as root of the mean square over the corners of
        the file's cells, which all spaces have first, where the field doesn't jump."""
        least, corners = 0.0, self.given.placed.mesh.mesh.nvertices
        for space, *both in fields:
            whole = np.flatnonzero(np.bincount(space.origin)[:corners] == 1)
            a, b = (u[..., whole] for u in both)
            size = float(np.sqrt((a**2).mean()))
            least = max(least, LEAST * float(np.sqrt(((a - b) ** 2).mean())) / size if size else 0.0)
        known = BETWEEN_MESHES if self._less else BETWEEN_DEGREES
        return {
            n: known * (OF_GRADIENT if _of_gradient(heat, n) else 1.0) * d + least * scales[n] for n, d in apart.items()
        }

    def fields(
        self, heat: HeatProblem, part: Symmetry, state: SteadyState | None, transient: Transient | None
    ) -> MeshFields:
        return MeshFields(heat, state, transient)

    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        """What a result says of it."""
        cells, space = np.arange(len(heat.domain.body)), heat.domain.space
        return {
            "cells": len(cells), "nodes": heat.size, "refined": self.before is not None, "lowest_degree": 2,
            "highest_degree": 2, "volume_m3": float(space.on(cells).weights.sum()), **of_file(self.placed),
        }  # fmt: skip

    def steps(self, levels: int | None) -> tuple[Step, Step]:
        """The lines of the plan; after a run with the ``levels`` that it has."""
        mesh = self.given.placed.mesh
        if not self.given.refines:
            how = Step("refinement", "skipped", "the mesh has too many cells; errors between degrees 1 and 2")
        elif levels == 0:
            how = Step("refinement", "skipped", "degrees 1 and 2 agree within the accuracy on the mesh as it is")
        else:
            how = Step("refinement", "done", "every cell into eight, once, where degrees 1 and 2 differ by more")
        what = f"{len(mesh.cells)} {mesh.file_type} cells of {self.placed.scene.file}, as they are"
        return Step("mesh", "done", what), how

    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        """Of ``relative`` errors above the accuracy, and of what may not be meant in the mesh."""
        words = f"this mesh with elements of {self.words}"
        return [*less_accurate(study, relative, f"{words}; {FINER}"), *remarks(self.given.placed.mesh)]


def _of_gradient(heat: HeatProblem, name: str) -> bool:
    """Whether a probe is a flow that is integrated from the gradient."""
    probe = heat.domain.probes[name]
    if probe.quantity not in ("heat_flow", "current"):
        return False
    how = reading(heat, probe)
    return how.gradient or (probe.quantity == "current" and not how.boundaries)
