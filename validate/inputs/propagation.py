"""What the uncertainties of the inputs make of quantities and of differences: u_input of ASME V&V 20.

To first order (GUM 5.2.2): u_input^2 = s^T C s with the logarithmic derivatives s of a quantity and the covariance C of
the relative deviations of the keys. Both models have the same keys, which move them together: the u_input of a
difference is that of the difference, with its own derivatives. What samples, a Latin hypercube, say of that is at the
end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from inspect import signature
from typing import Any

import numpy as np

from compare.against import Data, checked, distance, furthest, part
from compare.checks import DEFINITIONS
from compare.verdict import Check, Comparison, Models
from scenes.device import Device
from scenes.errors import SceneError
from scenes.formats import percent
from scenes.result import Estimate, Result
from scenes.sink import Sink
from scenes.uncertain import Uncertain
from scenes.varied import neighbour, varied
from validate.inputs.sensitivities import QUANTITIES, Sensitivities, of_sink

STEP = 1e-4  # Relative step of a key in central differences of formulas; its relative error is the square.
BENT, SHARE = 0.1, 0.3
"""A key's effect counts as bent where its second-order part exceeds this part of the first-order one, and the
first-order one this part of u_input."""
PROFILE = "fig5"
"""The check of the profile, whose derivatives are computed on their own."""
WIDEST = 0.1  # The largest relative step of a key by which a device is moved to either side.
OF_3D = {
    "dev3d_sink_power": "sink_power_W", "dev3d_sensor_power": "sensor_power_W",
    "dev3d_sink_voltage": "sink_V", "dev3d_sensor_voltage": "sensor_V",
}  # fmt: skip
"""Checks of the device that compare a steady quantity of both models."""
BALANCE = "energy"
"""The check of the energy balance, which inputs do not move."""

Estimates = Mapping[str, Estimate]
SURELY, MATTERS = 3.0, 0.05
"""Linear propagation counts as wrong where the samples' deviation differs by more than this many standard errors, and
this part of u_input."""
ROUNDING = 1e-9  # Samples that spread by less than this part of the value differ by rounding alone.
FURTHEST = 0.95  # A sample changes a value by this part of it at most: no size becomes negative.


@dataclass(frozen=True)
class Propagated:
    """u_input by quantity: ``fem3d`` and ``reduced1d`` in the quantity's unit, ``difference`` of 1D / 3D - 1; and which
    key adds ``most`` to its square; ``sensitivities`` are what it is made of."""

    uncertain: Uncertain
    sensitivities: Sensitivities
    fem3d: dict[str, float]
    reduced1d: dict[str, float]
    difference: dict[str, float]
    most: dict[str, str]


def propagated(
    uncertain: Uncertain, sensitivities: Sensitivities, fem3d: Estimates | None, reduced1d: Estimates | None
) -> Propagated:
    """The u_input of the quantities of both models, by their values, and of their differences."""
    keys, covariance = list(uncertain.relative), uncertain.covariance()
    by_name_3d: dict[str, np.ndarray] = {}
    by_name_1d: dict[str, np.ndarray] = {}
    for model, result, into in (("fem3d", fem3d, by_name_3d), ("reduced1d", reduced1d, by_name_1d)):
        for name in result or ():
            slopes = [_slope(sensitivities, key, name, model) for key in keys]
            if all(s is not None for s in slopes):
                into[name] = np.array(slopes, float)
    u_3d = {n: abs(fem3d[n].value) * combined(s, covariance) for n, s in by_name_3d.items()} if fem3d else {}
    u_1d = {n: abs(reduced1d[n].value) * combined(s, covariance) for n, s in by_name_1d.items()} if reduced1d else {}
    apart = {}
    if fem3d and reduced1d:
        for name in [n for n in by_name_3d if n in by_name_1d]:
            ratio = reduced1d[name].value / fem3d[name].value
            apart[name] = abs(ratio) * combined(by_name_1d[name] - by_name_3d[name], covariance)
    most = {n: _most(keys, s, covariance) for n, s in (by_name_1d | by_name_3d).items()}
    return Propagated(uncertain, sensitivities, u_3d, u_1d, apart, most)


def bent(sink: Sink, propagated: Propagated) -> tuple[str, ...]:
    """Sentences on the keys whose uncertainty is so large that a rise does not follow them in proportion, as the
    paper's formulas have it: where the second-order part is more than `BENT` of the first, and matters."""
    from reduced1d.ladder import solve

    said = []
    middle = solve(sink, steady_only=True).steady
    for key, u in propagated.uncertain.relative.items():
        more, less = (solve(varied(sink, key, 1 + sign * min(u, 0.9)), steady_only=True).steady for sign in (1, -1))
        for name in ("peak_rise_K", "end_rise_K"):
            first = more[name].value - less[name].value
            second = more[name].value + less[name].value - 2 * middle[name].value
            matters = abs(first) / 2 > propagated.reduced1d.get(name, 0.0) * SHARE
            if matters and abs(second) > BENT * abs(first):
                said.append(
                    f"{key} is known to {percent(u)} only: over that range the {QUANTITIES[name]} bends by "
                    f"{percent(abs(second / first))} of its change, which u_input, of first order, leaves out; "
                    "--monte-carlo N samples it"
                )
                break
    return tuple(said)


