"""Keys of the scene, fitted to measured data before the run: bounded least squares with the models' own derivatives.

The logarithms of the keys minimize sum ((S - D) / u_D)^2. With the derivatives J of the residuals their covariance is
(J^T J)^-1, where the model is right and u_D is correct (Seber and Wild, Nonlinear Regression, 1989).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from compare import quantities
from compare.against import Data, simulated
from compare.analyses.base import Analysis
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.report import Section, Style, Table
from compare.slopes import in_3d
from compare.verdict import COVERS
from scenes.errors import SceneError
from scenes.formats import percent
from scenes.result import Result, Step, step
from scenes.uncertain import path_of
from scenes.validity import check as check_sink
from scenes.varied import kind_of as kind_of_key
from scenes.varied import numbers, varied

TINY = 1e-20  # A bound over the first value where there is none; its inverse is the other one.


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
        fit = fit_scene(scene, data, keys_of(scene, keys))
        outcome.scene, outcome.analyses[self.name] = fit.scene, fit

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


def fit_scene(scene: Any, data: Data, keys: Sequence[str]) -> Fit:
    """Fit keys (by their full names) of a scene in 3D to the data that have an uncertainty.

    Raises SceneError for data of fewer points than keys, where they do not follow a key, and where a fit leaves the
    scenes that can be built.
    """
    from scipy.optimize import least_squares

    sure, numbered = quantities.of(scene).sure(data.time), numbers(scene)
    start = {key: numbered[key] for key in keys}
    points = int(sure.sum()) * len(data.values)
    if points <= len(keys):
        raise SceneError(f"--calibrate: {data.name} has too few points ({points}): give more than keys ({len(keys)})")
    # Of the logarithm of a value over its first one.
    limits = np.array([(kind.lower, kind.upper) for kind in (kind_of_key(scene, key) for key in keys)]).T
    least, most = np.log(np.clip(limits / np.abs([*start.values()]), TINY, 1 / TINY))
    times = data.time[sure]

    @lru_cache(maxsize=1)  # a result in 3D is large
    def solved(*x: float) -> tuple[Any, Result, list[str]]:
        """The scene at logarithms of the keys, its result, and the quantities of both."""
        moved = _moved(scene, keys, x)
        result = _solve(moved)
        modelled = result.steady if np.isinf(times[-1]) else result.over_time.values
        if not (names := [name for name in data.values if name in data.u and name in modelled]):
            raise SceneError(
                f"--calibrate: {data.name} has no quantity that the model answers and that is known to some "
                "uncertainty: give --data-uncertainty of one"
            )
        return moved, result, names

    def residuals(x: np.ndarray) -> np.ndarray:
        _, result, names = solved(*x)
        off = [(simulated([result], n, times)[0] - data.values[n][sure]) / data.u[n][sure] for n in names]
        return np.concatenate(off)

    @cache
    def derivatives(*x: float) -> np.ndarray:
        moved, result, names = solved(*x)
        slopes = in_3d(moved, result, keys)
        if left_out := [key for key in keys if key in slopes.left_out]:
            raise SceneError(f"--calibrate {left_out[0]}: {slopes.left_out[left_out[0]]}")
        columns = [[np.nan_to_num(slopes.at(key, n, times)) / data.u[n][sure] for n in names] for key in keys]
        return np.array([np.concatenate(column) for column in columns]).T

    jacobian = derivatives(*np.zeros(len(keys)))
    still = [key for key, column in zip(keys, jacobian.T, strict=True) if not np.abs(column).max() > 1e-9]
    if still:
        raise SceneError(f"--calibrate {still[0]}: nothing in {data.name} follows it, so that it can't be fitted")
    # The last step, shorter than a thousandth of all or better by 1e-5 of the squares, needs no derivatives.
    solution = least_squares(
        residuals, np.zeros(len(keys)), lambda x: derivatives(*x), (least - 1e-9, most + 1e-9), x_scale="jac",
        xtol=1e-3, ftol=1e-5, max_nfev=20,
    )  # fmt: skip
    normal, fitted = solution.jac.T @ solution.jac, _moved(scene, keys, solution.x)
    # Keys with the same effect would leave it singular; their uncertainties come out huge. The part is about the square
    # of the derivatives' rounding.
    covariance = np.linalg.inv(normal + 1e-12 * np.trace(normal) * np.eye(len(keys)))
    u = np.sqrt(np.diag(covariance))
    return Fit(
        start, {key: numbers(fitted)[key] for key in keys}, dict(zip(keys, u.tolist(), strict=True)),
        covariance / np.outer(u, u), 2 * float(solution.cost) / max(len(solution.fun) - len(keys), 1),
        len(solution.fun), fitted,
    )  # fmt: skip


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
    if scene.kind == "sink":
        from fem3d.runs.sink import solve as solve_sink

        return solve_sink(scene)
    from fem3d.runs.scene import solve

    return solve(scene)
