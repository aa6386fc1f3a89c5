"""Checks of the device: the paper's claims on Figures 9 to 13 and on meters, and 1D and the claims against 3D.

In a check of a figure or a meter, predicted is the paper and measured is 1D. In a check ``dev3d_*``, predicted is 1D,
or the paper's claim, and measured is 3D.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from compare.outcome import Outcome
from compare.verdict import Check, Definition, Sense, compared, part
from reduced1d.device.design import PXI_4070, delivered
from reduced1d.device.lumped import at_sample_time, largest_eigenvalue, lump, stability
from reduced1d.device.schemes import shown
from scenes.device import Device
from scenes.errors import SceneError
from scenes.formats import kelvin, milliseconds, percent, quantity
from scenes.result import Estimate
from statespace.result import BAND, SLOW_TIME, Run, Runs

PAPER_SETTLING = 0.1
"""The settling time (s) that the paper gives, "about 0.1 s"."""
METER_RESISTANCE, METER_POWER, METER_RATE = 60e-6, 23e-9, 5.0
"""The paper on meters (section 5): an NI 4070 reads the gold's resistance to some 60 uohm and its power to 23 nW, at 5
readings a second, "which is more than sufficient"."""
CLAIM = "paper: the sensor's power is the heat through the polymer"
in_1d = partial(compared, relative_to="the 1D value")

Interval = tuple[float, float]
"""The least and the largest value that a time (s) may have."""


def settling_time(run: Run) -> Interval:
    """Return bounds of the settling time of a run; a time that does not come is beyond the end of the run."""
    time, error = run.settled()
    return (max(time - error, 0.0), time + error) if time < math.inf else (run.watched, math.inf)


def compare_times(title: str, claim: Interval, found: Interval, note: str, sense: Sense = "equal") -> Check:
    """Compare two times by the interval of their ratio; a time that never comes is longer than all others."""
    low, high = (
        math.inf if a == math.inf else part(a, b) - bool(a or b) for a, b in zip(claim, found[::-1], strict=True)
    )
    if found[0] < claim[0] == found[1] == math.inf:  # neither settles in its run
        low = -1.0
    if sense == "at least":
        low, high = max(low, 0.0), max(high, 0.0)
    off = (low, 0.0) if low == high else ((low + high) / 2, (high - low) / 2)
    return Check(title, sum(claim) / 2, sum(found) / 2, "s", *off, note, sense=sense)


def settling(outcome: Outcome[Device]) -> Check:
    """Compare the settling time with the paper's, which names no band; here it is 1 %."""
    run = outcome.runs.base
    bands = ", ".join(f"{percent(band, 1)} in {milliseconds(run.settled(band)[0])}" for band in (BAND, 1e-3, 1e-4))
    note = f"paper: about {PAPER_SETTLING:g} s, no band given; here after the step to {bands}{rest(run)}"
    return compare_times("settling time", (PAPER_SETTLING, PAPER_SETTLING), settling_time(run), note)


def balance(outcome: Outcome[Device]) -> Check:
    """Compare the sensor's steady power with the heat into the polymer."""
    power, flow = (Estimate(*outcome.runs.base.final(name)) for name in ("sensor_power_W", "polymer_flux_W"))
    return in_1d("heat to polymer", "W", power, flow, CLAIM + rest(outcome.runs.base))


def steady_flow(outcome: Outcome[Device]) -> Check:
    """Compare the steady heat flow into the polymer with k A/t times the temperature difference across it."""
    across = outcome.scene.control.set_temperature - outcome.scene.external.final_temperature
    heat, flow = lump(outcome.scene).polymer.conductance * across, Estimate(*outcome.runs.base.final("polymer_flux_W"))
    note = f"paper: the flow follows the sensor's power; k A/t at {kelvin(across)}{rest(outcome.runs.base)}"
    return in_1d("steady heat flow", "W", Estimate(heat, 0.0), flow, note)


