"""Laws that every scene keeps, whatever its shape; each function returns the violation over the error bounds, at most 1
where the law holds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from benchmarks.random_scenes import AT_PLUS, ROOM, of_materials, scaled
from fem3d.runs.compact import compact, comparison_rows
from fem3d.runs.scene import solve
from scenes.errors import NumericsError, SceneError
from scenes.model import Probe, Scene
from scenes.result import Result
from statespace.channels import channels, driven
from statespace.runtime import CompactModel

KINDS = {"into plus": "current", "into minus": "current", AT_PLUS: "potential"}  # of readings that are no heat flow
Test = Callable[[Scene, Result], float]

ROUNDING = 1e-7  # of the largest value of a kind: rounding errors of badly conditioned scenes
BALANCE = 1e-6  # of all heat that passes: the largest heat that may be missing
SAME = 1e-6  # of the end time: rows closer than this are before and after a jump
MODEL = 3e-2  # accuracy of a compact model
OVER_TIME = 10.0  # times the accuracy: imbalance of a transient, which the solver doesn't control


def energy(scene: Scene, result: Result) -> float:
    """The heat of the boundaries, the current and the sources adds up to nothing; over time the run measures that.

    All current leaves at "minus": an electrode inside has no probe.
    """
    if result.traces is not None:
        return float(result.details["energy_imbalance"]) / (OVER_TIME * scene.accuracy)
    error = 0.0
    volts = {b.name: float(b.value) for b in scene.boundaries if b.kind == "voltage"}  # type: ignore[arg-type]
    if AT_PLUS in result.steady:
        volts["plus"] = result.steady[AT_PLUS].value
        error += abs(result.steady[AT_PLUS].error * result.steady["into minus"].value)
    heats = [
        float(box.heat_source) * float(np.prod(np.subtract(box.upper, box.lower)))  # type: ignore[arg-type]
        for box in scene.boxes
    ]
    for b in scene.boundaries:
        if b.name != "plus":
            factor = volts["minus"] - volts["plus"] if b.kind == "voltage" else 1.0
            heats.append(factor * result.steady[f"into {b.name}"].value)
            error += abs(factor) * result.steady[f"into {b.name}"].error
    return abs(sum(heats)) / (error + BALANCE * sum(map(abs, heats)))


def never_colder(_: Scene, result: Result) -> float:
    """No reported temperature is below the surroundings while the scene is heated."""
    means = [mean for name, mean in result.steady.items() if name.startswith("mean")]
    return max(max(ROOM - mean.value, 0.0) / (mean.error + 1e-12 * ROOM) for mean in means)


def undershoot(_: Scene, result: Result) -> float:
    """The field falls below the surroundings by no more than its own error bound: polynomials swing beside a steep
    decay."""
    field, off = result.details["fields"].steady, result.details.get("field_error", np.inf)
    return float(max(ROOM - field.min(), 0.0) / (off * np.ptp(field) + 1e-12 * ROOM))


def ordered(_: Scene, result: Result) -> float:
    """Means lie between the coldest and the hottest place."""
    field = result.details["fields"].steady
    return max(
        float(max(field.min() - mean.value, mean.value - field.max(), 0.0) / (mean.error + 1e-12 * ROOM))
        for name, mean in result.steady.items()
        if name.startswith("mean")
    )


def mirrored(scene: Scene, result: Result) -> float:
    """Mirrored in x, and with the axes turned round, the scene has the same temperatures and flows."""
    far = max(box.upper[0] for box in scene.boxes)

    def turned(item: Any) -> Any:
        (x, *low), (far_x, *high) = item.lower, item.upper
        return replace(item, lower=(*low, far - far_x), upper=(*high, far - x))

    items: dict[str, Any] = {key: tuple(map(turned, getattr(scene, key))) for key in ("boxes", "boundaries", "probes")}
    other = replace(scene, **items)
    return _largest(_distances(result, solve(other), times=scene.output_times))


def swapped(scene: Scene, result: Result) -> float:
    """With the voltages swapped the currents change their sign, and nothing else does."""
    volts = {c.name: c.value for c in channels(scene) if c.kind == "voltage"}
    if not volts:
        return 0.0
    turned = solve(driven(scene, dict(zip(volts, reversed(volts.values()), strict=True))))
    return _largest(_distances(result, turned, {"current": -1.0, "potential": -1.0}))


def squared(scene: Scene, _: Result) -> float:
    """Without temperature coefficients twice the voltage and four times the other heat make four times the rises."""
    linear = of_materials(scene, lambda m: replace(m, temperature_coefficient=0.0))
    stronger = scaled(linear, heat_source=4.0, heat_flux=4.0, voltage=2.0)
    factors = {"rise": 4.0, "flow": 4.0, "current": 2.0, "potential": 2.0}
    return _largest(_distances(solve(linear), solve(stronger), factors))


def reciprocal(scene: Scene, _: Result) -> float:
    """A watt in one box warms another as much as a watt there warms the first."""
    first, last = scene.boxes[0], scene.boxes[-1]
    cooled = tuple(b for b in scene.boundaries if b.kind in ("temperature", "convection"))
    rises = []
    for source, seen in ((first, last), (last, first)):
        watt = 1e-3 / float(np.prod(np.subtract(source.upper, source.lower)))
        heated = tuple(replace(b, heat_source=watt * (b is source)) for b in scene.boxes)
        probes = (Probe("seen", seen.lower, seen.upper),)
        rises.append(solve(replace(scene, boxes=heated, boundaries=cooled, probes=probes)).steady["seen"])
    one, two = rises
    return abs(one.value - two.value) / (one.error + two.error + ROUNDING * abs(one.value - ROOM) + 1e-12 * ROOM)


def reduced(scene: Scene, result: Result) -> float:
    """The scene's compact model is within its error bounds; some scenes have none of its accuracy."""
    try:
        document = compact(replace(scene, accuracy=MODEL), None, MODEL)
    except (NumericsError, SceneError):
        return 0.0
    model, (bounds, *_) = CompactModel(document), document["error"].values()
    times, kind = np.empty(0), "steady"
    if not scene.steady:
        times, kind = result.over_time.time[comparison_rows(result.over_time)], "over time"
    found = model.steady() if scene.steady else model.simulate(times)
    return max(
        float(np.abs(found[name] - values).max()) / (bounds[kind][name]["error"] + error)
        for name, (values, error) in _numbers(result, times).items()
    )


