"""The anchors of a fin whose properties follow the temperature: one shape, that of the plate's steady state, at points.

Let s be the steady rise in an anchor over that of the beam's end. With the rise theta s what the anchor gives off, by
Galerkin's method, misses the heat through the end by what the flux there is not uniform; the balance of heat,

    heat through the end = what the anchor gives off - what the current heats it by,

is exact, and in the steady state what the fin's anchor takes from the beam is made that. The points that such a sum
takes are few: what counts of them is s.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reduced1d.ladder.following import Points
from reduced1d.ladder.plate import Plate

_BINS = 100
"""Intervals of s over and beside the oxide: the error is of second order in their width, 1e-5 of the change."""


def anchor_points(plate: Plate, rise: np.ndarray) -> tuple[Points, float]:
    """Both anchors of a plate at a steady rise (n,), with s as their one function; and how many times what they give
    off by Galerkin's method the heat through the ends is."""
    follows = plate.model.follows
    assert follows is not None
    layer, whole = follows.layer, follows.parts[0]
    end = float(plate.model.outputs["end"] @ rise)
    points = _gathered(whole.on((rise / end)[:, None]).where(~whole.beam))
    squared = float(plate.model.drive.through(follows.resistance(rise))) ** 2
    one_state = replace(follows, parts=(points,), states=1)
    outflow, source, resistance = (np.atleast_1d(each)[0] for each in one_state.flows(np.array([end])))
    at = points.rise(np.array([end]))
    heat = points.above @ layer.down(at)[0] + points.area @ layer.up(at)[0] + points.gap @ (layer.gas * at)
    heat += points.bare @ layer.radiates(at)[0]
    return points, float((heat - squared * (resistance - source)) / outflow)


def _gathered(points: Points) -> Points:
    """Of one function, with one point for all where it is nearly the same."""
    value, (x, y) = points.values[:, 0], points.slopes
    edges = np.linspace(value.min(), value.max(), _BINS + 1)[1:-1]
    numbers = np.unique(2 * np.searchsorted(edges, value) + (points.above > 0), return_inverse=True)[1]

    def summed(per_point: np.ndarray) -> np.ndarray:
        return np.bincount(numbers, per_point)

    area = summed(points.area)
    steep = np.sqrt(summed(points.area * (x[:, 0] ** 2 + y[:, 0] ** 2)) / area)
    extensive = ("area", "above", "gap", "bare", "silicon", "oxide", "heat")
    sums = {name: summed(getattr(points, name)) for name in extensive}
    return Points(
        (summed(points.area * value) / area)[:, None], (steep[:, None],), **sums,
        along=summed(points.area * points.along) / area, beam=np.full(len(area), False),
    )  # fmt: skip
