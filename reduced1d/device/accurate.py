"""The accurate scheme: all layers at once, exact between samples but for the powers, with its error estimated; and
sentences about its run: limiter, saturation, stability, and how far the run can be trusted."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from reduced1d.device.lumped import Lumped, Modes, around, lump, modes, stability, steady
from scenes.device import Device
from statespace.device_model import FILMS
from statespace.march import CEILING, March, march
from statespace.result import QUANTITIES, DeviceResult, device_result
from statespace.stability import Stability

LESS = 3
"""The run that estimates the error in space has elements of a degree lower by this."""

MARGIN = 2.0
"""Loops with a smaller gain margin are called near instability: 6 dB is the least that textbooks ask for (Franklin,
Powell and Emami-Naeini, Feedback Control of Dynamic Systems, section 6.4)."""


class Resolution(NamedTuple):
    """Degree of the elements in space, and number of unknown powers per element and interval in time."""

    degree: int
    nodes: int


FIRST = Resolution(12, 6)  # The resolution of the first run; it is raised until the error is small enough.


def imbalance(lumped: Lumped, modes: Modes, run: March) -> float:
    """The imbalance of heat of sink, insulator and sensor over a run, as a part of the
    heat (J) that was generated or passed the boundaries: to substrate and air, and into the polymer.

    The time integral of each mode is exact, from its own equation. The heat into the polymer is that of the reported
    flux, from the temperature's slope at the sensor, not the flux that the discretisation balances by construction.
    """
    m = modes.modal
    heat = (run.energy @ m.shape - run.change + run.stepped) / m.rates
    generated = float(run.energy.sum())
    anchors = float(lumped.conductance * (m.shape[0] @ heat + m.external[0] * run.outer_time))
    polymer = float(m.flux[0] @ heat + m.flux_external[0] * run.outer_time)
    stored = float(modes.content @ run.change + modes.content_external * run.outer)
    total = abs(generated) + abs(anchors) + abs(polymer)
    return (generated - anchors - polymer - stored) / total if total else 0.0


def solve_accurate(
    device: Device, *, meter: tuple[float, float] = (0.0, 0.0), start: Literal["cold", "settled"] = "cold",
    with_findings: bool = True,
) -> DeviceResult:  # fmt: skip
    """Traces of a device, to its ``accuracy`` where that can be reached.

    Three resolutions are run: the answer, one with elements of a degree LESS lower, and one with two powers
    fewer between samples. The differences estimate the errors of the coarser runs in space and in time
    and whatever exceeds the accuracy is refined, as long as that helps. ``meter`` is the resolution in ohm to which the
    resistances of (sink, sensor) are measured, 0 for an ideal meter. ``start`` "settled" begins in the steady state at
    the initial outer temperature, "cold" at room temperature without voltage. Without
    findings no limits of stability are sought, which of slowly sampled loops takes as long as the run. Raises
    ValueError for values that make no device, and ArithmeticError where the powers between two samples do not converge.
    """
    goal, lumped = device.accuracy * device.set_rise, lump(device)
    resolution, before = FIRST, math.inf
    for attempt in range(4):
        degree, nodes = resolution
        spectrum, tolerance = modes(lumped, degree), min(1e-4 * goal, 1e-8)
        coarser = modes(lumped, degree - LESS)
        run, less_space, less_time = (
            march(each.modal, q, device, tolerance, meter, start)
            for each, q in ((spectrum, nodes), (coarser, nodes), (spectrum, nodes - 2))
        )
        parts = {"space": run.distance(less_space), "time": run.distance(less_time)}
        space, time = (max(part["sink_K"], part["sensor_K"]) for part in parts.values())
        finer = Resolution(min(degree + 6 * (space > goal / 2), 36), min(nodes + 4 * (time > goal / 2), 18))
        if finer == resolution or attempt == 3 or space + time > before / 2:
            break
        resolution, before = finer, space + time
    errors = {q: parts["space"][q] + parts["time"][q] + 1e-12 * float(np.abs(run.traces[:, i]).max())
              for i, q in enumerate(QUANTITIES)}  # fmt: skip
    said = findings(device, run, max(errors["sink_K"], errors["sensor_K"]), goal) if with_findings else ()
    return device_result(
        "accurate", device, run.traces, errors, **around(device), error_parts=parts, findings=said,
        details={
            "states": spectrum.modal.count, "degree": degree, "nodes": nodes, "rounds": attempt + 1,
            "energy_imbalance": imbalance(lumped, spectrum, run), "stopped": run.stopped,
        },
    )  # fmt: skip


def findings(device: Device, run: March, error: float, goal: float) -> tuple[str, ...]:
    """Sentences on limiter, saturation, stability, a run that was stopped, and an error estimate (K) above its goal."""
    h, external, sentences = device.control.sample_time, device.external, []
    end = (len(run.rises) - 1) * h
    if run.stopped:
        rises, voltages = run.rises[-1], run.voltages[-1]
        hot = int(np.argmax(rises))
        wrong = "; its voltage is negative, where eq 21 raises the power of an element that is too hot"
        sentences.append(
            f"the run was stopped at {end:.6g} s: the {FILMS[hot]} was {rises[hot]:.0f} K above room temperature "
            f"(ceiling {CEILING:.0f} K) at {voltages[hot]:.3g} V{wrong if voltages[hot] < 0 else ''}"
        )
    for name, limited in zip(FILMS, run.limited.T, strict=True):
        at = np.flatnonzero(limited)
        if len(at) == len(limited):
            sentences.append(f"the limit V >= 0 held the {name} at every sample: it never got any power")
        elif len(at):
            many = f"{len(at)} of {len(limited)} samples, from {at[0] * h:.6g} s to {at[-1] * h:.6g} s"
            sentences.append(f"the limit V >= 0 held the {name} at {many if len(at) > 1 else f'{at[0] * h:.6g} s'}")
    seen = [("initial", external.initial_temperature)] if external.step_time > 0 else []
    if external.step_time < end or not seen:
        seen.append(("final", external.final_temperature))
    for name, temperature in seen:
        state = steady(device, temperature)
        also = ", as its controller sees it through the common ground" if device.control.ground_resistance else ""
        if state.cycles:
            sentences.append(
                f"at the {name} outer temperature, {temperature:g} K, there is no steady state: over the common ground "
                "a film can neither be held at the set temperature nor rest without power, and its loop swings"
            )
        for element in () if state.cycles else FILMS:
            if getattr(state, f"{element}_saturated"):
                sentences.append(
                    f"at the {name} outer temperature, {temperature:g} K, the {element} needs no power{also}: it "
                    f"settles at {getattr(state, f'{element}_K'):.6g} K instead of the set "
                    f"{device.control.set_temperature:g} K"
                )
        comes_to_rest = name == "final" and device.control.ground_resistance and not state.cycles
        for i, element in enumerate(FILMS if comes_to_rest else ()):
            if run.limited[-20:, i].any() and not getattr(state, f"{element}_saturated"):
                sentences.append(
                    f"at the end the {element}'s loop swings from no voltage on, though it could be held with "
                    f"{getattr(state, f'{element}_power_W') * 1e3:.4g} mW at the {name} outer temperature: over the "
                    "common ground the other's current hides a film that has lost its own, so that it stays without"
                )
        said = loop_text(device, stability(device, temperature))
        if said:
            sentences.append(f"about the steady state at the {name} outer temperature, {temperature:g} K, {said}")
    if error > goal:
        sentences.append(
            f"the estimated error of a temperature, {error:.1e} K, is above the accuracy asked for, {goal:.1e} K: "
            "where the loop is unstable no computation can follow it for long"
        )
    return tuple(sentences)


def shown(eigenvalue: complex) -> str:
    """An eigenvalue: "-1.21 (alternating)", or the size of a complex pair."""
    if eigenvalue.imag:
        return f"{abs(eigenvalue):.4g} in size (oscillating)"
    return f"{eigenvalue.real:.4g}{' (alternating)' if eigenvalue.real < 0 else ''}"


def loop_text(device: Device, about: Stability) -> str:
    """Whether the loop is unstable or near it, with its largest eigenvalue and the gains' limits; empty for neither."""
    gains = {name: getattr(device.control, f"{name}_gain") for name in FILMS}
    limits = {name: getattr(about, f"{name}_gain_limit") for name in FILMS}
    near = [name for name in FILMS if gains[name] * MARGIN > limits[name]]
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
