"""Currents over time without thermal probes: they follow the voltages at once, and superpose.

The voltages of any instant are a sum of the voltages at a few independent instants of the scene, whose steady states
give the whole transient. No heat problem is solved, and no density or specific heat is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import qr

from scenes.errors import SceneError, quoted
from scenes.keys import ACCURACY
from scenes.model import DERIVED, ROUNDING, AnyScene, Schedule
from scenes.result import Result, Step, Traces
from statespace import channels
from statespace.channels import Inputs


def over_time(scene: AnyScene, solve: Callable[[Any], Result], plan: tuple[Step, ...]) -> Result:
    """Superpose the probes of a transient of currents and potentials alone.

    ``solve`` answers a steady scene; ``plan`` is copied into the result. Errors hold at every time.
    Raises SceneError for an extreme potential under voltages that vary apart or change their sign, because extremes do
    not superpose, and the errors of ``solve``.
    """
    for probe in scene.probes:
        if probe.quantity in DERIVED:
            raise SceneError(
                f"probe {quoted(probe.name)} asks for a {probe.quantity} over time where nothing is heated: ask for it "
                "in the steady state, or for a temperature too"
            )
    times, instants, parts = _superposition(scene)
    extremes = [p.name for p in scene.probes if p.quantity == "potential" and p.reduce != "mean"]
    if extremes and (len(instants) > 1 or (parts < 0).any()):
        raise SceneError(
            f"probe {quoted(extremes[0])}.reduce asks for an extreme potential under voltages that vary apart or "
            'change their sign, of which it is not the sum: give reduce = "mean", or a point'
        )
    accuracy = max(scene.accuracy / len(instants), ACCURACY.lower)
    results = [solve(replace(at_instant(scene, time), accuracy=accuracy)) for time in instants]
    # Nothing is solved at an instant of equal voltages, which drive no current.
    solved = [n for n, r in enumerate(results) if r.details["electric_unknowns"]] or [0]
    largest = np.abs(parts).max(axis=1)
    names = [p.name for p in scene.probes]
    values = {name: np.array([r.steady[name].value for r in results]) @ parts for name in names}
    errors = {name: float(sum(largest[n] * results[n].steady[name].error for n in solved)) for name in names}
    most = {key: max(r.details[key] for r in results) for key in ("unknowns", "electric_unknowns", "energy_imbalance")}
    warnings = list(dict.fromkeys(text for r in results for text in r.details["warnings"]))
    scales = {name: max(results[n].details["scales"][name] for n in solved) for name in errors}
    worst = max(error / scales[name] for name, error in errors.items())
    if len(instants) > 1 and worst > scene.accuracy:
        warnings.append(
            f"the errors of {len(instants)} voltages that vary apart add up to {worst:.1e} of what they drive "
            f"together, more than the accuracy of {scene.accuracy:g}"
        )
    details = results[0].details | most | {"scales": scales, "plan": plan, "warnings": warnings}
    details["transient_imbalance"] = most["energy_imbalance"]
    return Result("fem3d", {}, Traces(times, values, errors), details)


def plan(scene: AnyScene) -> tuple[Step, Step]:
    """Return the lines of the plan for the steady state and the transient."""
    count = len(_superposition(scene)[1])
    states = "one" if count == 1 else f"{count}, of voltages that vary apart"
    return (
        Step("steady state", "done", f"{states}, refined until every estimated error is below {scene.accuracy:g}"),
        Step("transient", "done", f"to {scene.end_time:g} s: currents follow the voltages at once, and add up"),
    )


def at_instant(scene: Any, time: float) -> Any:
    """Return the steady scene under the conditions at a time (s)."""

    def then(value: Any) -> float:
        return float(channels.value(value, np.array([time]))[0])

    heated = scene.heated[1]
    sources = tuple(replace(s, heat_source=then(s.heat_source)) for s in getattr(scene, heated))
    boundaries = tuple(replace(b, value=then(b.value), ambient=then(b.ambient)) for b in scene.boundaries)
    return replace(scene, boundaries=boundaries, steady=True, output_times=(), **{heated: sources})


def _superposition(scene: AnyScene) -> tuple[np.ndarray, list[float], np.ndarray]:
    """Return the times (s) between which all is linear, few independent instants (s) among them, and the coefficients
    (instants, times) of their voltages in the voltages at each time."""
    given = [b.value for b in scene.boundaries if b.kind == "voltage"]
    inputs = Inputs(tuple(dict.fromkeys(v for v in given if isinstance(v, Schedule))))
    end, constant = scene.end_time, any(v for v in given if not isinstance(v, Schedule))
    knots = inputs.knots(end)
    before = [t - 1e-9 * (t - max([0.0, *(k for k in knots if k < t)])) for t in knots if inputs.jumps(t).any()]
    times = np.unique(np.concatenate([[0.0, end], knots, before, scene.output_times]))
    voltages = inputs.at(times)[:, 0 if constant else 1 :]
    if not (size := np.abs(voltages).max(initial=0.0)):
        return times, [0.0], np.ones((1, len(times)))
    pivots, order = qr(voltages.T, mode="r", pivoting=True)
    chosen = order[: int((np.abs(np.diagonal(pivots)) > ROUNDING * size).sum())]
    parts = np.linalg.lstsq(voltages[chosen].T, voltages.T, rcond=None)[0]
    return times, times[chosen].tolist(), parts