def combined(slopes: np.ndarray, covariance: np.ndarray) -> float:
    """The root of s^T C s."""
    return float(np.sqrt(max(slopes @ covariance @ slopes, 0.0)))


def _slope(sensitivities: Sensitivities, key: str, name: str, model: str) -> float | None:
    slope = sensitivities.steady.get(key, {}).get(name)
    if slope is None:
        return None
    if model != "fem3d":
        return slope.reduced1d
    return None if slope.fem3d is None else slope.fem3d.value


def _most(keys: Sequence[str], slopes: np.ndarray, covariance: np.ndarray) -> str:
    parts = slopes**2 * np.diag(covariance)
    return keys[int(parts.argmax())] if parts.any() else ""


def judged(
    checks: Sequence[Check],
    models: Models,
    uncertain: Uncertain,
    sensitivities: Sensitivities,
    definitions: Mapping[str, Callable[[Models], Comparison]] = DEFINITIONS,
) -> tuple[Check, ...]:
    """The checks with their u_input, where all that their ``definitions`` ask of the ``models`` has derivatives."""
    made = [check.id for check in checks if check.id in definitions and check.id not in (PROFILE, BALANCE)]
    sink, single, alone = models.given, models.single, sensitivities
    if single is not None:
        alone = of_sink(replace(sink, spans=1), single, None)

    def differences(key: str, step: float) -> dict[str, float]:
        in_1d = models.reduced1d and moved(models.reduced1d, sink, sensitivities, key, step)
        # What only a row has, its islands' length, is nothing to one span.
        of_one = moved(single, sink, alone, key, step) if single is not None and key in alone.keys else single
        nearby = Models(neighbour(sink, key, step), moved(models.fem3d, sink, sensitivities, key, step), in_1d, of_one)
        return {check: definitions[check](nearby).difference for check in made}

    u_inputs = _by_differences(uncertain, differences)
    u_inputs[BALANCE] = 0.0
    if all(key in sensitivities.misfit for key in uncertain.relative):
        slopes = np.array([sensitivities.misfit[key] for key in uncertain.relative])
        u_inputs[PROFILE] = combined(slopes, uncertain.covariance())
    return tuple(replace(check, u_input=u_inputs.get(check.id)) for check in checks)