def slow(outcome: Outcome[Device]) -> Check:
    """Compare the settling time of the loop sampled every 5 ms with the scene's own, which the paper calls shorter."""
    base, slowly = outcome.runs.base, outcome.runs.slow
    assert slowly is not None
    times = [milliseconds(run.settled()[0]) for run in (slowly, base)]
    note = f"paper: not ideal; here {times[0]} when sampled every {SLOW_TIME * 1e3:g} ms, {times[1]} in the scene"
    return compare_times("slower at 5 ms", settling_time(base), settling_time(slowly), note, "at least")


def same_time(outcome: Outcome[Device]) -> Check | None:
    """Compare the times to the steady state after outer steps from -80 to +20 K; None where none moves the power."""
    moving = [run for run in outcome.runs.steps if run.step]
    times = {run.step: run.settled()[0] for run in moving}
    typical = float(np.median([times[run.step] for run in below(outcome.runs) if run.step]))
    if not typical:
        return None
    worst = max(moving, key=lambda run: (times[run.step] == math.inf, abs(times[run.step] - typical)))
    note = f"paper: the same for all; here {milliseconds(typical)} in the middle of steps that stay below the set point"
    note += f", {milliseconds(times[worst.step])} for {worst.step:+g} K{rest(worst)}"
    return compare_times("same, all steps", (typical, typical), settling_time(worst), note)


def slope(in_3d: bool, outcome: Outcome[Device]) -> Check:
    """Compare the slope of the steady power by the outer temperature, in 1D or 3D, with -k A/t of the polymer."""
    runs, claim = below(outcome.runs), Estimate(-lump(outcome.scene).polymer.conductance, 0.0)
    if not in_3d:
        note = f"paper: a straight line, by R(T); here linear as conduction is{rest(*runs)}"
        return in_1d("slope of power", "W/K", claim, line(outcome.runs)[0], note)
    devices, model = [run.device for run in runs], outcome.device_3d.model
    powers = [(model.steady(d).sensor_power_W, 2 * model.steady_errors(d)["sensor_power_W"]) for d in devices]
    return compared("slope of power", "W/K", claim, line(outcome.runs, powers)[0])


def limit(outcome: Outcome[Device]) -> Check:
    """Compare the outer temperature from which on the power is zero with the set point."""
    scene, (_, zero) = outcome.scene, line(outcome.runs)
    note = f"paper: no higher temperature than the set one is seen{rest(*below(outcome.runs))}"
    claim, scale = Estimate(scene.control.set_temperature, 0.0), Estimate(scene.set_rise, 0.0)
    return compared("end of the range", "K", claim, zero, note, scale, "the set rise")


def line(runs: Runs, powers: Sequence[tuple[float, float]] = ()) -> tuple[Estimate, Estimate]:
    """Return the slope (W/K) and the zero (K) of the sensor's steady power against the outer temperature.

    ``powers`` (W) are given with their error bounds; by default the last powers of the 1D runs.
    """
    outer = np.array([run.device.external.final_temperature for run in below(runs)])
    power, errors = np.array(powers or [run.final("sensor_power_W") for run in below(runs)]).T
    doubt, (tilt, level) = part(errors.sum(), np.ptp(power)), np.polyfit(outer - outer.mean(), power, 1).tolist()
    zero = float(outer.mean()) - part(level, tilt)
    return Estimate(tilt, abs(tilt) * doubt), Estimate(zero, doubt * float(np.ptp(outer)))


def below(runs: Runs) -> list[Run]:
    """Return the runs of outer steps that stay below the set point. Raises SceneError for fewer than two."""
    found = [run for run in runs.steps if run.device.external.final_temperature < run.device.control.set_temperature]
    if len(found) < 2:
        raise SceneError(
            "control.set_temperature and the materials leave fewer than two outer temperatures for figures 12 and 13: "
            "choose other figures with --figure"
        )
    return found


def rest(*runs: Run) -> str:
    """Return a remark on runs that do not end at rest, else nothing."""
    moving = any(run.remaining >= 1e-6 for run in runs)
    return "; the run does not end at rest: see Findings, and give a longer run.end_time" * moving


