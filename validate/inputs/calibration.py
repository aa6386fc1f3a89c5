"""Inputs fitted to measured traces: bounded least squares with the models' own derivatives.

The logarithms of the keys are sought that make sum ((S - D) / u_D)^2 least; with the derivatives J of the residuals
their covariance is (J^T J)^-1 where the model is right and u_D is known (Seber and Wild, Nonlinear Regression, 1989).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compare.against import Data
from scenes.checks import FIRST_TIME
from scenes.errors import SceneError
from scenes.formats import percent
from scenes.plan import Request
from scenes.sink import Sink
from scenes.uncertain import path_of
from scenes.validity import check
from scenes.varied import kind_of, numbers, varied
from validate.inputs.propagation import of_values

COVERS = 1.96
"""Of a normal distribution 95 % lie within so many standard deviations."""
APART = 0.95  # of correlations, from which on two keys are not told apart
TOLD = 0.5  # of a relative standard uncertainty, from which on the data tell nothing of a key
MOST = 20  # solutions
SINGULAR = 1e-12  # of the normal matrix: about the square of the rounding of derivatives
WIDEST = 50.0  # of a logarithm
TINY = 1e-300  # a bound where there is none: still a number, and its inverse too

Modelled = tuple[Mapping[str, np.ndarray], Mapping[str, Mapping[str, np.ndarray]]]
"""Traces by quantity, and their derivatives by the logarithm of each key, by key and quantity, all (times,)."""


@dataclass(frozen=True)
class Fit:
    """Keys with their values at the ``start`` and ``fitted`` (SI units), the relative standard uncertainties ``u`` and
    the ``correlations`` (keys, keys) of the latter, and the ``scene`` that results; ``misfit`` is the sum of squares
    over ``points`` less keys, about 1 where the model is as good as the data."""

    start: dict[str, float]
    fitted: dict[str, float]
    u: dict[str, float]
    correlations: np.ndarray
    misfit: float
    points: int
    scene: Sink

    def interval(self, key: str) -> tuple[float, float]:
        """Where a key lies (95 %), in SI units."""
        half = min(COVERS * self.u[key], WIDEST)
        return float(self.fitted[key] * np.exp(-half)), float(self.fitted[key] * np.exp(half))

    def warnings(self) -> tuple[str, ...]:
        """What the data don't tell, and what they tell against the model."""
        keys, said = list(self.fitted), []
        for i, a in enumerate(keys):
            if self.u[a] > TOLD:
                said.append(f"the data tell little of {a}: it is fitted to {percent(self.u[a])}")
            for j in range(i):
                r = float(self.correlations[i, j])
                if abs(r) > APART:
                    what = "product" if r < 0 else "ratio"
                    said.append(
                        f"{keys[j]} and {a} can't be told apart by these data (correlation {r:+.3f}): they fix about "
                        f"their {what} alone"
                    )
        if self.misfit > 1 + 3 * np.sqrt(2 / max(self.points - len(keys), 1)):
            said.append(
                f"the fitted model misses the data by {np.sqrt(self.misfit):.2g} times their uncertainty: something "
                "else than these keys is amiss, and their uncertainties don't say so"
            )
        return tuple(said)

    def document(self) -> dict[str, Any]:
        """As the summary has it."""
        return {
            "keys": {
                key: {"start": self.start[key], "value": value, "relative_u": self.u[key],
                      "interval": list(self.interval(key))}
                for key, value in self.fitted.items()
            },
            "correlations": self.correlations.tolist(), "misfit": self.misfit, "points": self.points,
        }  # fmt: skip


def keys_of(sink: Sink, keys: Sequence[str], data: Data) -> tuple[str, ...]:
    """The full names of keys to be fitted. Raises SceneError for what can't be: an unknown key, one that is named
    twice, data of fewer points than there are keys."""
    paths = tuple(path_of(sink, key, numbers(sink), "--calibrate") for key in keys)
    again = next((path for n, path in enumerate(paths) if path in paths[:n]), None)
    if again is not None:
        raise SceneError(f"--calibrate names {again} twice: give each key once")
    points = int(_late(sink, data).sum()) * len(data.values)
    if points <= len(paths):
        raise SceneError(
            f"--calibrate: {data.name} has {points} points, which can't tell {len(paths)} keys: give data of more "
            "points than keys"
        )
    return paths


