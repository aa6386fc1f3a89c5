"""The user's own data against the models: remarks on the data, and the validation uncertainty of ASME V&V 20.

After ASME V&V 20-2009 (sections 1-5 and 1-6) the comparison error E = S - D, simulation less data, has the validation
uncertainty u_val, u_val^2 = u_num^2 + u_input^2 + u_D^2: of the numerics, the inputs and the data. The error of the
model itself lies within E -+ k u_val. Over time E is the mean over a window of the trace (`compare.course`), because
one of many noisy samples is far off by chance.
"""

import math
from typing import Any

import numpy as np

from compare import course as courses
from compare import quantities
from compare.against import Data, simulated
from compare.analyses.base import Analysis
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.report import Section, Style, Table
from compare.slopes import Slopes, combined
from compare.verdict import COVERS
from scenes.formats import cut, quantity, signed, span, with_error
from scenes.result import Result, Step, step
from scenes.uncertain import Uncertain


class Against(Analysis[Data]):
    name = "against"

    def plan(self, scene: Any, options: Options) -> Step:
        data: Data = options.against
        said = data.said.partition(": ")[2].rstrip(".")
        return step(f"against {data.name}", f"{said}; {'at rest' if data.at_rest else 'at its own times'}")

    def run(self, outcome: Outcome[Any], progress: Progress) -> Data:
        data: Data = outcome.options.against
        outcome.warn(*(f"{data.name}: {text}" for text in data.warnings))
        sure = quantities.of(outcome.scene, outcome.solved).sure(data.time)
        if not data.curve and 2 * sure.sum() < len(sure):
            why = "the others are outside of the run, too soon after its start or a jump of a drive, or at one"
            outcome.warn(f"{data.name}: {sure.sum()} of {len(sure)} rows are compared: {why}")
        return data

    def section(self, found: Data, outcome: Outcome[Any], style: Style) -> Section:
        return Section("Your data", [found.said], headed=False)

    def enter(self, summary: dict[str, Any], found: Data, outcome: Outcome[Any]) -> None:
        summary["against"] = found.report


class Validation(Analysis[dict[str, Any]]):
    """Its result has ``statements`` on each model and quantity, in the worst window and at the end of the data, and by
    ``points`` how many of the data are within 2 u_val of the model."""

    name = "validation"
    about = "E = S - D against u_val of ASME V&V 20, of every model"

    def asked(self, options: Options) -> bool:
        given = bool(options.uncertain or options.data_uncertainty)
        return given and options.against is not None and not options.against.curve

    def run(self, outcome: Outcome[Any], progress: Progress) -> dict[str, Any]:
        names = {"3D": "fem3d", "1D": "reduced1d"}
        models = {w: (outcome.results[n], outcome.slopes.get(n)) for w, n in names.items() if n in outcome.results}
        return validate(outcome.scene, outcome.options.against, models, outcome.options.uncertain)

    def section(self, found: dict[str, Any], outcome: Outcome[Any], style: Style) -> Section:
        """A line for each statement: E, its parts, the model's error."""
        heads = ["S - D", "mean over", *["E"] * style.page, "u_num", "u_input", "u_D", "u_val", "model's error"]
        rows = []
        for s in found["statements"]:
            parts = [  # An uncertainty that adds nothing to u_val is shown as 0.
                "?" if not math.isfinite(u) else quantity(u, s["unit"], 2) if u > 1e-6 * s["u_val"] else "0"
                for u in (s["u_num"], s["u_input"], s["u_data"], s["u_val"])
            ]
            middle = [signed(s["E"], s["unit"], 2)] * style.page
            when = "steady state" if math.isinf(s["end_s"]) else span(s["start_s"], s["end_s"])
            rows.append([f"{cut(s['called'], 20)} {s['model']}", when, *middle, *parts, s["said"]])
        called = {s["quantity"]: s["called"] for s in found["statements"]}
        counts = ["{} {model} {within_2_u_val} of {points}".format(called[p["quantity"]], **p) for p in found["points"]]
        inputs, data = outcome.options.uncertain is None, not outcome.options.against.u
        exact = " and ".join(["the inputs"] * inputs + ["the data"] * data)
        text = [
            "The worst window and the last." * (not outcome.options.against.at_rest),
            "Where 0 is within (95 %), no error of the model is seen. Points of the data within 2 u_val: "
            f"{', '.join(counts)}.",
            f"Taken as exact: {exact}." if exact else "",
        ]
        return Section("Validation", [Table(heads, rows), *text], headed=False)


def validate(
    scene: Any, data: Data, models: dict[str, tuple[Result, Slopes | None]], uncertain: Uncertain | None
) -> dict[str, Any]:
    """Validate models ("3D", "1D") against data; without ``uncertain`` the inputs are exact.

    In a statement E is the mean over the ``rows`` of the data from ``start_s`` to ``end_s``, infinite in the steady
    state, and k the number of standard uncertainties that make the ``interval`` of the model's error (95 %). Numerical
    errors count as u_num in full.
    """
    catalogue, statements, points = quantities.of(scene, next(iter(models.values()))[0]), [], []
    late = catalogue.sure(data.time)
    times = data.time[late]
    for word, key in catalogue.names.items():
        unit = catalogue.units[key]
        for called, (result, slopes) in models.items():
            answers = result.steady if data.at_rest else result.traces.values if result.traces else {}
            if key not in data.values or key not in answers:
                continue
            (values, u_num), zero = simulated([result], key, times), np.zeros(len(times))
            u_input, of = zero, {"model": called, "quantity": key}
            if uncertain is not None and slopes is not None:
                u_input = combined([slopes.at(name, key, times) for name in uncertain.relative], uncertain)
            u_data = data.u[key][late] if key in data.u else zero
            error, others = values - data.values[key][late], np.hypot(u_num, u_input)
            inside = int((np.abs(error) <= COVERS * np.hypot(others, u_data)).sum())
            points.append(of | {"points": len(times), "within_2_u_val": inside})
            means = courses.windows(times, error, u_data, values)
            worst, k = courses.worst(means, [float(others[window.rows].mean()) for window in means])
            for n, (where, factor) in ({worst: ("worst", k)} | {len(means) - 1: ("end", COVERS)}).items():
                w, during = means[n], times[means[n].rows]
                u = {"u_num": u_num, "u_input": float(u_input[w.rows].mean()), "u_data": w.u_data}
                u_val = math.hypot(*u.values())
                low, high, said = w.distance - factor * u_val, w.distance + factor * u_val, "unknown"
                if math.isfinite(factor * u_val):
                    _, _, shown, places, scale = with_error(w.distance, factor * u_val, unit)
                    said = f"{low * scale:+.{places}f} to {high * scale:+.{places}f} {shown}"
                statements.append({
                    **of, "called": word, "unit": unit, "where": where, "start_s": float(during[0]),
                    "end_s": float(during[-1]), "rows": len(during), "E": w.distance, **u, "k": factor, "u_val": u_val,
                    "interval": [low, high], "seen": not low <= 0 <= high, "said": said,
                })  # fmt: skip
    return {"statements": statements, "points": points}