def meter(title: str, claim: float, at: int, unit: str, outcome: Outcome[Device]) -> Check:
    """Compare the smallest step that a meter reads with the paper's."""
    run = outcome.runs.base
    try:
        voltage, power = delivered(run.device, run.after, 1)
        step = PXI_4070.steps(voltage, power)[at]
        note = f"{quantity(voltage, 'V')} and {quantity(power / voltage, 'A')}"
    except ValueError as error:
        step, note = math.inf, str(error)
    return at_most(title, claim, step, unit, f"paper: in ranges of 1 V and 20 mA; here {note}")


def at_most(title: str, claim: float, measured: float, unit: str, note: str) -> Check:
    """Compare a value with the most that the paper gives."""
    return Check(title, claim, measured, unit, min(part(claim, measured) - 1, 0.0), 0.0, note, sense="at most")


def rate(outcome: Outcome[Device]) -> Check:
    """Compare the rates of the meter and of the controllers, which read once a sample."""
    eigenvalue = shown(largest_eigenvalue(at_sample_time(outcome.scene, 1 / METER_RATE)))
    note = f"paper: {METER_RATE:g} S/s is more than sufficient; there the loop's largest eigenvalue is {eigenvalue}"
    return at_most("NI 4070, rate", METER_RATE, 1 / outcome.scene.control.sample_time, "S/s", note)


def steady(title: str, name: str, outcome: Outcome[Device]) -> Check:
    """Compare a steady quantity."""
    note = "heat goes along the layers too, and eq 14 leaves out the constriction in pad and oxide"
    notes = {"sink_power_W": note, "sink_V": "as the sink's power"}
    note = notes.get(name, "the sensor's power leaves through the polymer in both")
    return compared(title, name[-1], outcome.reduced.steady[name], outcome.solved.steady[name], note)


def peak(film: str, when: bool, outcome: Outcome[Device]) -> Check:
    """Compare the highest rise of a film before the outer step, or its time."""
    device, result = outcome.scene, outcome.device_3d.runs.base.result
    error, rises, highest = result.errors[f"{film}_K"], [], []
    for each in (outcome.runs.base.result, result):
        early = each.time_s <= (device.external.step_time if device.steps_outside else math.inf)
        rises.append(each.trace(f"{film}_K") - device.sink.room_temperature)
        at = int(np.argmax(rises[-1][early]))
        highest.append((float(rises[-1][at]), float(each.time_s[at])))
    (rise_1d, time_1d), (rise_3d, time_3d) = highest
    if not when:
        return compared(f"peak, {film}", "K", Estimate(rise_1d, 0.0), Estimate(rise_3d, error))
    near = result.time_s[rises[-1] > rise_3d - 2 * error]
    time = Estimate(time_3d, float(np.abs(near - time_3d).max(initial=0.0)))
    return compared(f"when, {film}", "s", Estimate(time_1d, 0.0), time)


def settling_3d(outcome: Outcome[Device]) -> Check:
    """Compare the settling times of both models."""
    one, three = (settling_time(run) for run in (outcome.runs.base, outcome.device_3d.runs.base))
    return compare_times("settling time", one, three, f"to {percent(BAND, 1)} of the step")


def gain(film: str, outcome: Outcome[Device]) -> Check:
    """Compare the largest stable gains; 3D's error is the change from the coarser mesh."""
    device, external, model, key = outcome.scene, outcome.scene.external, outcome.device_3d.model, f"{film}_gain_limit"
    limits: list[Callable[..., object]] = [stability, model.stability, replace(model, fine=model.low).stability]
    outer = external.initial_temperature, external.final_temperature
    one, three, coarser = (min(float(getattr(limit(device, t), key)) for t in outer) for limit in limits)
    found = Estimate(three, abs(three - coarser) if math.isfinite(three) else 0.0)
    note = "largest stable gain, with the other gain as it is"
    return compared(f"gain, {film}", "V", Estimate(one, 0.0), found, note)


