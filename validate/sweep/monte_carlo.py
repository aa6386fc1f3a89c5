"""Samples of uncertain inputs, a Latin hypercube, solved on the workers of a sweep: is linear propagation off?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from compare.analyses import ANALYSES
from compare.analyses.base import Analysis
from compare.analyses.sensitivities import Propagated
from compare.kinds import kind_of
from compare.options import SAMPLES, Options
from compare.outcome import Outcome, Progress
from compare.processes import processors
from compare.report.table import Section, Style, Table
from compare.slopes import STEP
from scenes.errors import SceneError
from scenes.formats import percent, quantity
from scenes.parameters import SECTION
from scenes.result import Step, step
from scenes.sink import Sink
from scenes.uncertain import Uncertain
from scenes.varied import is_word, neighbour, numbers, varied
from validate.sweep.cluster import Cluster
from validate.sweep.design import base
from validate.sweep.point import Scope, Work

SURELY, MATTERS = 3.0, 0.05
"""Linear propagation counts as wrong where the samples' deviation differs by more than this many standard errors, and
this part of u_input."""
ROUNDING = 1e-9
"""Samples that spread by less than this part of the value differ by rounding alone."""
FURTHEST = 0.95
"""A sample changes a value by this part of it at most: no size becomes negative."""


class MonteCarlo(Analysis["Sampled"]):
    name = "monte_carlo"

    def plan(self, scene: Any, options: Options) -> Step:
        return step("samples", f"{options.monte_carlo} samples of the uncertain inputs, solved by both models")

    def prepare(self, outcome: Outcome[Any], progress: Progress) -> None:
        check_apart(outcome.scene, tuple(outcome.options.uncertain.relative))

    def run(self, outcome: Outcome[Any], progress: Progress) -> Sampled:
        """Solve the samples. Raises SceneError where hardly any has an answer, and LostError."""
        propagated: Propagated = outcome.analyses["uncertain"]
        sink, options = outcome.scene, outcome.options
        uncertain, count = propagated.uncertain, options.monte_carlo
        keys, points = tuple(uncertain.relative), drawn(sink, uncertain, count)
        scope = Scope((options.reduction,), options.steady, blame=False, all_checks=False)
        unmoved = base(sink)
        tasks = (Work(unmoved, scope, keys, n, tuple(point)) for n, point in enumerate(points.tolist()))
        rows = []
        with Cluster(min(processors(), count), None, None, progress) as cluster:
            for row in cluster.solve(tasks):
                rows.append(row)
                progress(f"{len(rows)} of {count} samples")
        rows = sorted((row for row in rows if row.status == "ok"), key=lambda row: row.point)
        if len(rows) < SAMPLES[0]:
            raise SceneError(
                f"--monte-carlo {count}: only {len(rows)} samples have an answer: give smaller uncertainties"
            )
        names = [n for n, v in rows[0].values.items() if isinstance(v, float)]
        columns = {n: np.array([row.values[n] for row in rows]) for n in names}
        checks = {c.id: u for c in outcome.checks if (u := c.u_input or 0.0) > ROUNDING}
        sampled = spreads(columns, propagated, checks, count - len(rows))
        outcome.warn(*sampled.warnings())
        return sampled

    def section(self, found: Sampled, outcome: Outcome[Any], style: Style) -> Section:
        """The spread of the samples beside the spread by linear propagation."""
        rows = []
        for name, (word, unit) in kind_of(outcome.scene).quantities(outcome.scene).items():
            pairs = ((s.deviation, s.linear) if s else () for s in (found.fem3d.get(name), found.reduced1d.get(name)))
            rows.append([word, *(cell for pair in pairs for cell in [quantity(x, unit, 3) for x in pair] or ["", ""])])
        heads = (f"of {found.count - found.failed} samples", "3D", "linear", "1D", "linear")
        return Section("Samples", [Table(heads, rows)], headed=False)

    def document(self, found: Sampled, outcome: Outcome[Any]) -> dict[str, Any]:
        return asdict(found)


def register() -> None:
    """Add the analysis to the analyses of a run, once."""
    if not any(isinstance(analysis, MonteCarlo) for analysis in ANALYSES):
        ANALYSES.append(MonteCarlo())


def drawn(sink: Sink, uncertain: Uncertain, count: int) -> np.ndarray:
    """Return (count, keys): the values (SI units) of the uncertain keys in each sample.

    The value of a word, such as the offset of a centred oxide, scales with its value in the sample's sink.
    """
    keys, values = tuple(uncertain.relative), numbers(sink)
    samples: np.ndarray = np.array([values[key] for key in keys]) * (1 + draw(uncertain, count))
    for n, word in enumerate(keys):
        if is_word(sink, word):
            for point in samples:
                changed = sink
                for key, value in zip(keys, point.tolist(), strict=True):
                    changed = varied(changed, key, value / values[key]) if key != word else changed
                point[n] *= numbers(changed)[word] / values[word]
    return samples


def check_apart(sink: Sink, keys: tuple[str, ...]) -> None:
    """Refuse a key beside the parameter that it is made of: a sample gives each a value, and it can have but one."""
    values = numbers(sink)
    for parameter in (key for key in keys if key.startswith(f"{SECTION}.")):
        changed = numbers(neighbour(sink, parameter, STEP))
        made = [key for key in keys if not key.startswith(f"{SECTION}.") and not is_word(sink, key)]
        for key in (key for key in made if changed.get(key) != values[key]):
            raise SceneError(
                f"--monte-carlo: {key} is made of {parameter}, and both are uncertain: give one of the two"
            )


def draw(uncertain: Uncertain, count: int) -> np.ndarray:
    """(count, keys): relative deviations, normally distributed with the covariance of the inputs; each key's own
    distribution is stratified (McKay, Beckman and Conover, Technometrics 21, 1979)."""
    from scipy.stats import qmc

    covariance, keys = uncertain.covariance(), len(uncertain.relative)
    scale = np.sqrt(np.diag(covariance))
    engine = qmc.LatinHypercube(keys, seed=np.random.default_rng(0))
    normal = qmc.MultivariateNormalQMC(np.zeros(keys), covariance / np.outer(scale, scale), engine=engine)
    return np.clip(normal.random(count) * scale, -FURTHEST, FURTHEST)


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation of samples, its standard error, and the deviation by linear propagation."""

    mean: float
    deviation: float
    standard_error: float
    linear: float

    @property
    def off(self) -> bool:
        """Whether the linear propagation is off by more than chance, and by enough to matter."""
        apart = abs(self.deviation - self.linear)
        return apart > max(SURELY * self.standard_error, MATTERS * self.linear, ROUNDING * abs(self.mean))


