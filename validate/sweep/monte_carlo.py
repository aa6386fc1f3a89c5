"""Samples of uncertain inputs, a Latin hypercube, solved by the workers of a sweep: is linear propagation off?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from compare.analyses import ANALYSES
from compare.analyses.base import Analysis
from compare.kinds import kind_of
from compare.options import SAMPLES
from compare.outcome import Outcome, Progress
from compare.processes import processors
from compare.report import Section, Style, Table
from scenes.errors import SceneError
from scenes.formats import quantity
from scenes.parameters import SECTION
from scenes.sink import Sink
from scenes.uncertain import Uncertain
from scenes.varied import is_word, varied
from validate.sweep.design import Scope
from validate.sweep.point import solver

COLUMNS = {"fem3d": "fem3d_{}", "reduced1d": "reduced1d_{}", "checks": "{}_difference"}
"""The columns of points.csv with the quantities of both models and with the differences of the checks."""


class MonteCarlo(Analysis[dict[str, Any]]):
    """Its result has the ``count`` of designs, how many ``failed``, and by each of COLUMNS the spread of each name."""

    name, about = "monte_carlo", "samples of the uncertain inputs, solved by both models"

    def run(self, outcome: Outcome[Any], progress: Progress) -> dict[str, Any]:
        """Solve the samples. Raises SceneError where hardly any has an answer, and NumericsError."""
        propagated, options = outcome.analyses["uncertain"], outcome.options
        count = options.monte_carlo
        scope = Scope(outcome.scene, (options.reduction,), options.steady, blame=False, all_checks=False)
        scenes = enumerate(samples(outcome.scene, propagated.uncertain, count))
        rows = []
        with solver(min(processors(), count), None, None) as solve:
            for done, row in enumerate(solve((replace(scope, scene=scene), n, []) for n, scene in scenes), 1):
                rows += [row] * (row["status"] == "ok")
                progress(f"{done} of {count} samples")
        if len(rows) < SAMPLES[0]:
            raise SceneError(f"only {len(rows)} of {count} samples have an answer: give smaller uncertainties")
        linear = {"fem3d": propagated.fem3d, "reduced1d": propagated.reduced1d}
        linear["checks"] = {c.id: c.u_input for c in outcome.checks if c.u_input is not None and c.u_input > 1e-9}
        found: dict[str, Any] = {"count": count, "failed": count - len(rows)}
        for model, column in COLUMNS.items():
            values = {n: [row[column.format(n)] for row in rows] for n in linear[model] if column.format(n) in rows[0]}
            found[model] = {name: spread(each, linear[model][name]) for name, each in values.items()}
        off = [f"{name} ({model})" for model in COLUMNS for name, each in found[model].items() if is_off(each)]
        if off:
            outcome.warn(f"{count} samples spread otherwise than linear propagation has it: {', '.join(off)}")
        return found

    def section(self, found: dict[str, Any], outcome: Outcome[Any], style: Style) -> Section:
        """The spread of the samples beside the spread by linear propagation."""
        rows = []
        for name, (word, unit) in kind_of(outcome.scene).quantities(outcome.scene).items():
            spreads = [found[model].get(name, {}) for model in ("fem3d", "reduced1d")]
            pairs = [(each, kind) for each in spreads for kind in ("deviation", "linear")]
            rows.append([word, *(quantity(each[kind], unit, 3) if each else "" for each, kind in pairs)])
        heads = (f"of {found['count'] - found['failed']} samples", "3D", "linear", "1D", "linear")
        return Section("Samples", [Table(heads, rows)], headed=False)


def samples(sink: Sink, uncertain: Uncertain, count: int) -> Iterator[Sink]:
    """Yield the sink of each sample.

    Parameters move first, then the keys that are made of them, and last words: a word, such as the offset of a centred
    oxide, stands for a number that depends on the others.
    """
    keys = list(uncertain.relative)
    order = sorted(keys, key=lambda key: (not key.startswith(f"{SECTION}."), is_word(sink, key)))
    for deviations in draw(uncertain, count):
        sample = sink
        for key in order:
            sample = varied(sample, key, 1 + float(deviations[keys.index(key)]))
        yield sample


def draw(uncertain: Uncertain, count: int) -> np.ndarray:
    """(count, keys): relative deviations, normally distributed with the covariance of the inputs; each key's own
    distribution is stratified (McKay, Beckman and Conover, Technometrics 21, 1979)."""
    from scipy.stats import qmc

    covariance, keys = uncertain.covariance(), len(uncertain.relative)
    scale = np.sqrt(np.diag(covariance))
    engine = qmc.LatinHypercube(keys, seed=np.random.default_rng(0))
    normal = qmc.MultivariateNormalQMC(np.zeros(keys), covariance / np.outer(scale, scale), engine=engine)
    furthest = 0.95  # no size becomes negative
    return np.clip(normal.random(count) * scale, -furthest, furthest)


def spread(values: list[float], linear: float) -> dict[str, float]:
    """Return the spread of samples beside their deviation by linear propagation."""
    deviation = float(np.std(values, ddof=1))
    error = deviation / np.sqrt(2 * (len(values) - 1))
    return {"mean": float(np.mean(values)), "deviation": deviation, "standard_error": error, "linear": linear}


def is_off(spread: dict[str, float]) -> bool:
    """Return whether linear propagation is off by more than chance (3 standard errors) and rounding, and by 5 %."""
    least = max(3 * spread["standard_error"], 0.05 * spread["linear"], 1e-9 * abs(spread["mean"]))
    return abs(spread["deviation"] - spread["linear"]) > least


ANALYSES.append(MonteCarlo())