def judged_against(
    checks: Sequence[Check], scene: Any, data: Data, fem3d: Result, uncertain: Uncertain,
    beside: Callable[[str, float], Result],
) -> tuple[Check, ...]:  # fmt: skip
    """Checks of data with u_input: at 3D's largest distance, from results ``beside``, with each key larger."""
    known_at = {check: furthest(scene, data, fem3d, name).rows for check, name in checked(scene, data).items()}

    def differences(key: str, step: float) -> dict[str, float]:
        try:
            nearby = neighbour(scene, key, step)
        except SceneError:
            return dict.fromkeys(checked(scene, data), np.nan)
        result = beside(key, step)
        distances = {c: distance(nearby, data, result, name, known_at[c]) for c, name in checked(scene, data).items()}
        return {c: part(off, abs(scale)) for c, (off, scale, _) in distances.items()}

    u_inputs = _by_differences(uncertain, differences)
    return tuple(replace(check, u_input=u_inputs.get(check.id)) for check in checks)


def _by_differences(uncertain: Uncertain, differences: Callable[[str, float], Mapping[str, float]]) -> dict[str, float]:
    """The u_input of numbers by name, from their values with each key larger by a step, where they have one."""
    slopes: dict[str, list[float]] = {}
    for key in uncertain.relative:
        more, less = (differences(key, sign * STEP) for sign in (1, -1))
        for name, value in more.items():
            slopes.setdefault(name, []).append((value - less[name]) / (2 * STEP))
    return _combined_finite(slopes, uncertain)


def _combined_finite(slopes: Mapping[str, Sequence[float]], uncertain: Uncertain) -> dict[str, float]:
    """The u_input of numbers by name, from their slopes by each key; of those that have all of these."""
    covariance = uncertain.covariance()
    return {
        name: combined(np.array(by_key), covariance) for name, by_key in slopes.items() if np.isfinite(by_key).all()
    }


def judged_device(
    checks: Sequence[Check], device: Device, inputs: Propagated, differences: Callable[[Device], Mapping[str, float]]
) -> tuple[Check, ...]:
    """The checks with their u_input: of 1D from the ``differences`` of devices with each key more and less by its
    uncertainty (GUM 5.1.3, note 2); in 3D, for steady powers and voltages, from their derivatives."""
    slopes: dict[str, list[float]] = {}
    for key, u in inputs.uncertain.relative.items():
        step = min(u, WIDEST)
        more, less = (differences(varied(device, key, 1 + sign * step)) for sign in (1, -1))
        for name, value in more.items():
            slopes.setdefault(name, []).append((value - less[name]) / (2 * step) if value != less[name] else 0.0)
    u_inputs = _combined_finite(slopes, inputs.uncertain)
    u_inputs |= {check: inputs.difference[name] for check, name in OF_3D.items() if name in inputs.difference}
    return tuple(replace(check, u_input=u_inputs.get(check.id)) for check in checks)


def moved(result: Result, sink: Sink, sensitivities: Sensitivities, key: str, step: float) -> Result:
    """A sink's result, to first order, with one key larger by a relative step; NaN where there is no derivative."""
    model = "fem3d" if result.model == "fem3d" else "reduced1d"
    steady = {}
    for name, e in result.steady.items():
        slope = _slope(sensitivities, key, name, model)
        steady[name] = Estimate(e.value * (1 + step * (np.nan if slope is None else slope)), e.error)
    traces = result.traces
    if traces is not None:
        by = {n: over_time(sensitivities, key, n, traces.time, model) for n in traces.values}
        changes = of_values(sink, traces.values, {key: by})[key]
        traces = replace(traces, values={n: v + step * changes[n] for n, v in traces.values.items()})
    return replace(result, steady=steady, traces=traces)


SlopesInUnits = Callable[[str, str, np.ndarray, np.ndarray], np.ndarray]
"""(times,): d quantity / d ln key in the quantity's unit, of a key and a quantity, at times (s) with its values there;
not a number where it isn't known."""