@dataclass(frozen=True)
class Sampled:
    """``count`` designs of which some ``failed``, and the spread of steady quantities of both models and of checks."""

    count: int
    failed: int
    fem3d: dict[str, Spread]
    reduced1d: dict[str, Spread]
    checks: dict[str, Spread]

    def warnings(self) -> tuple[str, ...]:
        """Return a warning where the linear propagation is not good enough."""
        models = {"in 3D": self.fem3d, "in 1D": self.reduced1d, "of the check": self.checks}
        off = [
            f"{name} {where} ({percent(s.deviation / s.linear - 1 if s.linear else np.inf, sign=True)})"
            for where, by_name in models.items() for name, s in by_name.items() if s.off
        ]  # fmt: skip
        said = f"{self.count} samples spread otherwise than linear propagation has it: {', '.join(off)}"
        return (said,) if off else ()


def spreads(
    columns: Mapping[str, np.ndarray], propagated: Propagated, checks: Mapping[str, float], failed: int
) -> Sampled:
    """Return the spreads of samples, the columns of points.csv without failures; ``checks`` are the linear u_input."""
    count = len(next(iter(columns.values()), ()))

    def spread(form: str, linear: Mapping[str, float]) -> dict[str, Spread]:
        """The spread of each quantity whose column has a name of this form."""
        found = {}
        for name, u in linear.items():
            if (values := columns.get(form.format(name))) is not None:
                deviation = float(values.std(ddof=1))
                found[name] = Spread(float(values.mean()), deviation, deviation / np.sqrt(2 * (count - 1)), u)
        return found

    models = spread("fem3d_{}", propagated.fem3d), spread("reduced1d_{}", propagated.reduced1d)
    return Sampled(count + failed, failed, *models, spread("{}_difference", checks))
