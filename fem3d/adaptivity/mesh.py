"""Interface of the meshes that `fem3d.adaptivity.adapt.adapt` refines, and its answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from fem3d.adaptivity.estimator import Spread
from fem3d.adaptivity.goal_errors import Level, Record
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.adaptivity.trace_errors import Response
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.study import Study
from fem3d.solution.transient import Base
from scenes.plan import Step


class Indicators(NamedTuple):
    """Error indicators that steer the refinement of a mesh.

    Attributes
    ----------
    goals: of each goal, relative to its scale.
    worst: the largest relative error.
    record: estimates of the level, for the correction of later levels.
    """

    goals: Sequence[Spread]
    worst: float
    record: Record | None = None


class Mesh(Protocol):
    """A mesh of a scene with its error estimator: `Bricks`, or the tetrahedra and hexahedra of `CellMesh`."""

    @property
    def whole(self) -> bool:
        """Whether the mesh is of the whole scene, not of its symmetric part."""

    def begin(self) -> Mesh:
        """Return the mesh to begin with, which may be a coarser one."""

    def problems(self) -> Problems:
        """Return the problems in nested spaces."""

    def examine(self, study: Study, given: Problems, fine: Solution) -> Level | None:
        """Bound the errors of a fine solution; None where a lower space has no steady state although the fine one
        has."""

    def respond(
        self, study: Study, given: Problems, bases: Sequence[Base], shift: float, steady: Level | None, generations: int
    ) -> Response:
        """Return the response of the first of ``bases``, in the highest space, with its errors; lower spaces follow.

        ``steady`` is the level of its steady state, if solved; ``generations`` of Krylov fields are the first trial.
        """

    def refine(self, indicators: Indicators, target: float) -> Mesh | None:
        """Return the mesh refined where indicators are large, aiming at the relative error ``target``.

        None where the mesh cannot be refined further. Raises NumericsError where no refinement reaches the target.
        """

    def refine_all(self) -> Mesh | None:
        """Return the mesh a little finer everywhere, or None where that is impossible."""

    def refine_for_field(self, level: Level) -> Mesh | None:
        """Return the mesh refined where the steady field has the largest errors; None where that is impossible."""

    def with_scene(self, scene: Any) -> Mesh:
        """Return the same cells with another scene, whose parts are in the same places."""

    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        """Return cells, degrees and volume for a result."""

    def steps(self, levels: int | None) -> tuple[Step, ...]:
        """Return the lines of the plan; after a run with the number of its refinements."""

    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        """Return warnings of the mesh and of ``relative`` errors above the accuracy."""


@dataclass(frozen=True, eq=False)
class Answer:
    """The last level.

    Attributes
    ----------
    mesh, heat, conductor: the mesh and the problems in its highest space.
    steady, errors: the steady solution and the errors of its quantities, by name, in their units.
    response: the response over time.
    levels: how many meshes were solved.
    field: error of the steady field over its largest rise; infinite where unknown.
    """

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
        """The steady solution, which must exist."""
        assert self.steady is not None
        return self.steady

    def relative(self, study: Study) -> dict[str, float]:
        """Return all errors over their scales."""
        if self.response is not None:
            errors, scales = self.response.errors, self.response.scales
        else:
            errors, scales = self.errors, study.steady_scales(self.fine.out)
        return {name: error / scales[name] for name, error in errors.items()}


def less_accurate(study: Study, relative: dict[str, float], reason: str) -> list[str]:
    """Return the warning that ``relative`` errors exceed the accuracy: ``reason`` names the mesh and the remedy."""
    over = {name: e for name, e in relative.items() if e > study.accuracy}
    if not over:
        return []
    worst = max(over, key=lambda name: over[name])
    shown = f"{over[worst]:.1g}" if over[worst] > 2 * study.accuracy else f"{over[worst]:.3g}"
    if float(shown) <= study.accuracy:
        shown = f"just over {shown}"
    names = f"{len(over)} of {len(relative)} probes are" if len(over) > 1 else f'probe "{worst}" is'
    return [
        f"{names} less accurate than the {study.accuracy:g} asked for, {worst} with an estimated {shown}, on {reason}"
    ]