def u_input(uncertain: Uncertain, slopes: SlopesInUnits) -> Callable[[str, np.ndarray, np.ndarray], np.ndarray]:
    """What the uncertainties of the inputs make of a quantity at times (s), with its values there: (times,)."""
    covariance = uncertain.covariance()

    def u_of(name: str, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        by_key = np.array([slopes(key, name, times, values) for key in uncertain.relative])
        return np.sqrt(np.maximum(np.einsum("it,ij,jt->t", by_key, covariance, by_key), 0.0))

    return u_of


def in_units(sink: Sink, sensitivities: Sensitivities, model: str) -> SlopesInUnits:
    """Of the traces of a model of a sink."""

    def slope_of(key: str, name: str, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        by = {key: {name: over_time(sensitivities, key, name, times, model)}}
        return of_values(sink, {name: values}, by)[key][name]

    return slope_of


def over_time(sensitivities: Sensitivities, key: str, name: str, times: np.ndarray, model: str) -> np.ndarray:
    """d ln quantity / d ln key (times,) of a trace at some times (s), of rises for temperatures; not a number where it
    isn't known. Before the first time that has one it is that one."""
    course = sensitivities.course
    by_quantity: Mapping[str, Mapping[str, np.ndarray]] = {} if course is None else getattr(course, model)
    if course is None or key not in by_quantity or name not in by_quantity[key]:
        return np.full(len(times), np.nan)
    late = np.log(np.maximum(times, course.times[0]))
    return np.interp(late, np.log(course.times), by_quantity[key][name])


def of_values(
    sink: Sink, values: Mapping[str, np.ndarray], by: Mapping[str, Mapping[str, np.ndarray]]
) -> dict[str, dict[str, np.ndarray]]:
    """d trace / d ln key, by key and trace (times,), from the derivatives of the logarithms of rises and currents."""
    changes: dict[str, dict[str, np.ndarray]] = {}
    for key, slopes in by.items():
        # A temperature is the room's and a rise; where the room is the key, both move.
        room_slope = (neighbour(sink, key, STEP).room_temperature - sink.room_temperature) / STEP
        changes[key] = {
            n: (values[n] - sink.room_temperature) * s + room_slope if n.endswith("_K") else values[n] * s
            for n, s in slopes.items()
        }
    return changes


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
    deviations: np.ndarray = norm.ppf(engine.random(count)) @ root.T * scale
    return deviations.clip(-FURTHEST, FURTHEST)


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation of samples, the latter's standard error, and what linear propagation makes of it."""

    mean: float
    deviation: float
    standard_error: float
    linear: float

    @property
    def off(self) -> bool:
        """Whether the linear propagation is off by more than chance, and by enough to matter."""
        apart = abs(self.deviation - self.linear)
        return apart > max(SURELY * self.standard_error, MATTERS * self.linear, ROUNDING * abs(self.mean))

    @property
    def excess(self) -> float:
        """By which part of itself the linear propagation is off."""
        return self.deviation / self.linear - 1 if self.linear else float("inf")


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
            f"{name} {where} ({percent(spread.excess, sign=True)})"
            for where, by_name in models.items() for name, spread in by_name.items() if spread.off
        ]  # fmt: skip
        return (
            (f"{self.count} samples spread otherwise than linear propagation has it: {', '.join(off)}",) if off else ()
        )


def spreads(
    columns: Mapping[str, np.ndarray], propagated: Propagated, checks: Mapping[str, float], failed: int
) -> Sampled:
    """What samples (columns of points.csv, without those that failed) say; ``checks`` are the linear u_input."""

    def spread_of(column: str, linear: float) -> Spread:
        values = np.asarray(columns[column], float)
        deviation = float(values.std(ddof=1))
        return Spread(float(values.mean()), deviation, deviation / np.sqrt(2 * (len(values) - 1)), linear)

    count = len(next(iter(columns.values()), ()))
    models = {}
    for model, uncertainties in (("fem3d", propagated.fem3d), ("reduced1d", propagated.reduced1d)):
        models[model] = {n: spread_of(f"{model}_{n}", u) for n, u in uncertainties.items() if f"{model}_{n}" in columns}
    differences = {n: spread_of(f"{n}_difference", u) for n, u in checks.items() if f"{n}_difference" in columns}
    return Sampled(count + failed, failed, models["fem3d"], models["reduced1d"], differences)
