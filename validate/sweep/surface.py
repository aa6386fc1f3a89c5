"""A difference over the cells of a map, from those that are solved: interpolated, with an error that is measured.

Two interpolations are made: piecewise linear on the triangles between solved cells, and a smooth one through all
of them (cubic radial functions). How far they disagree anywhere in a triangle says how rough the surface is there; how
much of that the smooth one is off by is measured on every cell that was solved after it had been predicted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CAUTION = 0.5
"""The least part of the disagreement that counts as the error, however well the predictions have been met."""

RECENT = 48
"""Predictions that are looked back on: those made on a coarser net say little of today's."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Over the cells (n, m): the ``value``, NaN where there is none, its ``error``, of which ``own`` is that of the
    solved values at the triangle's corners, and the greatest ``disagreement`` in the cell's triangle and its
    neighbours, infinite where a corner of the triangle has no answer. ``lost`` are the cells all of whose corners have
    none."""

    value: np.ndarray
    error: np.ndarray
    own: np.ndarray
    disagreement: np.ndarray
    lost: np.ndarray


class Record:
    """How well the predictions were met so far."""

    def __init__(self) -> None:
        self._ratios: list[float] = []

    @property
    def share(self) -> float:
        """The largest part of the disagreement that a recent prediction was off by; all of it until some are known."""
        return max([CAUTION, *self._ratios[-RECENT:]]) if self._ratios else 1.0

    def add(self, surface: Surface, cells: np.ndarray, values: np.ndarray) -> None:
        """Compares what was predicted for some cells (k, 2) with their values, now solved."""
        for cell, value in zip(map(tuple, cells), values, strict=True):
            expected = surface.disagreement[cell]
            off = abs(surface.value[cell] - value)
            if np.isfinite(off) and np.isfinite(expected) and expected > 0:
                self._ratios.append(float(off / expected))


def surface(shape: tuple[int, int], cells: np.ndarray, values: np.ndarray, errors: np.ndarray, share: float) -> Surface:
    """The surface through ``values`` (k,), known to within ``errors`` (k,), NaN where there is none, at ``cells``
    (k, 2), the corners of the map among them."""
    from scipy.interpolate import LinearNDInterpolator, RBFInterpolator
    from scipy.spatial import Delaunay

    everywhere = np.indices(shape).reshape(2, -1).T.astype(float)
    answered = np.isfinite(values)
    net = Delaunay(cells)
    within = net.find_simplex(everywhere)
    bad = (~answered)[net.simplices].sum(axis=1)[within].reshape(shape)
    smooth = np.full(shape, np.nan)
    apart = np.full(shape, np.inf)
    if answered.sum() >= 6:
        places = cells / np.maximum(np.array(shape) - 1, 1)
        through = RBFInterpolator(places[answered], values[answered], kernel="cubic")
        smooth = through(everywhere / np.maximum(np.array(shape) - 1, 1)).reshape(shape)
        linear = LinearNDInterpolator(net, np.where(answered, values, 0.0))(everywhere).reshape(shape)
        most = np.zeros(len(net.simplices))
        np.maximum.at(most, within, np.abs(smooth - linear).ravel())
        # A bend in the surface may lie where two triangles meet.
        most = np.maximum(most, np.where(net.neighbors >= 0, most[net.neighbors], 0.0).max(axis=1))
        apart = np.where(bad == 0, most[within].reshape(shape), np.inf)
    at = tuple(cells.T)
    smooth[at], apart[at] = values, np.where(answered, 0.0, np.inf)
    own = np.where(answered, errors, 0.0)[net.simplices].max(axis=1)[within].reshape(shape)
    own[at] = errors
    return Surface(np.where(bad == 3, np.nan, smooth), share * apart + own, own, apart, bad == 3)
