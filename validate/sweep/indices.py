"""How much of a column's variance each key explains: Sobol' indices of a smooth surface through the sample."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from validate.sweep.table import Table

DRAWS = 4096
"""Points of the surface that the indices are estimated from; a surface costs nothing to ask."""

FOLDS = 8


@dataclass(frozen=True, eq=False)
class Indices:
    """First-order and total indices by key with the half width of their 95 % intervals; ``explained`` is the part of
    the variance that the surface predicts of points left out of it, the rest being more than it can say."""

    keys: tuple[str, ...]
    first: np.ndarray
    first_error: np.ndarray
    total: np.ndarray
    total_error: np.ndarray
    explained: float


def indices(table: Table) -> Indices | None:
    """The indices of the difference (or probe) that the sweep is of, each key uniform in its range (or in its
    logarithm); ``None`` where the points are too few, a key has words, or nothing varies."""
    from scipy.interpolate import RBFInterpolator
    from scipy.stats import sobol_indices, uniform

    values, _ = next(iter(table.series().values()))
    known = table.ok & np.isfinite(values)
    if any(given.dtype == object for given in table.keys.values()) or known.sum() < 10 * len(table.keys):
        return None
    places = np.column_stack([_unit(axis.log, table.keys[axis.key]) for axis in table.job.design.axes])[known]
    y = values[known]
    if np.ptp(y) <= 1e-12 * np.abs(y).max():
        return None

    def through(x: np.ndarray, v: np.ndarray) -> RBFInterpolator:
        return RBFInterpolator(x, v, kernel="cubic", neighbors=None if len(v) <= 2000 else 60)

    rng = np.random.default_rng(0)
    fold = rng.permutation(len(y)) % FOLDS
    left_out = np.empty_like(y)
    for k in range(FOLDS):
        left_out[fold == k] = through(places[fold != k], y[fold != k])(places[fold == k])
    surface = through(places, y)
    name = "rng" if "rng" in signature(sobol_indices).parameters else "random_state"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = sobol_indices(
            func=lambda x: surface(x.T), n=DRAWS, dists=[uniform()] * places.shape[1], **{name: rng}
        )  # fmt: skip
        spread = found.bootstrap(n_resamples=99)
    first, total = (
        (interval.confidence_interval.high - interval.confidence_interval.low) / 2
        for interval in (spread.first_order, spread.total_order)
    )
    explained = 1 - float(np.var(left_out - y) / np.var(y))
    return Indices(table.job.design.keys, found.first_order, first, found.total_order, total, explained)


def _unit(log: bool, values: np.ndarray) -> np.ndarray:
    """Values in [0, 1] over their range."""
    given = np.log(values) if log else values
    found: np.ndarray = (given - given.min()) / (np.ptp(given) or 1.0)
    return found
