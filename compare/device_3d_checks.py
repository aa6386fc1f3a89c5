"""The device in 1D against 3D, and the paper's central claim: predicted is 1D or the claim, measured is 3D."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compare.device_checks import not_reached
from compare.made import made_3d_checks
from compare.options import Options
from compare.verdict import Check, Comparison, judged, relative
from fem3d.device.runs import Solved
from reduced1d.device.closed_loop import shielding, stability
from reduced1d.device.lumped import lump
from reduced1d.sink import air_conductance
from scenes.device import Device
from scenes.formats import milliseconds, percent, quantity
from statespace.result import BAND, Run, Runs

_OVER_TIME = ("_peak", "_time", "_settling")  # How the names of checks end that need a run over time.
NAMES = {"sink": "the sink", "sensor": "the sensor"}


@dataclass(frozen=True)
class Both:
    one: Runs
    three: Solved

    @property
    def device(self) -> Device:
        return self.one.base.device

    @property
    def base(self) -> Run:
        return self.three.runs.base


def evaluate_3d(device: Device, options: Options, in_1d: Runs, in_3d: Solved) -> tuple[Check, ...]:
    """Make the checks that the run allows, in their order."""
    both, checks = Both(in_1d, in_3d), []
    for name in made_3d_checks(device, options):
        over_time = device.steps_outside and name.endswith(_OVER_TIME)
        reached = not_reached((in_1d.base, both.base)) if over_time else None
        checks.append(judged(name, reached or DEFINITIONS[name](both), device, always=True))
    return tuple(checks)


def _steady(both: Both, quantity_: str, title: str, unit: str) -> Comparison:
    in_1d, in_3d = (getattr(run.after, quantity_) for run in (both.one.base, both.base))
    error = both.three.model.steady_errors(both.device)[quantity_]
    before = [getattr(run.before, quantity_) for run in (both.one.base, both.base)]
    said = (
        f"steady: {quantity(in_3d, unit, 5)} after the outer step and {quantity(before[1], unit, 5)} before it, in 1D "
        f"{quantity(in_1d, unit, 5)} and {quantity(before[0], unit, 5)}; {_why_steady(both, quantity_)}"
    )
    return _alike(title, unit, in_1d, in_3d, error, said)


def _why_steady(both: Both, quantity_: str) -> str:
    if both.device.control.ground_resistance:
        state = both.base.after
        apart = quantity(state.sink_K - state.sensor_K, "K", 3)
        return f"through the common ground sink and sensor are seen too warm and come to {apart} apart"
    if quantity_.startswith("sensor"):
        return "sink and sensor have one mean temperature, so that what the sensor takes leaves through the polymer"
    said = (
        "heat goes along the layers too, mostly in the gold, and leaves at the beam's ends, where the film of one "
        "temperature of 1D has no ends; and eq 14 leaves out the constriction in pad and oxide"
    )
    loss = air_conductance(both.device.sink) * both.device.set_rise
    if loss:
        said += (
            f"; 1D loses {quantity(loss, 'W', 3)} to the air from the beam's top as in eq 20, which the layers cover "
            "in 3D, where the air cools the tops of the pads"
        )
    return said


def _peak(both: Both, film: str) -> Comparison:
    in_1d, in_3d = (_highest(run, film)[0] for run in (both.one.base, both.base))
    error = both.base.result.errors[f"{film}_K"]
    said = (
        f"{NAMES[film]} overshoots to {in_3d:.2f} K above room in 3D and to {in_1d:.2f} K in 1D; the controllers push "
        "until they see the set temperature, and where heat spreads in the structure decides how late that is"
    )
    return _alike(f"peak, {film}", "K", in_1d, in_3d, error, said)


def _peak_time(both: Both, film: str) -> Comparison:
    (_, in_1d), (value, in_3d) = (_highest(run, film) for run in (both.one.base, both.base))
    result = both.base.result
    near = result.time_s[result.trace(f"{film}_K") - both.device.sink.room_temperature > value - 2 * result.errors[
        f"{film}_K"]]  # fmt: skip
    error = float(np.abs(near - in_3d).max(initial=0.0))
    said = f"{NAMES[film]} is hottest {milliseconds(in_3d)} from cold in 3D and after {milliseconds(in_1d)} in 1D"
    return _alike(f"when, {film}", "s", in_1d, in_3d, error, said)


def _highest(run: Run, film: str) -> tuple[float, float]:
    """The highest rise (K) before the outer step, and when (s)."""
    result, device = run.result, run.device
    early = result.time_s <= device.external.step_time if device.steps_outside else np.ones(len(result.time_s), bool)
    rises = result.trace(f"{film}_K")[early] - device.sink.room_temperature
    at = int(np.argmax(rises))
    return float(rises[at]), float(result.time_s[at])


def _settling(both: Both) -> Comparison:
    (in_1d, error_1d), (in_3d, error_3d) = both.one.base.settled(), both.base.settled()
    if math.inf in (in_1d, in_3d):
        said = (
            f"the sensor's power does not settle to {percent(BAND, 1)} of its step in both models before the run ends"
        )
        open_ = 0.0 if in_1d == in_3d else math.inf
        return Comparison("settling time", in_1d, in_3d, "s", open_, math.inf, said)
    said = (
        f"the sensor's power settles to {percent(BAND, 1)} of its step in {milliseconds(in_3d)} in 3D, in "
        f"{milliseconds(in_1d)} in 1D: diffusion through the polymer decides it in both"
    )
    return _alike("settling time", "s", in_1d, in_3d, error_1d + error_3d, said)


def _slope(both: Both) -> Comparison:
    """The slope of Figure 13, of the steady powers in 3D, against k A/t of the polymer."""
    tried = [run.device for run in both.one.steps]
    devices = [d for d in tried if d.external.final_temperature < d.control.set_temperature]
    outer = np.array([d.external.final_temperature for d in devices])
    model = both.three.model
    power = np.array([model.steady(d).sensor_power_W for d in devices])
    errors = [model.steady_errors(d)["sensor_power_W"] for d in devices]
    slope, level = np.polyfit(outer, power, 1)
    bend = float(np.abs(power - level - slope * outer).max())
    in_1d = -lump(both.device).polymer.conductance
    said = (
        f"the steady power falls by {quantity(abs(slope), 'W/K', 7)} in 3D, k A/t of the polymer is "
        f"{quantity(abs(in_1d), 'W/K', 7)}; it bends by at most {quantity(bend, 'W', 2)}: linear because conduction is"
    )
    u_num = 2 * sum(errors) / float(np.ptp(power))
    return Comparison("slope of power", in_1d, float(slope), "W/K", relative(in_1d, float(slope)), u_num, said)


def _gain(both: Both, film: str) -> Comparison:
    device, external = both.device, both.device.external
    outer = (external.initial_temperature, external.final_temperature)
    key = f"{film}_gain_limit"
    model = both.three.model
    in_1d = min(getattr(stability(device, t), key) for t in outer)
    in_3d, coarser = (min(getattr(m.stability(device, t), key) for t in outer) for m in (model, model.coarser))
    error = abs(in_3d - coarser) if math.isfinite(in_3d) else 0.0
    said = (
        f"{NAMES[film]} is stable up to a gain of {quantity(in_3d, 'V', 3)} in 3D, {quantity(in_1d, 'V', 3)} in 1D, "
        "with the other gain as it is: what is seen a sample after the voltage rose is heat next to the film, alike in "
        "both"
    )
    return _alike(f"gain, {film}", "V", in_1d, in_3d, error, said)


def _claim_steady(both: Both) -> Comparison:
    errors = both.three.model.steady_errors(both.device)
    power, flow = both.base.after.sensor_power_W, both.base.after.polymer_flux_W
    size = max(abs(power), abs(flow)) or 1.0
    said = (
        f"paper: the sensor's power is the heat through the polymer; steady in 3D the sensor takes "
        f"{quantity(power, 'W', 7)}, and {quantity(flow, 'W', 7)} leave through the polymer's top: "
        f"{quantity(abs(power - flow), 'W', 2)} pass between sink and sensor, {_why_between(both)}"
    )
    u_num = (errors["sensor_power_W"] + errors["polymer_flux_W"]) / size
    return Comparison("claim, steady", power, flow, "W", (power - flow) / size, u_num, said)


def _why_between(both: Both) -> str:
    device, state = both.device, both.base.after
    if abs(state.sink_K - state.sensor_K) < 1e-9 * device.set_rise:
        return "whose mean temperatures are one while their temperatures along the beam are not"
    why = "as the common ground shifts both" if device.control.ground_resistance else "as one of them isn't held"
    return f"whose mean temperatures are {state.sink_K - state.sensor_K:.3g} K apart, {why}"


def _claim_over_time(both: Both) -> Comparison:
    """The same over time, from the outer step on, relative to the step of the steady power."""
    run = both.base
    result, errors = run.result, run.result.errors
    assert result.polymer_top_W is not None
    after = result.time_s > run.device.external.step_time + 1e-9 * run.device.control.sample_time
    off = (result.sensor_power_W - result.polymer_top_W)[after]
    size = abs(run.after.sensor_power_W - run.before.sensor_power_W) or abs(run.after.sensor_power_W) or 1.0
    at = int(np.abs(off).argmax())
    moment = float(result.time_s[after][at])
    late = np.abs(off) > BAND * size
    since = float(result.time_s[after][late][-1]) - run.device.external.step_time if late.any() else 0.0
    inside = float(np.abs(result.sensor_power_W - result.polymer_flux_W)[after].max())
    said = (
        f"paper: the sensor's power is the heat through the polymer; over time that is so where the heat enters it (to "
        f"{quantity(inside, 'W', 2)}), and at its top only once the polymer has stored what it can: most off "
        f"{milliseconds(moment - run.device.external.step_time)} after the step, within {percent(BAND, 1)} of it after "
        f"{milliseconds(since)}"
    )
    return Comparison(
        "claim, over time", float(result.sensor_power_W[after][at]), float(result.polymer_top_W[after][at]), "W",
        float(off[at]) / size, (errors["sensor_power_W"] + errors["polymer_top_W"]) / size, said, time=moment,
        relative_to="the step of the steady power",
    )  # fmt: skip


def _shielding(both: Both) -> Comparison:
    slopes, errors = both.three.shielding
    in_1d, over_time = shielding(both.device), both.three.response
    names = ("sensor_power_per_substrate_W_per_K", "sensor_power_per_substrate_sink_off_W_per_K")
    (closed, off), error = (getattr(slopes, name) for name in names), errors[names[0]]
    size = abs(off) or abs(slopes.sensor_power_per_outside_W_per_K) or 1.0
    largest, when = over_time.largest
    said = (
        "paper: the sensor loses nothing to the substrate; in 3D a substrate 1 K warmer changes the sensor's power "
        f"by {quantity(closed, 'W', 2)} to within {quantity(error, 'W', 1)}, with the sink off by "
        f"{quantity(off, 'W', 4)}; 1 K outside by {quantity(slopes.sensor_power_per_outside_W_per_K, 'W', 6)}; the "
        f"sink's by {quantity(slopes.sink_power_per_substrate_W_per_K, 'W', 4)}, in 1D by "
        f"{quantity(in_1d.sink_power_per_substrate_W_per_K, 'W', 4)}. Over time the loops take a while: the sensor's "
        f"power is off by up to {quantity(largest, 'W', 3)}, {milliseconds(when)} after the substrate's step"
    )
    return Comparison(
        "shielding", 0.0, closed, "W/K", -closed / size, error / size, said, relative_to="what it is with the sink off"
    )


DEFINITIONS: dict[str, Callable[[Both], Comparison]] = {
    "dev3d_sink_power": lambda both: _steady(both, "sink_power_W", "steady power, sink", "W"),
    "dev3d_sensor_power": lambda both: _steady(both, "sensor_power_W", "steady power, sensor", "W"),
    "dev3d_sink_voltage": lambda both: _steady(both, "sink_V", "steady voltage, sink", "V"),
    "dev3d_sensor_voltage": lambda both: _steady(both, "sensor_V", "steady voltage, sensor", "V"),
    "dev3d_sink_peak": lambda both: _peak(both, "sink"),
    "dev3d_sensor_peak": lambda both: _peak(both, "sensor"),
    "dev3d_sink_peak_time": lambda both: _peak_time(both, "sink"),
    "dev3d_sensor_peak_time": lambda both: _peak_time(both, "sensor"),
    "dev3d_settling": _settling,
    "dev3d_slope": _slope,
    "dev3d_sink_gain": lambda both: _gain(both, "sink"),
    "dev3d_sensor_gain": lambda both: _gain(both, "sensor"),
    "dev3d_claim_steady": _claim_steady,
    "dev3d_claim_over_time": _claim_over_time,
    "dev3d_shielding": _shielding,
}


def _alike(title: str, unit: str, in_1d: float, in_3d: float, error: float, said: str) -> Comparison:
    part = error / abs(in_3d) if in_3d else math.inf if error else 0.0
    return Comparison(title, in_1d, in_3d, unit, relative(in_1d, in_3d), part, said)
