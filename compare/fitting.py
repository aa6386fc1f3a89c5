"""Fit inputs to measured data: bounded least squares with the models' own derivatives.

The logarithms of the keys minimize sum ((S - D) / u_D)^2. With the derivatives J of the residuals their covariance is
(J^T J)^-1, where the model is right and u_D is correct (Seber and Wild, Nonlinear Regression, 1989).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compare import quantities
from compare.against import Data, simulated
from compare.kinds.free import own_model
from compare.outcome import Outcome
from scenes.errors import SceneError, did_you_mean
from scenes.formats import percent
from scenes.model import AnyScene, OwnModel
from scenes.uncertain import path_of
from scenes.varied import kind_of as kind_of_key
from scenes.varied import numbers, varied

OF_MODEL = "model.parameters."
"""Start of the keys of a 1D model's own parameters."""
COVERS = 1.96
"""Standard deviations of a normal distribution that hold 95 %."""
APART = 0.95  # Two keys can't be told apart where their correlation exceeds this in size.
TOLD = 0.5  # The data say nothing of a key whose relative standard uncertainty exceeds this.
MOST = 20  # The most solutions of the least-squares iteration.
SINGULAR = 1e-12  # Added to the normal matrix, times its trace: about the square of the derivatives' rounding.
WIDEST = 50.0  # The largest step of the logarithm of a key without bounds.
BESIDE = 1e-3  # Step of a central difference in the logarithm of a key; its relative error is the step's square.
TINY = 1e-300  # A bound where there is none: still a number, as is its inverse.

Modelled = tuple[Mapping[str, np.ndarray], Mapping[str, Mapping[str, np.ndarray]]]
"""Traces by quantity, and their derivatives by the logarithm of each key, by key and quantity, all (times,)."""
SceneModel = Callable[[Any, Sequence[str], np.ndarray], Modelled]
"""The quantities of a scene at times (s), with their derivatives by keys."""


@dataclass(frozen=True)
class Fit:
    """Fitted keys.

    Attributes
    ----------
    start, fitted : values in SI units
    u, correlations : relative standard uncertainties, and correlations (keys, keys)
    misfit : sum of squares over points less keys, about 1 where the model is as good as the data
    points : number of data
    scene : the fitted scene
    """

    start: dict[str, float]
    fitted: dict[str, float]
    u: dict[str, float]
    correlations: np.ndarray
    misfit: float
    points: int
    scene: Any

    def interval(self, key: str) -> tuple[float, float]:
        """Return the interval of a key (95 %), in SI units."""
        half = min(COVERS * self.u[key], WIDEST)
        return float(self.fitted[key] * np.exp(-half)), float(self.fitted[key] * np.exp(half))

    def warnings(self) -> tuple[str, ...]:
        """Name keys that the data do not determine, and a misfit."""
        keys, said = list(self.fitted), []
        for i, a in enumerate(keys):
            if self.u[a] > TOLD:
                said.append(f"the data determine {a} to {percent(self.u[a])} only")
            for j in range(i):
                r = float(self.correlations[i, j])
                if abs(r) > APART:
                    said.append(
                        f"{keys[j]} and {a} can't be told apart by these data (correlation {r:+.3f}): they fix about "
                        f"their {'product' if r < 0 else 'ratio'} alone"
                    )
        if self.misfit > 1 + 3 * np.sqrt(2 / max(self.points - len(keys), 1)):
            said.append(
                f"the fitted model misses the data by {np.sqrt(self.misfit):.2g} times their uncertainty: something "
                "else than these keys is amiss, and their uncertainties don't say so"
            )
        return tuple(said)


def of_model(keys: Sequence[str]) -> bool:
    """Whether keys to be fitted are a 1D model's own. Raises SceneError for some of both kinds."""
    flags = [key.startswith(OF_MODEL) for key in keys]
    if any(flags) and not all(flags):
        raise SceneError(
            f"--calibrate fits keys of the scene in 3D, or with {OF_MODEL}NAME those of the 1D model: give one kind in "
            "a run"
        )
    return any(flags)


