"""Means of noisy data over windows of a trace, and their uncertainties.

Of n independent noisy distances the largest is near u sqrt(2 ln n) by chance. A trace is therefore cut into a few
windows, and the mean over each is stated. The part of u that scatters from row to row falls with the root of the number
of rows; the part that all rows share, such as an offset of a thermometer, does not fall. The scatter is estimated from
second differences of the data at distances of 1, 2, 4 ... rows (von Neumann, Ann. Math. Stat. 12, 1941); the remainder
of u is shared.

The interval of one window is its mean -+ 2 u (95 %). The worst of several windows needs intervals that hold at once:
the factor is 2 where they share all of u, and grows to Sidak's (J. Am. Stat. Assoc. 62, 1967) where they share nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.verdict import COVERS

MOST = 16
"""The most windows of a trace: each stays a small part of the rise, and the worst one's factor below 3."""
_LESS, _MORE = 0.2, 0.05
"""A scatter from row to row that is as small, or as large, in so many cases by chance is not taken for that of u. Small
ones are doubted sooner: to take what rows share for scatter makes an interval too narrow, the reverse too wide. With
0.1 intervals of 60 rows that share a quarter of the variance hold in 87 %, with 0.2 in 90 %, with 0.3 in 92 %, those
of noise that only scatters in 96.7, 96.9 and 97.1 % (`pytest -m long tests/compare/test_windows.py`)."""
_ROWS = 1.25
"""Rows per independent value of noise that is independent at a distance of h rows but not yet of h/2: 1.25 h. Where
correlations fall exponentially, the sum over all distances is then within 5 % of the variance of a mean."""
_PER_DEGREE = 35 / 18
"""Second differences that tell as much of the scatter as one independent number, as they share rows: the sum of the
squares of their correlations, 1 + 2 (2/3)^2 + 2 (1/6)^2."""
_SHARED = np.linspace(0, 6, 121)
"""Values (standard deviations) of the shared error at which an integral over it, of an even function, is summed."""
_LEAST = 0.05
"""The smallest scatter, as a part of u, in the integral: below it nothing changes, and the sum would not resolve it."""


@dataclass(frozen=True)
class Window:
    """Rows of a trace: their mean ``distance`` from the data, and its standard uncertainties.

    ``share`` is due to errors that all rows share, ``scatter`` to the rest.
    """

    rows: slice
    distance: float
    share: float
    scatter: float

    @property
    def u_data(self) -> float:
        """The standard uncertainty of the mean due to the data."""
        return float(np.hypot(self.share, self.scatter))


def cut(course: np.ndarray) -> tuple[slice, ...]:
    """Share the rows of a trace out to at most 16 windows: each has an equal part of rows and of the change of a
    ``course``.
    """
    change = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(course)))])
    share = np.arange(len(course)) / len(course)
    if change[-1] > 0:
        share = (share + change / change[-1]) / 2
    starts = np.unique(np.floor(share * MOST).clip(max=MOST - 1), return_index=True)[1].tolist()
    return tuple(slice(first, end) for first, end in zip(starts, [*starts[1:], len(course)], strict=True))


def windows(time: np.ndarray, distance: np.ndarray, u: np.ndarray, cuts: Sequence[slice]) -> tuple[Window, ...]:
    """Return the windows of a trace.

    Parameters
    ----------
    time : (n,) s
    distance : (n,) distance from the data
    u : (n,) standard uncertainties of the data, zero for exact data
    cuts : the rows of each window
    """
    parts, alike = _parts(time, distance, u)
    means = []
    for rows in cuts:
        count, square = len(u[rows]), float((u[rows] ** 2).mean())
        scatter = np.sqrt(square * (parts @ np.minimum(alike / count, 1.0)))
        shared = np.sqrt(max(1 - parts.sum(), 0.0)) * u[rows].mean()
        means.append(Window(rows, float(distance[rows].mean()), float(shared), float(scatter)))
    return tuple(means)


def factor(means: Sequence[Window], u: Sequence[float]) -> float:
    """Return the number of standard uncertainties that make intervals hold at once in 95 % of cases.

    ``u`` are uncertainties of other causes, one for each window, which the windows share.
    """
    from scipy.optimize import brentq
    from scipy.special import ndtr, ndtri

    shared, scatter = np.hypot([w.share for w in means], u), np.array([w.scatter for w in means])
    total = np.hypot(shared, scatter)
    if not (total > 0).any():
        return COVERS
    shared, scatter = (part[total > 0, None] / total[total > 0, None] for part in (shared, scatter))
    scatter, off = scatter.clip(min=_LEAST), shared * _SHARED
    weights = np.exp(-(_SHARED**2) / 2)
    weights[0] /= 2

    def held(k: float) -> float:
        inside = ndtr((k - off) / scatter) - ndtr((-k - off) / scatter)
        return float(inside.prod(axis=0) @ weights / weights.sum())

    wanted = 2 * ndtr(COVERS) - 1
    most = float(ndtri((1 + wanted ** (1 / len(means))) / 2))
    if held(COVERS) >= wanted or held(most) <= wanted:
        return COVERS if held(COVERS) >= wanted else most
    return float(brentq(lambda k: held(k) - wanted, COVERS, most, xtol=1e-3))


def worst(means: Sequence[Window], u: Sequence[float]) -> tuple[int, float]:
    """Return the window that is surely furthest from zero, and the factor of its interval."""
    others = np.nan_to_num(np.array(u))
    k = factor(means, others.tolist())
    near = [abs(w.distance) - k * np.hypot(w.u_data, other) for w, other in zip(means, others, strict=True)]
    return int(np.argmax(near)), k


def _parts(time: np.ndarray, distance: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The parts of u^2 that scatter at distances of 1, 2, 4 ... rows, and the rows per independent value of each."""
    from scipy.optimize import isotonic_regression
    from scipy.special import gammaincinv

    if len(time) < 3 or not (u > 0).all():
        return np.ones(1), np.ones(1)
    steps = 2 ** np.arange(max(int(np.log2(len(time) / 4)), 0) + 1)
    scatter = np.array([_scatter(time, distance / u, int(step)) for step in steps])
    # Quantiles of a mean square of normal numbers, chi-squared over its degrees of freedom.
    half = (len(time) - 2) / _PER_DEGREE / 2
    low, high = (gammaincinv(half, p) / half for p in (_LESS, 1 - _MORE))
    if scatter[0] > high:
        return scatter[:1], np.ones(1)
    if scatter[0] >= low:
        return np.ones(1), np.ones(1)
    known = np.minimum(isotonic_regression(scatter, weights=len(time) - 2 * steps).x, 1.0)
    return np.diff(known, prepend=0.0), np.where(steps > 1, _ROWS * steps, 1.0)


def _scatter(time: np.ndarray, r: np.ndarray, step: int) -> float:
    """The part of the variance of r (times,), at some times (s), that scatters at a distance of so many rows."""
    first, middle, last = (slice(n * step, len(r) - (2 - n) * step) for n in range(3))
    before = (time[last] - time[middle]) / (time[last] - time[first])
    off = r[middle] - before * r[first] - (1 - before) * r[last]
    return float(np.mean(off**2 / (1 + before**2 + (1 - before) ** 2)))
