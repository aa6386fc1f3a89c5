"""What a reader of a run must know, in plain sentences."""

from __future__ import annotations

import numpy as np

from reduced1d.device.stability import stability
from reduced1d.device.steady import steady
from scenes.device import Device
from scenes.loop.march import CEILING, March
from scenes.loop.stability import Stability

ELEMENTS = ("sink", "sensor")
MARGIN = 2.0
"""The gain margin below which a loop counts as near instability: 6 dB is the least that textbooks of control ask for
(Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems, section 6.4)."""


def findings(device: Device, run: March, error: float, goal: float) -> tuple[str, ...]:
    """Sentences on the limiter, saturation, stability about the steady states, a run that was stopped, and an error
    estimate (K) above its goal."""
    h, end = device.control.sample_time, (len(run.rises) - 1) * device.control.sample_time
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
    rises, voltages = run.rises[-1, 0], run.voltages[-1, 0]
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
        if len(at) == len(run.limited):
            found.append(f"the limit V >= 0 held the {name} at every sample: it never got any power")
        elif len(at):
            many = f"{len(at)} of {len(run.limited)} samples, from {at[0] * h:.6g} s to {at[-1] * h:.6g} s"
            found.append(f"the limit V >= 0 held the {name} at {many if len(at) > 1 else f'{at[0] * h:.6g} s'}")
    return found


def shown(eigenvalue: complex) -> str:
    """An eigenvalue: "-1.21 (alternating)", or the size of a pair of complex ones."""
    if eigenvalue.imag:
        return f"{abs(eigenvalue):.4g} in size (oscillating)"
    return f"{eigenvalue.real:.4g}{' (alternating)' if eigenvalue.real < 0 else ''}"


def loop_text(device: Device, about: Stability) -> str:
    """Whether the loop is unstable or near it, with its largest eigenvalue and the gains' limits; empty for neither."""
    gains = {name: getattr(device.control, f"{name}_gain") for name in ELEMENTS}
    limits = {name: getattr(about, f"{name}_gain_limit") for name in ELEMENTS}
    near = [name for name in ELEMENTS if gains[name] * MARGIN > limits[name]]
    if about.stable and not near:
        return ""
    said = "the loop is near instability" if about.stable else "the loop is unstable"
    listed = [
        f"the {name}'s gain of {gains[name]:.4g} V is {gains[name] / limits[name]:.3g} times its largest stable one"
        if limits[name] > 0 else f"no gain of the {name} is stable"
        for name in near
    ]  # fmt: skip
    said += f": its largest eigenvalue per sample is {shown(about.eigenvalue)}"
    if not about.stable:
        said += f": small disturbances grow at {about.growth_rate:.4g} 1/s"
    return f"{said}; {' and '.join(listed)}, each with the other gain as it is"


def _steady(device: Device, name: str, temperature: float) -> list[str]:
    found, state = [], steady(device, temperature)
    for element in ELEMENTS:
        if getattr(state, f"{element}_saturated"):
            found.append(
                f"at the {name} outer temperature, {temperature:g} K, the {element} needs no power: it settles at "
                f"{getattr(state, f'{element}_K'):.6g} K instead of the set {device.control.set_temperature:g} K"
            )
    said = loop_text(device, stability(device, temperature))
    if said:
        found.append(f"about the steady state at the {name} outer temperature, {temperature:g} K, {said}")
    return found
