"""A mesh file as the search for an accuracy sees it (`fem3d.adaptivity.mesh.Mesh`): degree 2, refined once where that
is cheap.

The mesh is the user's, so its levels are few, and errors come from their differences: the difference of two levels
bounds the error of the finer one where errors at least halve from one to the other. From degree 1 to 2 they do, even at
edges; on halved cells just so where a field has a singularity of order one half.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d.adaptivity import nested, trace_errors
from fem3d.adaptivity.estimate import Spread
from fem3d.adaptivity.goal_errors import Level, as_balanced
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.adaptivity.trace_errors import Response
from fem3d.problems.heat import HeatProblem
from fem3d.results import outputs
from fem3d.results.fields.mesh_fields import MeshFields
from fem3d.results.probes import reading
from fem3d.results.study import Study
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base, Transient
from fem3d.spaces.file_domain import groups
from meshes.grouped.check import check, remarks
from meshes.grouped.place import Placed
from meshes.grouped.read import read
from meshes.grouped.refine import refine
from meshes.symmetry import Symmetry
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


class FileMesh:
    """A scene on its mesh, or on one refined, with the mesh ``before`` that."""

    def __init__(self, placed: Placed, before: FileMesh | None = None) -> None:
        self.placed, self.before = placed, before
        self._found: Any = None  # a Solution, or a Transient and its traces: what the refined mesh is compared with

    @staticmethod
    def of(scene: MeshScene) -> FileMesh:
        """The scene on the mesh of its file; SceneError where they do not fit."""
        return FileMesh(check(scene, read(scene.path, scene.unit)))

    @property
    def given(self) -> FileMesh:
        """That of the file."""
        return self.before or self

    @property
    def _less(self) -> Any:
        """What was found on the mesh before; None where that is none, or has no steady state."""
        return self.before and self.before._found

    @property
    def words(self) -> str:
        """The elements, for a person."""
        return f"degree 2{' on a mesh refined once' if self.before else ''}"

    @property
    def refines(self) -> bool:
        """Whether it is still refined: that has eight times the cells, and close to eight times the nodes."""
        mesh = self.placed.mesh
        return self.before is None and 8 * mesh.mesh.nvertices * (7 if mesh.simplex else 8) <= LARGEST_REFINED

    def problems(self) -> Problems:
        """The problems of degrees 1 and 2."""
        return nested.problems(groups(self.placed), self.placed.scene.accuracy)

    def examined(self, study: Study, given: Problems, fine: Solution) -> Level:
        """The level of a fine solution, the low one being of degree 1, or of the mesh before."""
        low = self._less or nested.solution(study, given, 0)
        self._found, scales = fine, study.steady_scales(fine.out)
        pairs = [(fine.state.heat.field(fine.state.rise), low.state.heat.field(low.state.rise))]
        if fine.state.conductor is not None:
            pairs.append((fine.state.hot_potential, low.state.hot_potential))
        errors = self._errors(study, given.heat, trace_errors.distance(fine.quantities, low.quantities), scales, pairs)
        errors = {n: e + (ROUNDING + fine.state.unsettled) * scales[n] for n, e in errors.items()}
        errors = as_balanced(study, errors, fine, scales)
        return Level(given, fine, low, scales, errors, {}, [])

    def responded(
        self, study: Study, given: Problems, bases: Sequence[Base], shift: float, steady: Level | None, generations: int
    ) -> Response:
        """The response, held against that of degree 1, or of the mesh before."""
        fine = trace_errors.marched(study, bases[0], shift, None if steady is None else steady.fine.out, generations)
        if self._less:
            low, there = self._less
        else:
            low = trace_errors.beside(study, bases[1], shift, fine.generations)
            there = study.traces(outputs.of_transient(low, study.part, fine.checked))
        self._found, times = (fine.answer, fine.there), np.array([0.1, 1.0]) * study.end
        rises = [t.base.heat.field(t.rises(times)) for t in (fine.answer, low)]
        apart = trace_errors.distance(fine.there, there)
        errors = self._errors(
            study, given.heat, {n: OVER_TIME * d for n, d in apart.items()}, fine.scales, zip(*rises, strict=True)
        )
        for n in errors:
            errors[n] += fine.lost[n] + float(np.max(fine.out.get(f"doubt:{n}", 0.0)))
        return trace_errors.concluded(study, fine, errors, [], [], as_it_is=not self.refines)

    def refined(self, goals: Collection[Spread], falls: Spread | None, worst: float, enough: float) -> FileMesh | None:
        """Every cell in eight, once, whatever is missing."""
        return self.raised()

    def raised(self) -> FileMesh | None:
        """The same."""
        return FileMesh(replace(self.placed, mesh=refine(self.placed.mesh)), self) if self.refines else None

    def refined_for_field(self, level: Level) -> None:
        """Nothing is: the mesh is the user's."""

    def _errors(
        self,
        study: Study,
        heat: HeatProblem,
        apart: dict[str, float],
        scales: dict[str, float],
        fields: Iterable[tuple[np.ndarray, np.ndarray]],
    ) -> dict[str, float]:
        """The errors of quantities that are so far ``apart`` from those of the level before, as are some ``fields``
        (..., functions): by the relative difference of these, as root of the mean square over the corners of the
        file's cells, which all spaces have first."""
        least, corners = 0.0, self.given.placed.mesh.mesh.nvertices
        for a, b in ((x[..., :corners], y[..., :corners]) for x, y in fields):
            size = float(np.sqrt((a**2).mean()))
            least = max(least, LEAST * float(np.sqrt(((a - b) ** 2).mean())) / size if size else 0.0)
        known = BETWEEN_MESHES if self._less else BETWEEN_DEGREES
        return {
            n: known * (OF_GRADIENT if _of_gradient(heat, study.goals[n]) else 1.0) * d + least * scales[n]
            for n, d in apart.items()
        }

    def fields(
        self, heat: HeatProblem, part: Symmetry, state: SteadyState | None, transient: Transient | None
    ) -> MeshFields:
        """On the cells of the file."""
        return MeshFields(self.given.placed, heat, state, transient)

    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        """What a result says of it."""
        mesh, space = self.given.placed.mesh, heat.domain.space
        return {
            "cells": mesh.count, "cell_type": mesh.file_type, "nodes": heat.size, "refined": self.before is not None,
            "lowest_degree": 2, "highest_degree": 2,
            "volume_m3": float(space.on(np.arange(len(heat.domain.body))).weights.sum()),
            "volume_groups": sorted(mesh.volumes), "surface_groups": sorted(mesh.surfaces),
        }  # fmt: skip

    def steps(self, last: FileMesh | None) -> tuple[Step, Step]:
        """The lines of the plan for the mesh of a file; with the ``last`` that was solved on, as it turned out."""
        mesh = self.placed.mesh
        if not self.refines:
            how = Step("refinement", "skipped", "the mesh has too many cells; errors between degrees 1 and 2")
        elif last is self:
            how = Step("refinement", "skipped", "degrees 1 and 2 agree within the accuracy on the mesh as it is")
        else:
            how = Step("refinement", "done", "every cell into eight, once, where degrees 1 and 2 differ by more")
        what = f"{mesh.count} {mesh.file_type} cells of {self.placed.scene.file}, as they are"
        return Step("mesh", "done", what), how

    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        """Of ``relative`` errors above the accuracy, and of what may not be meant in the mesh."""
        return [*self.less_accurate(study, relative), *remarks(self.given.placed.mesh)]

    def less_accurate(self, study: Study, relative: dict[str, float]) -> list[str]:
        """What is to be said of ``relative`` errors above the accuracy."""
        over = {name: e for name, e in relative.items() if e > study.accuracy}
        if not over:
            return []
        worst = max(over, key=lambda name: over[name])
        shown = f"{over[worst]:.1g}" if over[worst] > 2 * study.accuracy else f"{over[worst]:.3g}"
        if float(shown) <= study.accuracy:
            shown = f"just over {shown}"
        names = f"{len(over)} of {len(relative)} probes are" if len(over) > 1 else f'probe "{worst}" is'
        return [
            f"{names} less accurate than the {study.accuracy:g} asked for, {worst} with an estimated {shown}, on "
            f"this mesh with elements of {self.words}; give a finer mesh, above all at edges, corners and the rims of "
            "electrodes and fixed temperatures"
        ]


def _of_gradient(heat: HeatProblem, name: str) -> bool:
    """Whether a probe is a flow that is integrated from the gradient."""
    probe = heat.domain.probes[name]
    if probe.quantity not in ("heat_flow", "current"):
        return False
    how = reading(heat, probe)
    return how.gradient or (probe.quantity == "current" and not how.boundaries)
