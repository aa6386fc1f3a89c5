"""What a reader of a run must know, in plain sentences."""

from __future__ import annotations

import numpy as np

from reduced1d.device.march import CEILING, March
from reduced1d.device.stability import is_stable, stability
from reduced1d.device.steady import steady
from scenes.device import Device

ELEMENTS = ("sink", "sensor")


def findings(device: Device, run: March, error: float, goal: float) -> tuple[str, ...]:
    """Sentences on the limiter, saturation, stability about the steady states, a run that was stopped, and an error
    estimate (K) above its goal."""
    h, end = device.control.sample_time, (len(run.traces) - 1) * device.control.sample_time
    found = [*_stopped(run, end), *_limiter(run, h)]
    external = device.external
    seen = [("initial", external.initial_temperature)] if external.step_time > 0 else []
    if external.step_time < end or not seen:
        seen.append(("final", external.final_temperature))
    for name, temperature in seen:
        found += _steady(device, name, temperature)
    if error > goal:
        found.append(
            f"the estimated error of a temperature, {error:.1e} K, is above the accuracy asked for, {goal:.1e} K: "
            "where the loop is unstable no computation can follow it for long"
        )
    return tuple(found)


def _stopped(run: March, end: float) -> list[str]:
    if not run.stopped:
        return []
    rises, voltages = run.traces[-1, 0, :2], run.traces[-1, 0, 2:4]
    hot = int(np.argmax(rises))
    reason = (
        "; its voltage is negative, where eq 21 raises the power of an element that is too hot"
        if voltages[hot] < 0
        else ""
    )
    return [f"the run was stopped at {end:.6g} s: the {ELEMENTS[hot]} was {rises[hot]:.0f} K above room temperature "
            f"(ceiling {CEILING:.0f} K) at {voltages[hot]:.3g} V{reason}"]  # fmt: skip


def _limiter(run: March, h: float) -> list[str]:
    found = []
    for e, name in enumerate(ELEMENTS):
        at = np.flatnonzero(run.limited[:, e])
        if len(at):
            found.append(
                f"the limit V >= 0 held the {name} at {len(at)} samples, first at {at[0] * h:.6g} s, last at "
                f"{at[-1] * h:.6g} s"
            )
    return found


def _limit(element: str, gain: float) -> str:
    return f"the {element} is stable up to {gain:.4g} V" if gain > 0 else f"no gain of the {element} is stable"


def _steady(device: Device, name: str, temperature: float) -> list[str]:
    found, state = [], steady(device, temperature)
    for element in ELEMENTS:
        if getattr(state, f"{element}_saturated"):
            found.append(
                f"at the {name} outer temperature, {temperature:g} K, the {element} needs no power: it settles at "
                f"{getattr(state, f'{element}_K'):.6g} K instead of the set {device.control.set_temperature:g} K"
            )
    if not is_stable(device, temperature):
        about = stability(device, temperature)
        found.append(
            f"the loop is unstable about the steady state at the {name} outer temperature, {temperature:g} K: small "
            f"disturbances grow at {about.growth_rate:.4g} 1/s, by a factor {about.radius:.4g} per sample; "
            + " and ".join(_limit(name, getattr(about, f"{name}_gain_limit")) for name in ELEMENTS)
            + ", each with the other gain as it is"
        )
    return found