def compared(scene: Scene, result: Result, times: float) -> tuple[float, float]:
    """Return the violation of the error bounds by a solution that is so many times finer, and the smallest error bound
    over true error of a reading; infinite where all are off by rounding alone."""
    finer = solve(replace(scene, accuracy=scene.accuracy / times))
    times_s = (*scene.output_times, *_between_rows(result))
    distances = _distances(result, finer, times=times_s)
    apart, stated, other, rounding = distances
    off = (apart > rounding) & (other < stated)
    return _largest(distances), float((stated[off] / apart[off]).min(initial=np.inf))


def _between_rows(result: Result) -> tuple[float, ...]:
    """The times (s) half way between the rows of traces, where straight lines are off most, but for soon after a jump
    of whatever drives the scene: there only rows are compared."""
    if result.traces is None:
        return ()
    time, since = result.traces.time, result.traces.since
    middles = (time[1:] + time[:-1]) / 2
    jumps = np.append(0.0, time[:-1][np.diff(time) <= SAME * time[-1]])
    before = jumps[np.searchsorted(jumps, middles, side="right") - 1]
    return tuple(middles[middles >= before + since].tolist())


NEVER_COLDER: dict[str, Test] = {"nothing reported is colder than its surroundings": never_colder}
ALWAYS: dict[str, Test] = {
    "energy closes": energy, **NEVER_COLDER, "means within extremes": ordered, "field away from the probes": undershoot,
}  # fmt: skip
OVER_TIME_ALWAYS: dict[str, Test] = {"energy closes over time": energy}
OVER_TIME_IN_TURN: dict[str, Test] = {"mirrored and turned": mirrored, "compact model": reduced}
IN_TURN: dict[str, Test] = {
    **OVER_TIME_IN_TURN, "voltages swapped": swapped, "scales with V^2": squared,
    "reciprocity of power": reciprocal,
}  # fmt: skip


def _largest(distances: np.ndarray) -> float:
    apart, *allowed = distances
    return float((apart / (np.sum(allowed, axis=0) + 1e-300)).max())


def _distances(
    one: Result, two: Result, factors: Mapping[str, float] = MappingProxyType({}), times: Sequence[float] = ()
) -> np.ndarray:
    """(4, numbers): the differences of two results, the error bounds of both, and the differences that rounding makes.

    The numbers of the first result are multiplied by a factor for their kind; traces are compared at times.
    """
    mine, theirs = _numbers(one, times), _numbers(two, times)
    kinds = {name: "rise" if name.startswith("mean") else KINDS.get(name, "flow") for name in mine}
    distances = []
    for name, kind in kinds.items():
        (a, error), (b, other), factor = mine[name], theirs[name], factors.get(kind, 1.0)
        off = ROOM * (kind == "rise")
        largest = max(np.abs(theirs[n][0] - off).max() for n in kinds if kinds[n] == kind)
        apart, rounding = np.abs(factor * (a - off) - (b - off)).max(), ROUNDING * largest + 1e-12 * off
        distances.append((apart, abs(factor) * error, other, rounding))
    return np.array(distances).T


def _numbers(result: Result, times: Sequence[float] | np.ndarray) -> dict[str, tuple[np.ndarray, float]]:
    """Return the steady values, or the traces at some times, with their error bounds."""
    if result.traces is None:
        return {name: (np.array(e.value), e.error) for name, e in result.steady.items()}
    at, traces = result.traces.time, result.traces
    return {name: (np.interp(times, at, v), traces.errors[name]) for name, v in traces.values.items()}
