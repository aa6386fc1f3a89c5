"""The grid of a device: refined where the responses of its few states have a large error."""

from __future__ import annotations

import numpy as np

from fem3d.adaptivity import reach
from fem3d.adaptivity.estimator import Spread, total
from fem3d.adaptivity.nested import Problems
from fem3d.device.model import Projected
from meshes import diffusion, grading
from meshes.grading import Features
from meshes.grid import Grid
from scenes.model import Scene


def first(scene: Scene, accuracy: float, earliest: float, marks: Features) -> Grid:
    """The grid to start with: the grid of the steady state, with layers at the polymer's top for a step there, and a
    degree more across the layers, through which heat comes and goes in a few samples."""
    grid = diffusion.graded(reach.first_grid(scene, accuracy, marks), scene, earliest)
    return grid.with_axes(grid.breaks, [*grid.degrees[:2], grading.raised(grid).degrees[2]])


def refined(grid: Grid, given: Problems, fine: Projected, low: Projected, over: float, marks: Features) -> Grid:
    """The grid refined where the last degree still changed something, ``over`` being the error over the accuracy."""
    missing = _missing(given, fine, low)
    size = total(missing)
    return grading.refined(grid, [m * (over / size) for m in missing], 1.0, marks)


def _missing(given: Problems, fine: Projected, low: Projected) -> Spread:
    """The error of the lower space's responses by interval, for the worst of the loads and shifts.

    A film's power acts where its resistance is measured, so that a load F is the goal too: the last degree adds
    x (F - A y) to F x, summed over the functions that the lower space's solution y lacks.
    """
    heat, space = given.heat, given.bricks
    lower = given.heats[1]
    new = slice(lower.free, heat.free)
    worst = [np.zeros(len(d)) for d in space.grid.degrees]
    for solve, solve_low, shift in zip(fine.space.solves, low.space.solves, fine.shifts, strict=True):
        for load, load_low in zip(fine.loads, low.loads, strict=True):
            x = solve(load[: heat.free])
            y = given.lifted(solve_low(load_low[: lower.free]), 1)[: heat.free]
            residual = load[: heat.free] - heat.inner_mass @ y - shift * (heat.inner_stiffness @ y)
            parts = (x * residual)[new] / float(load[: heat.free] @ x)
            worst = [np.maximum(a, b) for a, b in zip(
                worst, space.spread(heat.order[new], parts), strict=True)]  # fmt: skip
    return worst
