"""What the search for an accuracy asks of a mesh, and what it answers."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from fem3d.adaptivity.estimator import Spread
from fem3d.adaptivity.goal_errors import Level
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.adaptivity.trace_errors import Response
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.fields.fields import RunFields
from fem3d.results.study import Study
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base, Transient
from meshes.symmetry import Symmetry


class Mesh(Protocol):
    """What a scene is solved on, as the search for an accuracy sees it: a grid of bricks
    (`fem3d.adaptivity.brick_mesh`), tetrahedra (`fem3d.adaptivity.tetrahedra`) or hexahedra of a file
    (`fem3d.adaptivity.mesh_file`). They differ in where errors come from
    and in how they are refined."""

    def begun(self) -> Mesh:
        """The mesh to begin with, which may be a cheaper one."""

    def problems(self) -> Problems:
        """The problems on it, in nested spaces."""

    def examined(self, study: Study, given: Problems, fine: Solution) -> Level | None:
        """The level of a fine solution; None where a lower space has no steady state although the fine one has."""

    def responded(
        self, study: Study, given: Problems, bases: Sequence[Base], shift: float, steady: Level | None, generations: int
    ) -> Response:
        """The response of the first of ``bases``, those of the spaces from the highest on, with its errors; ``steady``
        is the level of its steady state, where that is known, ``generations`` of fields where to start."""

    def refined(self, goals: Collection[Spread], falls: Spread | None, worst: float, enough: float) -> Mesh | None:
        """Refined for what goals miss, each degree taking away less than the one before by the factors ``falls``
        (`estimate.falling`), or for as much more as the ``worst`` error says, until that is expected to be ``enough``;
        None where it is to be taken as it is. NumericsError where no refinement reaches that."""

    def raised(self) -> Mesh | None:
        """A little finer everywhere, or None where that can't be."""

    def field_error(self, level: Level) -> float:
        """The error of the steady field of its ``level`` where it is worst, over its largest rise."""

    def refined_for_field(self, level: Level) -> Mesh | None:
        """Refined where the steady field of its ``level`` is known worst; None where nothing is refined for that."""

    def on(self, scene: Any) -> Mesh:
        """Another scene, with the same parts in the same places, on the same cells."""

    def fields(
        self, heat: HeatProblem, part: Symmetry, state: SteadyState | None, transient: Transient | None
    ) -> RunFields:
        """The fields of a run on it."""

    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        """What a result says of it."""

    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        """What is to be said of it, and of the ``relative`` errors that it leaves."""


@dataclass(frozen=True, eq=False)
class Answer:
    """What the last level gives: its mesh and problem, the steady solution and its errors by name, the response over
    time, and the error of the steady field over its largest rise (infinite where the study doesn't ask for it)."""

    mesh: Mesh
    heat: HeatProblem
    conductor: Conductor | None
    steady: Solution | None
    errors: dict[str, float]
    response: Response | None
    levels: int
    field: float = np.inf

    @property
    def fine(self) -> Solution:
        """The steady solution that is there."""
        assert self.steady is not None
        return self.steady

    def relative(self, study: Study) -> dict[str, float]:
        """The errors of all that a study asks for, over what they are relative to."""
        if self.response is not None:
            errors, scales = self.response.errors, self.response.scales
        else:
            errors, scales = self.errors, study.steady_scales(self.fine.out)
        return {name: error / scales[name] for name, error in errors.items()}
