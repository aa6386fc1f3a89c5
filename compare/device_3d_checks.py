"""The device in 1D against 3D, and the paper's central claim: predicted is 1D or the claim, measured is 3D."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from compare.device_checks import CHECKS, Both, after_step
from compare.verdict import Comparison, relative
from reduced1d.device.lumped import lump, stability
from scenes.formats import milliseconds, percent, quantity
from statespace.result import BAND, Run


def _bases(both: Both) -> tuple[Run, Run]:
    return both.one.base, both.in_3d.runs.base


def _one(both: Both) -> Run | None:
    return both.one.base if both.device.steps_outside else None


def _three(both: Both) -> Run | None:
    return both.in_3d.runs.base if both.device.steps_outside else None


def _alike(title: str, unit: str, in_1d: float, in_3d: float, error: float, said: str = "") -> Comparison:
    """Compare a value of 1D with 3D."""
    part = error / abs(in_3d) if in_3d else math.inf if error else 0.0
    values = f"{quantity(in_3d, unit, 5)} in 3D, {quantity(in_1d, unit, 5)} in 1D"
    return Comparison(title, in_1d, in_3d, unit, relative(in_1d, in_3d), part, f"{values}{said and f': {said}'}")


def _steady(name: str, title: str, unit: str, both: Both) -> Comparison:
    one, three = (getattr(run.after, name) for run in _bases(both))
    why = "the sensor's power leaves through the polymer in both"
    if name.startswith("sink"):
        why = "heat goes along the layers too, and eq 14 leaves out the constriction in pad and oxide"
        why += ", and the air that cools the covered beam" * bool(both.device.sink.convection_coefficient)
    if both.device.control.ground_resistance:
        why = "over the common ground both films read too warm"
    return _alike(title, unit, one, three, both.in_3d.model.steady_errors(both.device)[name], why)


def _highest(run: Run, film: str) -> tuple[float, float]:
    """The highest rise (K) before the outer step, and when (s)."""
    result, device = run.result, run.device
    early = result.time_s <= device.external.step_time if device.steps_outside else np.ones(len(result.time_s), bool)
    rises = result.trace(f"{film}_K")[early] - device.sink.room_temperature
    at = int(np.argmax(rises))
    return float(rises[at]), float(result.time_s[at])


def _peak(film: str, both: Both) -> Comparison:
    one, three = _bases(both)
    why = "the controllers push until they read the set temperature"
    highest = _highest(one, film)[0], _highest(three, film)[0]
    return _alike(f"peak, {film}", "K", *highest, three.result.errors[f"{film}_K"], why)


def _peak_time(film: str, both: Both) -> Comparison:
    one, three = _bases(both)
    (_, in_1d), (value, in_3d), result = _highest(one, film), _highest(three, film), three.result
    rises = result.trace(f"{film}_K") - both.device.sink.room_temperature
    near = result.time_s[rises > value - 2 * result.errors[f"{film}_K"]]
    return _alike(f"when, {film}", "s", in_1d, in_3d, float(np.abs(near - in_3d).max(initial=0.0)))


def _settling(both: Both) -> Comparison:
    (in_1d, error_1d), (in_3d, error_3d) = (run.settled() for run in _bases(both))
    if math.inf in (in_1d, in_3d):
        said = f"the sensor's power does not settle to {percent(BAND, 1)} in both models before the run ends"
        return Comparison("settling time", in_1d, in_3d, "s", 0.0 if in_1d == in_3d else math.inf, math.inf, said)
    said = f"to {percent(BAND, 1)} of the step of the sensor's power, by diffusion through the polymer"
    return _alike("settling time", "s", in_1d, in_3d, error_1d + error_3d, said)


def _slope(both: Both) -> Comparison:
    """The slope of Figure 13, of the steady powers in 3D, against k A/t of the polymer."""
    tried, model = [run.device for run in both.one.steps], both.in_3d.model
    devices = [d for d in tried if d.external.final_temperature < d.control.set_temperature]
    outer = [d.external.final_temperature for d in devices]
    power = np.array([model.steady(d).sensor_power_W for d in devices])
    error = 2 * sum(model.steady_errors(d)["sensor_power_W"] for d in devices) / float(np.ptp(power))
    slope = float(np.polyfit(outer, power, 1)[0])
    return _alike("slope of power", "W/K", -lump(both.device).polymer.conductance, slope, error * abs(slope))


def _gain(film: str, both: Both) -> Comparison:
    device, external, model, key = both.device, both.device.external, both.in_3d.model, f"{film}_gain_limit"
    limits: list[Callable[..., object]] = [stability, model.stability, model.coarser.stability]
    outer = external.initial_temperature, external.final_temperature
    in_1d, in_3d, coarser = (min(float(getattr(limit(device, t), key)) for t in outer) for limit in limits)
    error = abs(in_3d - coarser) if math.isfinite(in_3d) else 0.0
    return _alike(f"gain, {film}", "V", in_1d, in_3d, error, "largest stable gain, with the other gain as it is")


def _claim_steady(both: Both) -> Comparison:
    state, errors = both.in_3d.runs.base.after, both.in_3d.model.steady_errors(both.device)
    power, flow = state.sensor_power_W, state.polymer_flux_W
    size, between = max(abs(power), abs(flow)) or 1.0, quantity(abs(power - flow), "W", 2)
    said = f"paper: the sensor's power is the heat through the polymer; {between} pass between sink and sensor in 3D"
    u_num = (errors["sensor_power_W"] + errors["polymer_flux_W"]) / size
    return Comparison("claim, steady", power, flow, "W", (power - flow) / size, u_num, said)


def _claim_over_time(both: Both) -> Comparison:
    """The same over time, from the outer step on, relative to the step of the steady power."""
    run = both.in_3d.runs.base
    result, errors, start = run.result, run.result.errors, run.device.external.step_time
    assert result.polymer_top_W is not None
    after = result.time_s > start + 1e-9 * run.device.control.sample_time
    time, off = result.time_s[after], (result.sensor_power_W - result.polymer_top_W)[after]
    size = abs(run.after.sensor_power_W - run.before.sensor_power_W) or abs(run.after.sensor_power_W) or 1.0
    at, late = int(np.abs(off).argmax()), np.flatnonzero(np.abs(off) > BAND * size)
    since = milliseconds(float(time[late[-1]]) - start if len(late) else 0.0)
    said = (
        f"paper: the sensor's power is the heat through the polymer; at its top only once the polymer has stored its "
        f"heat, within {percent(BAND, 1)} of the step after {since}"
    )
    power, top = (float(values[after][at]) for values in (result.sensor_power_W, result.polymer_top_W))
    return Comparison(
        "claim, over time", power, top, "W", float(off[at]) / size,
        (errors["sensor_power_W"] + errors["polymer_top_W"]) / size, said, time=float(time[at]),
        relative_to="the step of the steady power",
    )  # fmt: skip


def _shielding(both: Both) -> Comparison:
    slopes, errors = both.in_3d.shielding
    name, off_name = "sensor_power_per_substrate_W_per_K", "sensor_power_per_substrate_sink_off_W_per_K"
    closed, off, error = getattr(slopes, name), getattr(slopes, off_name), errors[name]
    size = abs(off) or abs(slopes.sensor_power_per_outside_W_per_K) or 1.0
    largest, when = both.in_3d.response.largest
    said = (
        f"paper: the sensor loses nothing to the substrate; 1 K there changes its power by {quantity(closed, 'W', 2)}, "
        f"with the sink off by {quantity(off, 'W', 4)}; over time by up to {quantity(largest, 'W', 3)}, "
        f"{milliseconds(when)} after a step"
    )
    return Comparison(
        "shielding", 0.0, closed, "W/K", -closed / size, error / size, said, relative_to="what it is with the sink off"
    )


for _name, _key, _unit in (
    ("sink_power", "sink_power_W", "W"), ("sensor_power", "sensor_power_W", "W"), ("sink_voltage", "sink_V", "V"),
    ("sensor_voltage", "sensor_V", "V"),
):  # fmt: skip
    _film, _word = _name.split("_")
    CHECKS.check(f"dev3d_{_name}", "3D", "figure9")(partial(_steady, _key, f"steady {_word}, {_film}", _unit))
for _make, _suffix in ((_peak, "peak"), (_peak_time, "peak_time")):
    for _film in ("sink", "sensor"):
        CHECKS.check(f"dev3d_{_film}_{_suffix}", "3D", "figure9")(after_step(_one, _three)(partial(_make, _film)))
CHECKS.check("dev3d_settling", "3D", "figure9", "outer step")(after_step(_one, _three)(_settling))
CHECKS.check("dev3d_slope", "3D", "figure13")(_slope)
for _film in ("sink", "sensor"):
    CHECKS.check(f"dev3d_{_film}_gain", "3D", "all figures")(partial(_gain, _film))
CHECKS.check("dev3d_claim_steady", "3D", "figure9", "outer step")(_claim_steady)
CHECKS.check("dev3d_claim_over_time", "3D", "figure9", "outer step")(after_step(_one, _three)(_claim_over_time))
CHECKS.check("dev3d_shielding", "3D", "figure9")(_shielding)
