"""The first line about a run: what the sensor does, in words and numbers, and how much of the paper comes out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from compare.device import scope
from compare.device.runs import BAND, Run
from compare.device.words import kelvin, milliseconds
from compare.verdict import Check
from compare.words import percent, quantity
from reduced1d.device.findings import shown
from reduced1d.device.stability import largest_eigenvalue
from scenes.loop.settling import settling

if TYPE_CHECKING:
    from compare.device.outcome import DeviceOutcome


def answer(outcome: DeviceOutcome, contrary: Sequence[Check], named: bool = True) -> str:
    """What happens and what of the paper differs, ``named`` or counted only; ``contrary`` are the checks that
    contradict the scene."""
    run, external = outcome.runs.base, outcome.device.external
    by = ", by the paper's scheme," if outcome.request.scheme == "paper" else ""
    if scope.steps(outcome.device):
        when = f"after the step from {external.initial_temperature:g} to {external.final_temperature:g} K outside"
    else:
        when = f"from cold, with {_outside(run):g} K outside,"
    return f"{outcome.device.name}: {when}{by} {_happens(run)}. {_claims(outcome, contrary, named)}"


def _happens(run: Run) -> str:
    """What the sensor's power does, the worst first: runs away, never settles, has not yet, is none, or settles."""
    control, external = run.device.control, run.device.external
    outside = _outside(run)
    state = run.after if outside == external.final_temperature else run.before
    largest = largest_eigenvalue(run.device, outside)
    end = float(run.result.time_s[-1])
    why = f"the loop is unstable, its largest eigenvalue per sample {shown(largest)}" if abs(largest) >= 1 else ""
    if run.ran_away:
        why += f"{', and ' if why else ''}the run was stopped after {milliseconds(end)} (see Findings)"
    if why:
        return f"nothing settles: {why}"
    if not (run.before.sensor_power_W or run.after.sensor_power_W):
        over = kelvin(state.sensor_K - control.set_temperature)
        why = "is above the set point" if state.sensor_saturated else "has no gain"
        return f"the sensor gets no power, as it {why}: it settles at {state.sensor_K:.5g} K, {over} off the set point"
    found = settling(run.device, run.result, "sensor_power_W", BAND)
    power = run.result.sensor_power_W
    if not found or not math.isfinite(found[-1].time):
        left = end - (found[-1].start if found else 0.0)
        return (
            f"the sensor's power does not settle to {percent(BAND, 1)} in the {milliseconds(left)} of the run: it ends "
            f"at {quantity(float(power[-1]), 'W')}, bound for {quantity(state.sensor_power_W, 'W')}"
        )
    return (
        f"the sensor's power settles to {percent(BAND, 1)} in {milliseconds(found[-1].time)}, at "
        f"{quantity(state.sensor_power_W, 'W')}"
    )


def _outside(run: Run) -> float:
    """The outer temperature (K) that the run ends with."""
    external = run.device.external
    late = run.device.end_time > external.step_time
    return external.final_temperature if late else external.initial_temperature


def _claims(outcome: DeviceOutcome, contrary: Sequence[Check], named: bool) -> str:
    """How many of the paper's claims fail, and whether the scene knows."""
    checks = outcome.checks
    if not checks:
        return "Nothing of the paper was checked."
    names = {v: [check.id for check in checks if check.verdict == v] for v in ("differs", "unresolved")}
    said = f"{len(names['differs'])} of {len(checks)} claims of the paper differ"
    if contrary:
        return f"{said}; not as expected: {', '.join(check.id for check in contrary)}."
    if outcome.device.expected_to_differ is not None and not names["unresolved"]:
        said += ", as the scene declares"
    left = f", {len(names['unresolved'])} open" if names["unresolved"] else ""
    if not named:
        return f"{said}{left}."
    said += f": {', '.join(names['differs'])}" if names["differs"] else ""
    return said + (f"; open: {', '.join(names['unresolved'])}." if names["unresolved"] else ".")
