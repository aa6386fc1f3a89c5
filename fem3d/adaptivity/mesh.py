"""Meshes that `fem3d.adaptivity.adapt.adapt` refines, grids of bricks among them, and its answer.

Errors of probes converge twice as fast as the error of the field, so a grid made for probes may leave a field that
oscillates beside a steep decay: `estimate_field_error` estimates its error.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fem3d.adaptivity import goal_errors, nested, reach
from fem3d.adaptivity.estimator import Estimator
from fem3d.adaptivity.goal_errors import Level, Record
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.adaptivity.reach import not_reached
from fem3d.adaptivity.trace_errors import BoundedResponse
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.outputs import Study
from fem3d.spaces import edge_exponents
from fem3d.spaces.domain import BoxDomain, Domain, box_domain
from fem3d.spaces.size import Size, check_memory, fits_memory, size_of_grid
from meshes import grading
from meshes import grid as grids
from meshes.grading import Features
from meshes.grid import Grid
from scenes.model import Scene
from scenes.result import Step

# Largest ratio of the error to the difference of the two degrees: the worst of 1,200 steady scenes has 1.85, below the
# coldest boundary (`validate stress`, "field away from the probes").
CAUTION = 2.0
# A refinement aims at this fraction of the allowed error: the predicted reduction is right only within a factor of two,
# and one more level costs more than some cells too many (`validate stress --scenes 160`: seconds of the slowest).
AIM = 0.5
# Unknowns of a first grid of degree 5 or more from which on a rough grid of degree 2 is solved before it, to show the
# edges that need the degree; ten times as many where the degree is 4 or less. If it is always solved, sinks take 1.1
# to 1.5 times as long, and rows of 9 and 19 spans at 1e-2, whose edges mostly need degree 4, 1.9 times.
MANY = 6_000
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


@dataclass(frozen=True, eq=False)
class Bricks(Mesh):
    """A grid of bricks, refined where the contributions of the last two degrees are large.

    ``features`` are the planes of the scene with its singular edges. A grid of rough degrees selects the edges that
    need the degrees of its ``aim``. If memory has no room for a finer grid, the accuracy is refused or, with
    ``as_far_as_it_goes``, the grid is taken as it is."""

    scene: Scene
    grid: Grid
    features: Features
    aim: Grid | None = None
    as_far_as_it_goes: bool = False

    whole = False

    @staticmethod
    def of(study: Study, over_time: bool = False) -> Bricks:
        """Return the first grid; ``over_time`` adds layers at faces whose temperature jumps."""
        scene = study.part.scene
        check_memory(scene, size_of_grid(scene, grids.coarsest(scene, 2)), "at any accuracy")
        features = edge_exponents.features(scene)
        grid = reach.first_grid(scene, scene.accuracy, features)
        grid = grading.with_diffusion_layers(grid, scene, study.earliest) if over_time else grid
        return Bricks(scene, grid, features)

    @property
    def domain(self) -> BoxDomain:
        return box_domain(self.scene, self.grid)

    @cached_property
    def estimator(self) -> Estimator:
        return Estimator.of_grid(self.grid, self.features, self.scene)

    def begin(self) -> Bricks:
        if self._checked().unknowns < (MANY if max(p.max() for p in self.grid.degrees) > 4 else 10 * MANY):
            return self
        return replace(self, grid=self.grid.with_edges(2), aim=grading.raised(self.grid))

    def problems(self) -> Problems:
        self._checked()
        problems = super().problems()
        if self.aim is None and any(p.quantity == "current" for p in self.scene.probes):
            # The power of the cold conductor is available before any other solution.
            power = self.estimator.indicators(problems.power_contributions)
            reach.check_edges(self.grid, self.features, [power], self.scene.accuracy)
        return problems

    def refine(self, indicators: Indicators, target: float) -> Bricks | None:
        goals = [self.grid.spread(goal) for goal in indicators.goals]
        missing = [np.max(each, axis=0) for each in zip(*goals, strict=True)]
        size = sum(float(m.sum()) for m in missing)
        missing = [m * max(indicators.worst / max(size, 1e-300), 1.0) for m in missing]
        if self.aim is not None:
            # The last degree's contribution, FALLS times its error, is foreseen to a factor of two.
            share = grading.threshold(missing, AIM * target / (2 * grading.FALLS))
            finer = replace(self, grid=grading.finer(self.grid, missing, share, self.aim), aim=None)
        else:
            reach.check_edges(self.grid, self.features, indicators.goals, target)
            finer = replace(self, grid=grading.refined(self.grid, missing, AIM * target, self.features))
            if finer.grid.same(self.grid):
                raise not_reached(self.scene.accuracy, reach.explain_edge(self.features))
        return finer._within_memory()

    def refine_all(self) -> Bricks | None:
        if self.aim is not None:
            return replace(self, grid=self.aim, aim=None)
        finer = grading.raised(self.grid)
        return None if finer.same(self.grid) else replace(self, grid=finer)._within_memory()

    def _checked(self) -> Size:
        """Return the size of the grid; raise TooLargeError where memory has no room for it."""
        size, why = size_of_grid(self.scene, self.grid), reach.explain_edge(self.features)
        check_memory(self.scene, size, f"at an accuracy of {self.scene.accuracy:g}", why)
        return size

    def _within_memory(self) -> Bricks | None:
        """Return the mesh; None where it exceeds the memory and the one before is to be kept then."""
        fits = not self.as_far_as_it_goes or fits_memory(self.scene, size_of_grid(self.scene, self.grid))
        return self if fits else None

    def with_scene(self, scene: Scene) -> Bricks:
        return replace(self, scene=scene)

    def plan(self, levels: int | None) -> tuple[Step, ...]:
        """Return a line of the plan if the scene demands the grid, or if the grid is large."""
        size = size_of_grid(self.scene, self.grid)
        if not self.scene.mesh and size.unknowns <= LARGE:
            return ()
        why = "run.mesh asks for it" if self.scene.mesh else "tetrahedra are foreseen to take more"
        return (Step("mesh", "done", f"a grid of bricks of {size.unknowns:,} unknowns to start with; {why}"),)

    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        return grids.statistics(self.grid)

    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        return warn_of_accuracy(study, relative, f"as many bricks as the memory has room for; {reach.ADVICE}")