def fit(
    sink: Sink,
    data: Data,
    keys: Sequence[str],
    model: Callable[[Sink, Sequence[str], np.ndarray], Modelled],
) -> Fit:
    """Fits keys (by their full names) of a sink to data, those of their quantities that have an uncertainty.

    ``model`` gives the traces of a sink at some times and their derivatives by keys. Raises SceneError where the data
    don't follow a key, or a fit leaves what can be built, and what the model raises.
    """
    from scipy.optimize import least_squares

    late = _late(sink, data)
    times, names = data.time[late], [name for name in data.values if name in data.u]
    known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def at(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if x.tobytes() not in known:
            values, slopes = model(check(_with(sink, keys, x)), keys, times)
            u = {name: data.u[name][late] for name in names}
            residuals = np.concatenate([(values[n] - data.values[n][late]) / u[n] for n in names])
            columns = [np.concatenate([slopes[key][n] / u[n] for n in names]) for key in keys]
            known[x.tobytes()] = residuals, np.array(columns).T
        return known[x.tobytes()]

    jacobian = at(np.zeros(len(keys)))[1]
    still = [key for key, column in zip(keys, jacobian.T, strict=True) if not np.abs(column).max() > 1e-9]
    if still:
        raise SceneError(f"--calibrate {still[0]}: nothing in {data.name} follows it, so that it can't be fitted")
    bounds = np.array([_bounds(sink, key) for key in keys]).T
    found = least_squares(
        lambda x: at(x)[0], np.zeros(len(keys)), lambda x: at(x)[1], (bounds[0], bounds[1]), x_scale="jac",
        xtol=1e-5, ftol=1e-8, max_nfev=MOST,
    )  # fmt: skip
    residuals, jacobian = at(found.x)
    normal = jacobian.T @ jacobian
    # Where keys can't be told apart at all it would have no inverse; they come out as known to next to nothing.
    covariance = np.linalg.inv(normal + SINGULAR * np.trace(normal) * np.eye(len(keys)))
    deviations = np.sqrt(np.diag(covariance))
    start, free = {key: numbers(sink)[key] for key in keys}, max(len(residuals) - len(keys), 1)
    scene = check(replace(_with(sink, keys, found.x), expected_to_differ=None))
    return Fit(
        start, {key: numbers(scene)[key] for key in keys}, dict(zip(keys, deviations.tolist(), strict=True)),
        covariance / np.outer(deviations, deviations), float(residuals @ residuals) / free, len(residuals), scene,
    )  # fmt: skip


def _with(sink: Sink, keys: Sequence[str], x: np.ndarray) -> Sink:
    for key, log in zip(keys, x.tolist(), strict=True):
        sink = varied(sink, key, float(np.exp(log)))
    return sink


def _late(sink: Sink, data: Data) -> np.ndarray:
    return (data.time >= FIRST_TIME) & (data.time <= sink.end_time * (1 + 1e-9))


def _bounds(sink: Sink, key: str) -> tuple[float, float]:
    """Of the logarithm of a key over its value: those of its kind."""
    kind, value = kind_of(sink, key), abs(numbers(sink)[key])
    return float(np.log(max(kind.lower, TINY) / value)) - 1e-9, float(np.log(min(kind.upper, 1 / TINY) / value)) + 1e-9


def in_3d(sink: Sink, keys: Sequence[str], times: np.ndarray) -> Modelled:
    """The traces of a sink in 3D and their derivatives."""
    from fem3d.runs import sink as sink_run
    from fem3d.runs import sink_sensitivity

    result = sink_run.solve(sink, Request(models=("fem3d",)))
    slopes = sink_sensitivity.of_sink(sink, result, keys=keys)
    assert slopes.course is not None
    left_out = next((key for key in keys if key in slopes.left_out), None)
    if left_out is not None:
        raise SceneError(f"--calibrate {left_out}: {slopes.left_out[left_out]}")
    values = {n: np.interp(times, result.over_time.time, v) for n, v in result.over_time.values.items()}
    late = np.log(np.maximum(times, slopes.course.times[0]))
    by = {
        key: {n: np.interp(late, np.log(slopes.course.times), s) for n, s in of.items()}
        for key, of in slopes.course.values.items()
    }
    return values, of_values(sink, values, by)
