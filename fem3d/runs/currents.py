"""Currents over time without thermal probes: they follow the voltages at once, and superpose.

One steady state for each time-dependent voltage, and one for all constant voltages, give the whole transient. No heat
problem is solved, and no density or specific heat is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d.results.outputs import Outputs
from fem3d.runs import probe_quantities
from scenes.errors import NumericsError, SceneError, quoted
from scenes.keys import ACCURACY
from scenes.model import DERIVED, AnyScene, Schedule, Value
from scenes.result import Result, Step, Traces
from statespace.channels import Inputs

FINEST = 0.01  # each voltage's part is solved to this fraction of the accuracy at best: finer takes very much longer
_OTHER = {"max": "min", "min": "max"}


def over_time(scene: AnyScene, solve: Callable[[Any], Result], plan: tuple[Step, ...]) -> Result:
    """Superpose the probes of a transient of currents and potentials alone.

    ``solve`` answers a steady scene; ``plan`` is copied into the result. Errors hold at every time.
    Raises SceneError for an extreme potential under several independent voltages, because extremes do not superpose,
    and the errors of ``solve``.
    """
    for probe in scene.probes:
        if probe.quantity in DERIVED:
            raise SceneError(
                f"probe {quoted(probe.name)} asks for a {probe.quantity} over time where nothing is heated: ask for it "
                "in the steady state, or for a temperature too"
            )
    inputs, driven = _inputs(scene), _driven(scene)
    extremes = [p.name for p in scene.probes if p.quantity == "potential" and p.reduce != "mean"]
    if extremes and len(driven) > 1:
        raise SceneError(
            f"probe {quoted(extremes[0])}.reduce asks for an extreme potential under {len(driven)} voltages that vary "
            'apart, of which it is not the sum: give reduce = "mean", or a point'
        )
    times = _rows(inputs, scene, bool(extremes))
    g = np.stack([inputs.at(times)[:, channel] / value for channel, value in driven])

    def answered(accuracy: float) -> _Sum:
        return _added(scene, [solve(_alone(scene, *each, extremes, accuracy)) for each in driven], g, extremes)

    each = max(scene.accuracy / len(driven), ACCURACY.lower)
    results, values, errors, worst, share = answered(each)
    # Several voltages together may drive less than one alone, which makes the relative error larger.
    needed = scene.accuracy * share
    if worst > scene.accuracy and needed >= max(FINEST * scene.accuracy, ACCURACY.lower / len(driven)):
        with suppress(NumericsError):
            results, values, errors, worst, _ = answered(needed)
    most = {key: max(r.details[key] for r in results) for key in ("unknowns", "electric_unknowns", "energy_imbalance")}
    warnings = list(dict.fromkeys(text for r in results for text in r.details["warnings"]))
    if len(driven) > 1 and worst > scene.accuracy:
        warnings.append(
            f"the errors of {len(driven)} voltages that vary apart add up to {worst:.1e} of what they drive together, "
            f"more than the accuracy of {scene.accuracy:g}"
        )
    details = {**results[0].details, **most, "plan": plan, "warnings": warnings}
    return Result(
        "fem3d", {}, Traces(times, values, errors), details | {"transient_imbalance": most["energy_imbalance"]}
    )


_Sum = tuple[list[Result], dict[str, np.ndarray], dict[str, float], float, float]
"""The steady answers to each voltage alone, the sums over time, their errors, the largest relative error, and the least
ratio of a scale to the sum of the scales of all voltages alone."""


def _added(scene: AnyScene, alone: list[Result], g: np.ndarray, extremes: list[str]) -> _Sum:
    """Add the steady answers to each voltage alone, times their courses ``g`` (voltages, times)."""
    values: dict[str, np.ndarray] = {}
    for probe in scene.probes:
        each = [part * r.steady[probe.name].value for r, part in zip(alone, g, strict=True)]
        if probe.name in extremes:
            # A voltage of the other sign turns the potential upside down.
            each = [np.where(g[0] < 0, g[0] * alone[0].steady[_turned(probe.name)].value, each[0])]
        values[probe.name] = np.sum(each, axis=0)
    errors = {p.name: float(sum(r.steady[p.name].error for r in alone)) for p in scene.probes}
    outs = [r.details["solution"].out for r in alone]
    electrodes = {name for out in outs for name in out if name.startswith("current:")}
    # An electrode that symmetry leaves out carries nothing under that voltage.
    together: Outputs = {n: sum(part * out.get(n, 0.0) for part, out in zip(g, outs, strict=True)) for n in electrodes}
    together |= {f"probe:{name}": value for name, value in values.items()}
    none = np.zeros(1)
    scales = probe_quantities.scales(scene, {"power": none, "generated": none, **together}, {})
    share = min(scales[name] / sum(r.details["scales"][name] for r in alone) for name in errors)
    return alone, values, errors, max(e / scales[name] for name, e in errors.items()), share


def plan(scene: AnyScene) -> tuple[Step, Step]:
    """Return the lines of the plan for the steady state and the transient."""
    count = len(_driven(scene))
    states = "one" if count == 1 else f"{count}, of each voltage that varies apart"
    return (
        Step("steady state", "done", f"{states}, refined until every estimated error is below {scene.accuracy:g}"),
        Step("transient", "done", f"to {scene.end_time:g} s: currents follow the voltages at once, and add up"),
    )


def _inputs(scene: AnyScene) -> Inputs:
    given = [b.value for b in scene.boundaries if b.kind == "voltage"]
    return Inputs(tuple(dict.fromkeys(v for v in given if isinstance(v, Schedule))))


def _driven(scene: AnyScene) -> list[tuple[int, float]]:
    """Return the channels with a voltage other than zero, each with its largest magnitude (V)."""
    inputs = _inputs(scene)
    largest = inputs.largest(scene.end_time)
    constant = any(b.kind == "voltage" and not isinstance(b.value, Schedule) and b.value for b in scene.boundaries)
    channels = [(channel, float(v)) for channel, v in enumerate(largest) if v and (channel or constant)]
    return channels or [(0, 1.0)]


def _alone(scene: AnyScene, channel: int, value: float, extremes: list[str], accuracy: float) -> AnyScene:
    """Return the steady scene of one channel at a value, with the opposite of each extreme as an additional probe."""
    schedules = _inputs(scene).schedules

    def given(voltage: Value) -> float:
        if isinstance(voltage, Schedule):
            return value if channel and voltage == schedules[channel - 1] else 0.0
        return voltage if channel == 0 else 0.0

    untyped: Any = scene
    turned = (replace(p, name=_turned(p.name), reduce=_OTHER[p.reduce]) for p in untyped.probes if p.name in extremes)
    alone: AnyScene = replace(
        untyped, boundaries=tuple(replace(b, value=given(b.value)) for b in untyped.boundaries),
        probes=(*untyped.probes, *turned), steady=True, output_times=(), accuracy=accuracy,
    )  # fmt: skip
    return alone


def _turned(name: str) -> str:
    return f"{name}, turned"


def _rows(inputs: Inputs, scene: AnyScene, extremes: bool) -> np.ndarray:
    """Return the times (s) between which all is linear: bends, jumps and just before jumps of voltages, and for
    ``extremes`` of potentials also sign changes."""
    end = scene.end_time
    knots = inputs.knots(end)
    before = [t - 1e-9 * (t - max([0.0, *(k for k in knots if k < t)])) for t in knots if inputs.jumps(t).any()]
    times = np.unique(np.concatenate([[0.0, end], knots, before, scene.output_times]))
    g = inputs.at(times)[:, 1:].T if extremes else np.empty((0, len(times)))
    crossings = [times[i] + (times[i + 1] - times[i]) * v[i] / (v[i] - v[i + 1])
                 for v in g for i in np.flatnonzero(v[:-1] * v[1:] < 0)]  # fmt: skip
    return np.unique(np.concatenate([times, crossings]))
