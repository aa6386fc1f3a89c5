"""Keys of the scene, fitted to measured data before the run: bounded least squares with the model's own derivatives.

The logarithms x of the keys minimize |r|^2 with r = (S - D) / u_D. With J = dr/dx their covariance is (J^T J)^-1, where
the model is right and u_D is correct (Seber and Wild, Nonlinear Regression, 1989).

Steps of Gauss and Newton, halved until |r| falls, take a rough solution R, of the accuracy `ENOUGH`, in place of S.
Where a step is within a tenth of the uncertainties, S is solved, and R + (S - R), with this difference, takes the next
steps. The fit ends where no step follows, or where the step is within the uncertainties and within the changes of the
keys by the errors of S. The uncertainties include the step that is left.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.linalg import norm

from compare import quantities
from compare.against import Data, simulated
from compare.analyses.base import Analysis
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.report import Section, Style, Table
from compare.slopes import in_3d
from compare.verdict import COVERS
from scenes.errors import NumericsError, SceneError
from scenes.formats import percent
from scenes.result import Result, Step, step
from scenes.uncertain import path_of
from scenes.validity import check as check_sink
from scenes.varied import kind_of as kind_of_key
from scenes.varied import numbers, varied

TINY = 1e-20  # A bound over the first value where there is none; its inverse is the other one.
SETTLED = 0.1  # A step over the uncertainties of the keys: the misfit is then 1 % of one point's from its least one.
MOST_STEPS, MOST_HALVES = 20, 6


@dataclass(frozen=True)
class Fit:
    """Fitted keys.

    Attributes
    ----------
    start, fitted : values in SI units
    u, correlations : relative standard uncertainties, and correlations (keys, keys)
    misfit : sum of squares over points less keys, about 1 where the model is as good as the data
    points : number of data
    scene, result : the fitted scene, and its result in 3D
    """

    start: dict[str, float]
    fitted: dict[str, float]
    u: dict[str, float]
    correlations: np.ndarray
    misfit: float
    points: int
    scene: Any
    result: Result

    def interval(self, key: str) -> tuple[float, float]:
        """Return the interval of a key (95 %), in SI units."""
        factor = float(np.exp(min(COVERS * self.u[key], -np.log(TINY))))
        return self.fitted[key] / factor, self.fitted[key] * factor

    def warnings(self) -> tuple[str, ...]:
        """Name keys that the data do not determine (u above 0.5, correlations above 0.95 in size), and a misfit."""
        said = [f"the data determine {key} to {percent(u)} only" for key, u in self.u.items() if u > 0.5]
        for (i, a), (j, b) in combinations(enumerate(self.fitted), 2):
            r = float(self.correlations[i, j])
            if abs(r) > 0.95:
                said.append(
                    f"{a} and {b} can't be told apart by these data (correlation {r:+.3f}): they fix about "
                    f"their {'product' if r < 0 else 'ratio'} alone"
                )
        if self.misfit > 1 + 3 * np.sqrt(2 / max(self.points - len(self.fitted), 1)):
            said.append(
                f"the fitted model misses the data by {np.sqrt(self.misfit):.2g} times their uncertainty: something "
                "else than these keys is amiss, and their uncertainties don't say so"
            )
        return tuple(said)


class Calibration(Analysis[Fit]):
    name = "calibrate"

    def plan(self, scene: Any, options: Options) -> Step:
        return step("fit", f"{', '.join(options.calibrate)} by least squares, the rest with what is fitted")

    def prepare(self, outcome: Outcome[Any], progress: Progress) -> None:
        """Solve the fitted scene in place of the given one."""
        scene, data, keys = outcome.scene, outcome.options.against, outcome.options.calibrate
        progress("fitting")
        fit = fit_scene(scene, data, keys_of(scene, keys), progress)
        outcome.scene, outcome.results["fem3d"], outcome.analyses[self.name] = fit.scene, fit.result, fit

    def run(self, outcome: Outcome[Any], progress: Progress) -> Fit:
        fit: Fit = outcome.analyses[self.name]
        outcome.warn(*fit.warnings())
        return fit

    def section(self, found: Fit, outcome: Outcome[Any], style: Style) -> Section:
        """A line for each fitted key: from, to, and its uncertainty."""
        rows = []
        for key, value in found.fitted.items():
            ends = (f"{v:.4g}" for v in found.interval(key))
            rows.append([key, f"{found.start[key]:.4g}", f"{value:.6g}", percent(found.u[key]), *ends])
        text = f"Misfit {found.misfit:.3g} of {found.points} points; values in SI units."
        text += " A model that is fitted to data is not validated by them; other data say whether it is right."
        table = Table(("fitted", "from", "to", "u", "95 % between", "and"), rows)
        return Section("Calibration", [table, text], headed=False)

    def enter(self, summary: dict[str, Any], found: Fit, outcome: Outcome[Any]) -> None:
        summary["calibration"] = {
            "keys": {
                key: {"start": found.start[key], "value": value, "relative_u": found.u[key],
                      "interval": list(found.interval(key))}
                for key, value in found.fitted.items()
            },
            "correlations": found.correlations.tolist(), "misfit": found.misfit, "points": found.points,
        }  # fmt: skip


def keys_of(scene: Any, keys: Sequence[str]) -> tuple[str, ...]:
    """Return the full names of keys to be fitted, each once. Raises SceneError for an unknown key."""
    return tuple(dict.fromkeys(path_of(scene, key, numbers(scene), "--calibrate") for key in keys))


def fit_scene(scene: Any, data: Data, keys: Sequence[str], say: Callable[[str], None] = lambda _: None) -> Fit:
    """Fit keys (by their full names) of a scene in 3D to the data that have an uncertainty.

    Raises SceneError for data of fewer points than keys, where they do not follow a key, and where a fit leaves the
    scenes that can be built.
    """
    from scipy.optimize import lsq_linear

    from fem3d.runs.sensitivities import ENOUGH

    numbered, enough = numbers(scene), max(scene.accuracy, ENOUGH)
    start = np.array([numbered[key] for key in keys])
    # Of the logarithm of a value over its first one.
    limits = np.array([(kind.lower, kind.upper) for kind in (kind_of_key(scene, key) for key in keys)]).T
    least, most = np.log(np.clip(limits / np.abs(start), TINY, 1 / TINY))
    first = replace(_moved(scene, keys, [0.0] * len(keys)), accuracy=enough)
    result = _solve(first)
    problem, best = _Problem(scene, data, keys, result), None
    rough = problem.trial(np.zeros(len(keys)), first, result)
    jacobian, difference = problem.differentiate(rough), np.zeros(len(rough.residuals))
    if still := [key for key, column in zip(keys, jacobian.T, strict=True) if not np.abs(column).max() > 1e-9]:
        raise SceneError(f"--calibrate {still[0]}: nothing in {data.name} follows it, so that it can't be fitted")
    for _ in range(MOST_STEPS):
        normal, x, residuals = jacobian.T @ jacobian, rough.x, rough.residuals + difference
        # Keys with the same effect would leave it singular; their uncertainties come out huge. The part is about the
        # square of the derivatives' rounding.
        covariance = np.linalg.inv(normal + 1e-12 * np.trace(normal) * np.eye(len(keys)))
        u, points, moved = np.sqrt(np.diag(covariance)), len(residuals), np.abs(covariance @ jacobian.T)
        say(f"fitting: misfit {float(residuals @ residuals) / max(points - len(keys), 1):.3g} of {points} points")
        room = np.clip((least - 1e-9 - x, most + 1e-9 - x), -1.0, 1.0)  # by a factor of e at most
        step, solved = lsq_linear(jacobian, -residuals, room).x, best if best is not None and best.x is x else None
        if solved and norm(jacobian @ step) ** 2 <= len(keys) and (np.abs(step) <= moved @ solved.errors).all():
            break
        for n in range(MOST_HALVES):
            part = step / 2**n
            if norm(part / u, np.inf) <= SETTLED:
                break
            with suppress(NumericsError):  # a whole step may lead to a scene that runs away
                trial = problem.solve(x + part, enough)
                if norm(trial.residuals + difference) < norm(residuals):
                    rough = trial
                    break
        if rough.x is not x:
            # Derivatives change by about the part by which the keys do.
            if norm(jacobian @ part) * norm(part, np.inf) > SETTLED:
                jacobian = problem.differentiate(rough)
            continue
        if solved:
            break
        fine = rough if scene.accuracy >= ENOUGH else problem.solve(x, scene.accuracy)
        if best is not None and norm(fine.residuals) >= norm(best.residuals):
            break
        best, difference = fine, fine.residuals - rough.residuals
    if best is None:
        raise NumericsError(f"--calibrate has no end after {MOST_STEPS} steps: begin nearer, or with fewer keys")
    values = numbers(best.scene)
    return Fit(
        dict(zip(keys, start.tolist(), strict=True)), {key: values[key] for key in keys},
        dict(zip(keys, np.hypot(u, step).tolist(), strict=True)), covariance / np.outer(u, u),
        float(best.residuals @ best.residuals) / max(points - len(keys), 1), points, best.scene, best.result,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Trial:
    """A solved ``scene`` with the logarithms ``x`` (keys,) of its keys over their first values.

    The ``residuals`` from the data and the ``errors`` of 3D (points,) are over the uncertainties of the data.
    """

    x: np.ndarray
    scene: Any
    result: Result
    residuals: np.ndarray
    errors: np.ndarray


class _Problem:
    """The residuals of a scene by its keys, at the times of the data at which errors of its ``result`` hold."""

    def __init__(self, scene: Any, data: Data, keys: Sequence[str], result: Result) -> None:
        self._scene, self._keys = scene, keys
        sure = quantities.of(scene, result).sure(data.time)
        self._times = data.time[sure]
        if (points := len(self._times) * len(data.values)) <= len(keys):
            raise SceneError(
                f"--calibrate: {data.name} has too few points ({points}): give more than keys ({len(keys)}), at times "
                "at which the errors of 3D hold"
            )
        modelled = result.steady if np.isinf(self._times[-1]) else result.over_time.values
        self._given = [(n, data.values[n][sure], data.u[n][sure]) for n in data.values if n in data.u and n in modelled]
        if not self._given:
            raise SceneError(
                f"--calibrate: {data.name} has no quantity that the model answers and that is known to some "
                "uncertainty: give --data-uncertainty of one"
            )

    def solve(self, x: np.ndarray, accuracy: float) -> _Trial:
        scene = replace(_moved(self._scene, self._keys, x.tolist()), accuracy=accuracy)
        return self.trial(x, scene, _solve(scene))

    def trial(self, x: np.ndarray, scene: Any, result: Result) -> _Trial:
        found = [(*simulated([result], name, self._times), values, u) for name, values, u in self._given]
        residuals = np.concatenate([(value - measured) / u for value, _, measured, u in found])
        return _Trial(x, scene, result, residuals, np.concatenate([error / u for _, error, _, u in found]))

    def differentiate(self, trial: _Trial) -> np.ndarray:
        """Return the derivatives of the residuals (points, keys)."""
        slopes = in_3d(trial.scene, trial.result, self._keys)
        if left_out := [key for key in self._keys if key in slopes.left_out]:
            raise SceneError(f"--calibrate {left_out[0]}: {slopes.left_out[left_out[0]]}")
        columns = [[np.nan_to_num(slopes.at(k, n, self._times)) / u for n, _, u in self._given] for k in self._keys]
        return np.array([np.concatenate(column) for column in columns]).T


def _moved(scene: Any, keys: Sequence[str], logarithms: Sequence[float]) -> Any:
    """The scene with keys larger by logarithms, checked. SceneError where it cannot be built."""
    for key, factor in zip(keys, np.exp(logarithms).tolist(), strict=True):
        scene = varied(scene, key, factor)
    if scene.kind == "sink":
        return replace(check_sink(scene), expected_to_differ=None)
    from scenes.free.rules import checked

    # A mesh is checked against its scene when it is read.
    return replace(checked(scene) if scene.parts == "boxes" else scene, expected_to_differ=None)


def _solve(scene: Any) -> Result:
    """Solve a sink or a free scene in 3D."""
    from fem3d.runs import scene as scene_run
    from fem3d.runs import sink as sink_run

    return sink_run.solve(scene) if scene.kind == "sink" else scene_run.solve(scene)