def keys_of(scene: Any, keys: Sequence[str]) -> tuple[str, ...]:
    """Return the full names of keys to be fitted. Raises SceneError for an unknown key, or one that is named twice."""
    paths = tuple(path_of(scene, key, numbers(scene), "--calibrate") for key in keys)
    again = next((path for n, path in enumerate(paths) if path in paths[:n]), None)
    if again is not None:
        raise SceneError(f"--calibrate names {again} twice: give each key once")
    return paths


def fit_scene(scene: Any, data: Data, keys: Sequence[str], model: SceneModel | None = None) -> Fit:
    """Fit keys (by their full names) of a scene to data, by a ``model``, by default 3D.

    Raises SceneError as `fit`, and where a fit leaves the scenes that can be built.
    """

    def with_(values: Mapping[str, float]) -> Any:
        changed = scene
        for key, value in values.items():
            changed = varied(changed, key, value / start[key])
        if scene.kind == "sink":
            from scenes.validity import check as check_sink

            return replace(check_sink(changed), expected_to_differ=None)
        from scenes.free import check

        # A mesh is checked against its scene when it is read.
        return replace(check(changed) if changed.parts == "boxes" else changed, expected_to_differ=None)

    start, bounds = {key: numbers(scene)[key] for key in keys}, []
    for key in keys:
        kind, value = kind_of_key(scene, key), abs(start[key])
        bounds.append([np.log(max(kind.lower, TINY) / value) - 1e-9, np.log(min(kind.upper, 1 / TINY) / value) + 1e-9])
    by_scene = model or in_3d
    found = fit(scene, data, start, lambda values, times: by_scene(with_(values), keys, times), with_, np.array(bounds))
    return replace(found, fitted={key: numbers(found.scene)[key] for key in keys})


def in_3d(scene: Any, keys: Sequence[str], times: np.ndarray) -> Modelled:
    """Return the quantities in 3D at times (s), or at rest. SceneError for a key that has no derivative."""
    from compare import slopes as slopes_

    if scene.kind == "sink":
        from fem3d.runs.sink import solve as solve_sink

        result = solve_sink(scene)
        slopes = slopes_.sink_3d(scene, result, keys)
    else:
        from fem3d.runs.scene import solve

        result = solve(scene, lambda _: None, whole=True)
        slopes = slopes_.free_3d(scene, result, keys)
    left_out = next((key for key in keys if key in slopes.left_out), None)
    if left_out is not None:
        raise SceneError(f"--calibrate {left_out}: {slopes.left_out[left_out]}")
    names = result.steady if np.isinf(times[-1]) else result.over_time.values
    values = {name: simulated(result, name, times)[0] for name in names}
    return values, {key: {name: np.nan_to_num(slopes.at(key, name, times)) for name in names} for key in keys}


