"""Grids of bricks, from the first one on, and the accuracy that singular edges allow."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fem3d.adaptivity.estimator import Estimator
from fem3d.adaptivity.mesh import ADVICE, AIM, LARGE, Indicators, Mesh, not_reached, warn_of_accuracy
from fem3d.adaptivity.nested import Problems
from fem3d.problems.heat import HeatProblem
from fem3d.results.outputs import Study
from fem3d.spaces import edge_exponents
from fem3d.spaces.domain import BoxDomain, box_domain
from fem3d.spaces.size import Size, check_memory, fits_memory, size_of_grid
from meshes import grading
from meshes import grid as grids
from meshes.grading import Features
from meshes.grid import Grid
from scenes.model import Scene
from scenes.result import Step

# Unknowns of a first grid of degree 5 or more from which on a rough grid of degree 2 is solved before it, to show the
# edges that need the degree; ten times as many where the degree is 4 or less. If it is always solved, sinks take 1.1
# to 1.5 times as long, and rows of 9 and 19 spans at 1e-2, whose edges mostly need degree 4, 1.9 times.
MANY = 6_000
COARSEST = 1e-2  # accuracy from which on a first grid has the fewest layers, and of rough solutions
HARDLY = 0.25  # exponent of edges that are out of reach: layers down to 1e-9 (ROUNDING) leave (1e-9)^(2 s) = 3e-5
LAYER = 0.1  # layers shorter than this fraction of the narrowest length see their edge alone: ten lengths to the next


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
        grid = first_grid(scene, scene.accuracy, features)
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
            check_edges(self.grid, self.features, [power], self.scene.accuracy)
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
            check_edges(self.grid, self.features, indicators.goals, target)
            finer = replace(self, grid=grading.refined(self.grid, missing, AIM * target, self.features))
            if finer.grid.same(self.grid):
                raise not_reached(self.scene.accuracy, explain_edge(self.features))
        return finer._within_memory()

    def refine_all(self) -> Bricks | None:
        if self.aim is not None:
            return replace(self, grid=self.aim, aim=None)
        finer = grading.raised(self.grid)
        return None if finer.same(self.grid) else replace(self, grid=finer)._within_memory()

    def _checked(self) -> Size:
        """Return the size of the grid; raise TooLargeError where memory has no room for it."""
        size, why = size_of_grid(self.scene, self.grid), explain_edge(self.features)
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
        return warn_of_accuracy(study, relative, f"as many bricks as the memory has room for; {ADVICE}")


def first_grid(scene: Scene, accuracy: float, features: Features) -> Grid:
    """Return the grid to begin with, for a larger accuracy where layers at an edge would come close to rounding."""
    if features.sharpest <= HARDLY:
        # The accuracy of a first layer of this length.
        accuracy = max(accuracy, LAYER ** (2 * features.sharpest) / grading.LAYERS)
    return grading.first_grid(scene, accuracy, features)


def check_edges(grid: Grid, features: Features, goals: Iterable[np.ndarray], accuracy: float) -> None:
    """Raise NumericsError where edges put an accuracy out of reach.

    The error at an edge of exponent s is proportional to the length of its layer to the power 2 s, whatever else is
    refined. So the shortest possible layers leave a fixed part of the indicators of layers that see their edge alone.
    """
    planes = [sorted({*inner, b[0], b[-1]}) for inner, b in zip(features.planes, grid.breaks, strict=True)]
    longest, parts = LAYER * min(float(np.diff(each).min()) for each in planes), []
    for breaks, near in zip(grid.breaks, features.near(grid), strict=True):
        s, lengths = np.minimum(near[:-1], near[1:]), np.diff(breaks)
        shrinks = np.minimum(grading.shortest_of(grid) / lengths, 1.0)
        parts.append(np.where(lengths < longest, shrinks ** (2 * s), 0.0))
    kept = [sum(float(i @ part) for i, part in zip(grid.by_interval(g), parts, strict=True)) for g in goals]
    # Solved random scenes keep no more; with only a tenth for all other errors cells would grow without end.
    if max(kept) > 0.75 * accuracy:
        raise not_reached(accuracy, explain_edge(features))


def explain_edge(features: Features) -> str:
    """Return the words that name an edge too singular for any grid; empty without such an edge."""
    planes = [(s, "xyz"[d], at) for d in range(3) for at, s in features.exponents[d].items()]
    sharpest, axis, at = min(planes, default=(1.0, "", 0.0))
    if sharpest > HARDLY:
        return ""
    return (
        f": at {axis} = {at:.4g} m a given value ends, or good conductors meet along an edge only, and the solution "
        f"behaves as a distance to the power {sharpest:.2f} there; ask for a larger accuracy, or let them end elsewhere"
    )
