"""The first grid of bricks of a scene whose conductivity follows the temperature, suited to a rough steady state.

A rise that is nearly a polynomial where k is constant is none where k follows it: by a law of one sign its coefficients
of degree p over an interval fall like d^p, d = (r^1/2 - 1) / (r^1/2 + 1) = tanh(c / 4), where k changes by a factor r =
e^c (its square root is to 1 what the Bernstein ellipse of 1/k is to the interval). Long intervals that a linear problem
is happy with are cut until that suits the accuracy. The rough state, of lower degrees, is also where Newton starts.
"""

from __future__ import annotations

import numpy as np

from fem3d.adaptivity import nested
from fem3d.problems import conductors
from fem3d.problems.assembly import assemble
from fem3d.problems.following import Conduction
from fem3d.results.study import Study
from fem3d.solution import newton
from fem3d.solution.steady import SteadyState
from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.domain import boxes
from fem3d.spaces.size import foreseen
from meshes.grid import Grid
from scenes import physics
from scenes.errors import NumericsError, RunawayError
from scenes.model import Scene

# Found on the sink with a falling k from 1 to 12 V. A poor choice costs time: errors are estimated on whatever grid
# comes of it. What others take over random
# scenes with laws is in `validate stress`: "constants".
LOWER = 2  # degrees by which those of the rough state are lower
SHARE = 0.5  # of the accuracy: what d^p may be, as of the last degree some is left
MOST_PIECES = 4  # of an interval
MOST_GROWTH = 2.0  # of the unknowns


def suited(scene: Scene, grid: Grid, study: Study) -> tuple[Grid, SteadyState | None]:
    """A first ``grid`` made to suit the conductivity of a rough steady state, and that state; the grid as it is, and
    None, where no property follows the temperature by a law, or no state is found. Raises RunawayError where none
    exists."""
    if not (physics.heat(scene) and physics.follows(scene, False)):
        return grid, None
    rough = grid.with_axes(grid.breaks, [np.maximum(d - LOWER, 1) for d in grid.degrees])
    heat = assemble(boxes(scene, rough))
    try:
        state = newton.rough(heat, conductors.find(heat, nested.SOLVED * newton.ROUGH), study.voltage)
    except RunawayError:
        raise
    except NumericsError:
        return grid, None
    pieces = _pieces(state, grid.degrees, study.accuracy)
    breaks = [np.append(_cut(b, n), b[-1]) for b, n in zip(grid.breaks, pieces, strict=True)]
    finer = grid.with_axes(breaks, [np.repeat(d, n) for d, n in zip(grid.degrees, pieces, strict=True)])
    if foreseen(scene, finer).unknowns > MOST_GROWTH * foreseen(scene, grid).unknowns:
        return grid, state
    return finer, state


def _cut(breaks: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """All breakpoints but the last, of intervals in so many equal pieces."""
    within = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    starts: np.ndarray = np.repeat(breaks[:-1], pieces) + within * np.repeat(np.diff(breaks) / pieces, pieces)
    return starts


def _pieces(state: SteadyState, degrees: tuple[np.ndarray, ...], accuracy: float) -> list[np.ndarray]:
    """Per axis into how many pieces each interval is cut."""
    heat = state.heat.exact or state.heat
    space, u = heat.domain.space, heat.field(state.rise)
    assert isinstance(space, BrickSpace)
    changes = [np.zeros(len(d)) for d in degrees]
    for term in heat.terms:
        for on, law, _, cells in term.parts if isinstance(term, Conduction) else ():
            rise = on.value(u)
            steepness = np.abs(law.slope(rise) / law.value(rise)).max(axis=-1).reshape(-1, len(cells)).max(axis=0)
            for change, at, relative in zip(changes, space.ijk, steepness * on.within(on.gradient(u)), strict=True):
                np.maximum.at(change, at[cells], relative)
    most = [4 * np.arctanh((SHARE * accuracy) ** (1 / np.maximum(p, 2))) for p in degrees]
    return [np.clip(np.ceil(c / m), 1, MOST_PIECES).astype(int) for c, m in zip(changes, most, strict=True)]
