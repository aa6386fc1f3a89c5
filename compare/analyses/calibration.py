"""Keys of the scene, fitted to measured data before the run."""

from typing import Any

from compare import fitting
from compare.analyses.base import Analysis
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.report import Section, Style, Table, short_key
from scenes.formats import percent
from scenes.result import Step, step


class Calibration(Analysis[fitting.Fit]):
    name = "calibrate"

    def plan(self, scene: Any, options: Options) -> Step:
        return step("fit", f"{', '.join(options.calibrate)} by least squares, the rest with what is fitted")

    def prepare(self, outcome: Outcome[Any], progress: Progress) -> None:
        """Solve the fitted scene in place of the given one."""
        scene, data, keys = outcome.scene, outcome.options.against, outcome.options.calibrate
        progress("fitting")
        fit = fitting.fit_scene(scene, data, fitting.keys_of(scene, keys))
        outcome.scene, outcome.analyses[self.name] = fit.scene, fit

    def run(self, outcome: Outcome[Any], progress: Progress) -> fitting.Fit:
        fit: fitting.Fit = outcome.analyses[self.name]
        outcome.warn(*fit.warnings())
        return fit

    def section(self, found: fitting.Fit, outcome: Outcome[Any], style: Style) -> Section:
        """A line for each fitted key: from, to, and its uncertainty."""
        rows = []
        for key, value in found.fitted.items():
            ends = (f"{v:.4g}" for v in found.interval(key))
            rows.append([short_key(key), f"{found.start[key]:.4g}", f"{value:.6g}", percent(found.u[key]), *ends])
        text = f"Misfit {found.misfit:.3g} of {found.points} points; values in SI units."
        text += " A model that is fitted to data is not validated by them; other data say whether it is right."
        table = Table(("fitted", "from", "to", "u", "95 % between", "and"), rows)
        return Section("Calibration", [table, text], headed=False)

    def enter(self, summary: dict[str, Any], found: fitting.Fit, outcome: Outcome[Any]) -> None:
        summary["calibration"] = {
            "keys": {
                key: {"start": found.start[key], "value": value, "relative_u": found.u[key],
                      "interval": list(found.interval(key))}
                for key, value in found.fitted.items()
            },
            "correlations": found.correlations.tolist(), "misfit": found.misfit, "points": found.points,
        }  # fmt: skip