def claim_steady(outcome: Outcome[Device]) -> Check:
    """Compare the sensor's steady power with the heat into the polymer, in 3D."""
    power, flow = (outcome.solved.steady[name] for name in ("sensor_power_W", "polymer_flux_W"))
    return compared("claim, steady", "W", power, flow, f"{CLAIM}; the rest passes between sink and sensor")


def claim_over_time(outcome: Outcome[Device]) -> Check | None:
    """Compare the same from the outer step on, relative to the step of the steady power; None before it."""
    run = outcome.device_3d.runs.base
    result, start = run.result, run.device.external.step_time
    assert result.polymer_top_W is not None
    after = result.time_s > start + 1e-9 * run.device.control.sample_time
    if not after.any():
        return None
    time, power, top = (values[after] for values in (result.time_s, result.sensor_power_W, result.polymer_top_W))
    scale = abs(run.after.sensor_power_W - run.before.sensor_power_W) or abs(run.after.sensor_power_W) or 1.0
    at, errors = int(np.abs(power - top).argmax()), result.errors
    sides = Estimate(float(power[at]), errors["sensor_power_W"]), Estimate(float(top[at]), errors["polymer_top_W"])
    note, whole = f"{CLAIM}; at its top only once the polymer stored its heat", "the step of the steady power"
    return compared("claim, over time", "W", *sides, note, Estimate(scale, 0.0), whole, time=float(time[at]))


def shielding(outcome: Outcome[Device]) -> Check:
    """Compare the sensor's loss to the substrate with none, relative to the loss with the sink off."""
    slopes, errors = outcome.device_3d.model.shielding
    closed, off = slopes.sensor_power_per_substrate_W_per_K, slopes.sensor_power_per_substrate_sink_off_W_per_K
    note = (
        f"paper: the sensor loses nothing to the substrate; 1 K there changes its power by {quantity(closed, 'W', 2)}, "
        f"with the sink off by {quantity(off, 'W', 4)}"
    )
    found, scale = Estimate(closed, errors["sensor_power_per_substrate_W_per_K"]), Estimate(abs(off) or 1.0, 0.0)
    return compared("shielding", "W/K", Estimate(0.0, 0.0), found, note, scale, "what it is with the sink off")


STEP = "figure9", "outer step"
IN_3D, FILMS = ("3D", "figure9"), ("sink", "sensor")
CHECKS: dict[str, Definition[Outcome[Device]]] = {
    "fig9_settling": (settling, STEP),
    "fig9_balance": (balance, STEP),
    "fig10_steady": (steady_flow, ("figure10", "outer step")),
    "fig11_slow": (slow, ("figure11", "outer step")),
    "fig12_same_time": (same_time, ("figure12",)),
    "fig13_slope": (partial(slope, False), ("figure13",)),
    "fig13_limit": (limit, ("figure13",)),
    "meter_resistance": (partial(meter, "NI 4070, gold", METER_RESISTANCE, 0, "ohm"), ("all figures",)),
    "meter_power": (partial(meter, "NI 4070, power", METER_POWER, 1, "W"), ("all figures",)),
    "meter_rate": (rate, ("all figures",)),
    **{f"dev3d_{film}_power": (partial(steady, f"steady power, {film}", f"{film}_power_W"), IN_3D) for film in FILMS},
    **{f"dev3d_{film}_voltage": (partial(steady, f"steady voltage, {film}", f"{film}_V"), IN_3D) for film in FILMS},
    **{f"dev3d_{film}_peak": (partial(peak, film, False), IN_3D) for film in FILMS},
    **{f"dev3d_{film}_peak_time": (partial(peak, film, True), IN_3D) for film in FILMS},
    "dev3d_settling": (settling_3d, (*IN_3D, "outer step")),
    "dev3d_slope": (partial(slope, True), ("3D", "figure13")),
    **{f"dev3d_{film}_gain": (partial(gain, film), ("3D", "all figures")) for film in FILMS},
    "dev3d_claim_steady": (claim_steady, (*IN_3D, "outer step")),
    "dev3d_claim_over_time": (claim_over_time, (*IN_3D, "outer step")),
    "dev3d_shielding": (shielding, IN_3D),
}
