"""The interface of meshes that `fem3d.adaptivity.adapt.adapt` refines, and its answer.

Errors of probes converge twice as fast as the error of the field, so a grid made for probes may leave a field that
oscillates beside a steep decay: `estimate_field_error` estimates its error.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fem3d.adaptivity import goal_errors, nested
from fem3d.adaptivity.estimator import Estimator
from fem3d.adaptivity.goal_errors import Level, Record
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.adaptivity.trace_errors import BoundedResponse
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.outputs import Study
from fem3d.spaces.domain import Domain
from scenes.errors import NumericsError
from scenes.result import Step

# Largest ratio of the error to the difference of the two degrees: the worst of 1,200 steady scenes has 1.85, below the
# coldest boundary (`validate stress`, "field away from the probes").
CAUTION = 2.0
# A refinement aims at this fraction of the allowed error: the predicted reduction is right only within a factor of two,
# and one more level costs more than some cells too many (`validate stress --scenes 160`: seconds of the slowest).
AIM = 0.5
ADVICE = "ask for a larger accuracy, let more planes coincide, or leave out what does not matter"
LARGE = 30_000  # unknowns of a first grid beyond which tetrahedra take fewer for 1e-2 (`cell_mesh.choose`)


class Indicators(NamedTuple):
    """Error indicators that steer the refinement of a mesh.

    Attributes
    ----------
    goals: (3, cells) of each goal, relative to its scale.
    worst: the largest relative error.
    record: estimates of the level, for the correction of later levels.
    """

    goals: Sequence[np.ndarray]
    worst: float
    record: Record | None = None


class Mesh(ABC):
    """A mesh of a scene for its accuracy: `Bricks`, or the tetrahedra and hexahedra of `CellMesh`."""

    whole = True  # whether the mesh is of the whole scene, not of its symmetric part
    levels: int | None = None  # how many times tetrahedra and hexahedra were refined

    @property
    def last(self) -> bool:
        """Whether the mesh is refined no more, so that its errors are accepted."""
        return False

    @property
    @abstractmethod
    def domain(self) -> Domain:
        """The scene on the cells."""

    @property
    @abstractmethod
    def estimator(self) -> Estimator:
        """The error estimator of the cells."""

    def begin(self) -> Mesh:
        """Return the mesh to begin with, which may be a coarser one."""
        return self

    def problems(self) -> Problems:
        """Return the problems in nested spaces."""
        domain = self.domain
        return nested.discretize(domain, domain.scene.accuracy)

    def examine(self, study: Study, problems: Problems, fine: Solution) -> Level:
        """Bound the errors of a fine solution; raises CoarseMeshError (`goal_errors.bound_errors`)."""
        return goal_errors.bound_errors(study, problems, fine, self.estimator)

    @abstractmethod
    def refine(self, indicators: Indicators, target: float) -> Mesh | None:
        """Return the mesh refined where indicators are large, aiming at the relative error ``target``.

        None where the mesh cannot be refined further. Raises NumericsError where no refinement reaches the target.
        """

    @abstractmethod
    def refine_all(self) -> Mesh | None:
        """Return the mesh finer everywhere, bricks by a degree and cells by halves; None where that is impossible."""

    @abstractmethod
    def with_scene(self, scene: Any) -> Mesh:
        """Return the same cells with another scene, whose parts are in the same places."""

    @abstractmethod
    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        """Return cells, degrees and volume for a result."""

    @abstractmethod
    def plan(self, levels: int | None) -> tuple[Step, ...]:
        """Return the lines of the plan; after a run with the number of its refinements."""

    @abstractmethod
    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        """Return warnings of the mesh and of ``relative`` errors above the accuracy."""


@dataclass(frozen=True, eq=False)
class Answer:
    """The last level.

    Attributes
    ----------
    mesh, heat, conductor: the mesh and the problems in its highest space.
    steady, errors: the steady solution and the errors of its quantities, by name, in their units.
    relative: the errors over their scales; over time without the errors between rows.
    response: the response over time.
    levels: how many meshes were solved.
    field_error: of the steady field over its largest rise; infinite where unknown.
    """

    mesh: Mesh
    heat: HeatProblem
    conductor: Conductor | None
    steady: Solution | None
    errors: dict[str, float]
    relative: dict[str, float]
    response: BoundedResponse | None
    levels: int
    field_error: float = np.inf

    @property
    def fine(self) -> Solution:
        """The steady solution, which must exist."""
        assert self.steady is not None
        return self.steady


def not_reached(accuracy: float, because: str = "") -> NumericsError:
    """Return the error to raise where no level is accurate enough."""
    return NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene{because}")


def warn_of_accuracy(study: Study, relative: dict[str, float], reason: str) -> list[str]:
    """Warn if ``relative`` errors exceed the accuracy: ``reason`` names the mesh and the remedy."""
    over = {name: e for name, e in relative.items() if e > study.accuracy}
    if not over:
        return []
    worst = max(over, key=lambda name: over[name])
    found = f"({len(over)} of {len(relative)}), {worst} with an estimated {over[worst]:.3g}"
    return [f"probes are less accurate than the {study.accuracy:g} asked for {found}, on {reason}"]


def estimate_field_error(level: Level) -> float:
    """Return the largest error of the fine steady field over its largest rise, from its change by the last degree."""
    space, heats = level.problems.domain.space, level.problems.heats[-2:]
    # Inside of cells, so that each point is of one cell alone.
    inner = 0.5 - 0.499 * np.cos(np.pi * (np.arange(6) + 0.5) / 6)
    X = np.array(np.meshgrid(inner, inner, inner)).reshape(3, -1)
    shapes = space.at(X[:, X.sum(axis=0) <= 1] if len(space.mesh.t) == 4 else X).T
    pairs = zip(heats, (level.low.state, level.fine.state), strict=True)
    low, fine = (heat.field(state.rise)[space.dofs.T] @ shapes for heat, state in pairs)
    largest = float(max(fine.max(), 0.0) - min(fine.min(), 0.0)) or 1.0
    return CAUTION * float(np.abs(fine - low).max()) / largest