def fit(
    scene: Any, data: Data, start: Mapping[str, float],
    model: Callable[[Mapping[str, float], np.ndarray], Modelled], with_: Callable[[Mapping[str, float]], Any],
    bounds: np.ndarray,
) -> Fit:  # fmt: skip
    """Fit keys to the quantities of data that have an uncertainty.

    Parameters
    ----------
    start : the keys with their first values
    model : the quantities for values of the keys at times (s), with their derivatives
    with_ : the scene with values of the keys
    bounds : (keys, 2) of the logarithm of a value over its first one

    Raises SceneError for data of fewer points than keys, and where they do not follow a key.
    """
    from scipy.optimize import least_squares

    sure, keys = quantities.of(scene).sure(data.time), list(start)
    points = int(sure.sum()) * len(data.values)
    if points <= len(keys):
        raise SceneError(
            f"--calibrate: {data.name} has {points} point{'s' * (points != 1)}, which can't tell {len(keys)} "
            f"key{'s' * (len(keys) > 1)}: give data of more points than keys"
        )
    solved: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def values(x: np.ndarray) -> dict[str, float]:
        return {key: start[key] * float(np.exp(log)) for key, log in zip(keys, x.tolist(), strict=True)}

    def at(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals and their derivatives."""
        if x.tobytes() not in solved:
            traces, slopes = model(values(x), data.time[sure])
            names = [name for name in data.values if name in data.u and name in traces]
            if not names:
                raise SceneError(
                    f"--calibrate: {data.name} has no quantity that the model answers and that is known to some "
                    "uncertainty: give --data-uncertainty of one"
                )
            u = {name: data.u[name][sure] for name in names}
            residuals = np.concatenate([(traces[n] - data.values[n][sure]) / u[n] for n in names])
            columns = [np.concatenate([slopes[key][n] / u[n] for n in names]) for key in keys]
            solved[x.tobytes()] = residuals, np.array(columns).T
        return solved[x.tobytes()]

    jacobian = at(np.zeros(len(keys)))[1]
    still = [key for key, column in zip(keys, jacobian.T, strict=True) if not np.abs(column).max() > 1e-9]
    if still:
        raise SceneError(f"--calibrate {still[0]}: nothing in {data.name} follows it, so that it can't be fitted")
    solution = least_squares(
        lambda x: at(x)[0], np.zeros(len(keys)), lambda x: at(x)[1], tuple(bounds.T), x_scale="jac", xtol=1e-5,
        ftol=1e-8, max_nfev=MOST,
    )  # fmt: skip
    residuals, jacobian = at(solution.x)
    normal = jacobian.T @ jacobian
    # Keys with the same effect would leave it singular; their uncertainties come out huge.
    covariance = np.linalg.inv(normal + SINGULAR * np.trace(normal) * np.eye(len(keys)))
    u, fitted = np.sqrt(np.diag(covariance)), values(solution.x)
    return Fit(
        dict(start), fitted, dict(zip(keys, u.tolist(), strict=True)), covariance / np.outer(u, u),
        float(residuals @ residuals) / max(len(residuals) - len(keys), 1), len(residuals), with_(fitted),
    )  # fmt: skip


def fit_own_model(outcome: Outcome[AnyScene]) -> Fit:
    """Fit parameters of the user's own model, [model.parameters] of the scene. SceneError where there is none."""
    from compare.models import open_model
    from compare.models.sampling import ask, make_question

    scene, data, keys = outcome.scene, outcome.options.against, outcome.options.calibrate
    given = own_model(scene, outcome.options) if scene.kind == "free" else None
    if given is None:
        raise SceneError(f"--calibrate {keys[0]} is of a 1D model: give one with --model, too")
    own, parameters = open_model(*given), dict(make_question(scene).parameters)
    for name in (key.removeprefix(OF_MODEL) for key in keys):
        if not parameters.get(name):
            listed = f"has {', '.join(parameters)}" if parameters else "has none"
            is_zero = name in parameters
            why = "is zero, of which there is no percent" if is_zero else f"is none: [model.parameters] {listed}"
            raise SceneError(f"--calibrate model.parameters.{name} {why}{did_you_mean(name, parameters)}")

    def with_(values: Mapping[str, float]) -> AnyScene:
        model = scene.model or OwnModel()
        changed = dict(model.parameters) | {key.removeprefix(OF_MODEL): value for key, value in values.items()}
        return replace(scene, model=replace(model, parameters=tuple(changed.items())))

    def answers(values: Mapping[str, float], times: np.ndarray) -> dict[str, np.ndarray]:
        # A model over time is run up to the last time, which is that of the run.
        every = None if np.isinf(times[-1]) else np.union1d(times, scene.end_time)
        found = ask(own, make_question(with_(values)), every).values
        return {n: np.atleast_1d(v) if every is None else np.interp(times, every, v) for n, v in found.items()}

    def modelled(values: Mapping[str, float], times: np.ndarray) -> Modelled:
        slopes = {}
        for key, value in values.items():
            more, less = (answers({**values, key: value * np.exp(step)}, times) for step in (BESIDE, -BESIDE))
            slopes[key] = {n: (more[n] - less[n]) / (2 * BESIDE) for n in more}
        return answers(values, times), slopes

    start = {key: parameters[key.removeprefix(OF_MODEL)] for key in keys}
    if len(start) < len(keys):
        raise SceneError("--calibrate names a parameter twice: give each key once")
    return fit(scene, data, start, modelled, with_, np.array([[-WIDEST, WIDEST]] * len(start)))
