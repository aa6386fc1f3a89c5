"""Uncertain inputs drawn as a Latin hypercube, and what the samples say of the linear propagation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from inspect import signature

import numpy as np

from compare.inputs.propagation import Propagated
from scenes.formats import percent
from scenes.uncertain import Uncertain

SURELY, MATTERS = 3.0, 0.05  # standard errors, and part of u_input, from which on the linear propagation is off
FURTHEST = 0.95  # of a value that a sample takes off or adds: no size is negative


def draw(uncertain: Uncertain, count: int, seed: int = 0) -> np.ndarray:
    """(count, keys): relative deviations, normally distributed with the covariance of the inputs; each key's own
    distribution is stratified (McKay, Beckman and Conover, Technometrics 21, 1979)."""
    from scipy.stats import norm, qmc

    name = "rng" if "rng" in signature(qmc.LatinHypercube.__init__).parameters else "seed"
    engine = qmc.LatinHypercube(len(uncertain.relative), **{name: np.random.default_rng(seed)})
    covariance = uncertain.covariance()
    scale = np.sqrt(np.diag(covariance))
    # A correlation of one leaves a matrix without a Cholesky factor: its root by eigenvalues always is there.
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = vectors * np.sqrt(np.maximum(values, 0.0)) if uncertain.correlations else np.eye(len(scale))
    found: np.ndarray = norm.ppf(engine.random(count)) @ root.T * scale
    return found.clip(-FURTHEST, FURTHEST)


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation of the samples of a number, the standard error of the latter, and what the linear
    propagation makes of it."""

    mean: float
    deviation: float
    standard_error: float
    linear: float

    @property
    def off(self) -> bool:
        """Whether the linear propagation is off by more than chance, and by enough to matter."""
        apart = abs(self.deviation - self.linear)
        return apart > SURELY * self.standard_error and apart > MATTERS * self.linear


@dataclass(frozen=True)
class Sampled:
    """``count`` designs of which some ``failed``, and the spread of steady quantities of both models and of checks."""

    count: int
    failed: int
    fem3d: dict[str, Spread]
    reduced1d: dict[str, Spread]
    checks: dict[str, Spread]

    def warnings(self) -> tuple[str, ...]:
        """Where the linear propagation is not good enough."""
        models = {"in 3D": self.fem3d, "in 1D": self.reduced1d, "of the check": self.checks}
        off = [
            f"{name} {where} ({percent(spread.deviation / spread.linear - 1, sign=True)})"
            for where, found in models.items() for name, spread in found.items() if spread.off
        ]  # fmt: skip
        return (
            (f"{self.count} samples spread otherwise than linear propagation has it: {', '.join(off)}",) if off else ()
        )


def spreads(
    columns: Mapping[str, np.ndarray], propagated: Propagated, checks: Mapping[str, float], failed: int
) -> Sampled:
    """What samples (columns of points.csv, without those that failed) say; ``checks`` are the linear u_input."""

    def of(column: str, linear: float) -> Spread:
        values = np.asarray(columns[column], float)
        deviation = float(values.std(ddof=1))
        return Spread(float(values.mean()), deviation, deviation / np.sqrt(2 * (len(values) - 1)), linear)

    count = len(next(iter(columns.values()), ()))
    models = {}
    for model, own in (("fem3d", propagated.fem3d), ("reduced1d", propagated.reduced1d)):
        models[model] = {n: of(f"{model}_{n}", u) for n, u in own.items() if f"{model}_{n}" in columns}
    differences = {n: of(f"{n}_difference", u) for n, u in checks.items() if f"{n}_difference" in columns}
    return Sampled(count + failed, failed, models["fem3d"], models["reduced1d"], differences)
