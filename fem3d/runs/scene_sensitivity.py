"""How the probes of a free scene follow its numbers, from a run that is there.

A temperature is followed as a rise: in the steady state above the mean of the coldest given temperatures (the start's,
where none is given), over time above the start.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from fem3d.results.study import Study
from fem3d.runs import probe_quantities, readouts
from fem3d.runs import scene as scene_run
from fem3d.sensitivity import steady as steady_slopes
from fem3d.sensitivity.motion import STEP
from fem3d.sensitivity.over_time import over_time
from fem3d.sensitivity.steady import Known, Table
from scenes.errors import SceneError, quoted
from scenes.model import AnyScene, values
from scenes.result import Estimate, Result
from scenes.varied import neighbour, numbers

SAME = 1e-9  # K: given temperatures nearer to each other are one


@dataclass(frozen=True, eq=False)
class Slopes:
    """d ln probe / d ln key, by key and probe, with errors: steady, or over time of the largest size that the probe
    has; the ``values`` that they are of, of temperatures the rises; over time also d probe / d ln key (times,) in the
    probe's unit, at ``times`` (s), and the errors of that. ``left_out``: why a key or a probe has none."""

    table: Table
    values: dict[str, Estimate]
    left_out: dict[str, str]
    times: np.ndarray | None = None
    course: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    errors: dict[str, dict[str, float]] = field(default_factory=dict)


def of_scene(scene: AnyScene, result: Result, keys: Iterable[str] | None = None) -> Slopes:
    """The derivatives of a result of a whole scene by every number other than zero, or by some ``keys`` alone. Raises
    ConvergenceError."""
    others, torn = dict[str, AnyScene](), dict[str, str]()
    for key in numbers(scene) if keys is None else keys:
        try:
            others[key] = neighbour(scene, key, STEP)
        except SceneError as error:
            torn[key] = str(error)
    slopes = _steady(scene, result, others) if result.traces is None else _over_time(scene, result, others)
    return replace(slopes, left_out=torn | slopes.left_out)


def _steady(scene: AnyScene, result: Result, others: Mapping[str, AnyScene]) -> Slopes:
    study, state = result.details["study"], result.details["solution"].state
    besides = {key: partial(_study, other) for key, other in others.items()}
    by, left_out = steady_slopes.motions(study, state.heat.domain, besides)
    rises = [p.name for p in scene.probes if p.quantity == "temperature"]
    floor = floor_of(scene, scene)
    estimates = {n: Estimate(e.value - floor * (n in rises), e.error) for n, e in result.steady.items()}
    known, none = _known(estimates)
    # What is read is above the initial temperature.
    above = floor - scene.initial_temperature
    moved = {key: (floor_of(scene, o) - o.initial_temperature - above) / STEP for key, o in others.items()}
    zero = {key: dict.fromkeys(rises, by_key) for key, by_key in moved.items()}
    # The voltage across a resistance is over the current, whatever else a key moves.
    out = result.details["solution"].out
    pairs = readouts.pairs(scene)
    for key, other in others.items() if pairs else ():
        beside = readouts.pairs(other)
        for name, pair in pairs.items():
            change = readouts.given(pair, out) - readouts.given(beside[name], out)
            zero[key][name] = float(change / STEP / out[f"current:{pair[0].name}"])
    table, without = steady_slopes.steady_table(study, state, Known(known, zero), by)
    return Slopes(table, known, left_out | none | {f"probe {quoted(n)}": why for n, why in without.items()})


def _over_time(scene: AnyScene, result: Result, others: Mapping[str, AnyScene]) -> Slopes:
    if "transient" not in result.details:
        why = "the currents follow the voltages at once: the steady state of each has its sensitivities"
        return Slopes({}, {}, dict.fromkeys(others, why))
    traces, study = result.traces, _study(scene)
    assert traces is not None
    late = traces.time >= study.earliest * (1 - 1e-9)
    start = {p.name: scene.initial_temperature if p.quantity == "temperature" else 0.0 for p in scene.probes}
    above_start = {n: v[late] - start[n] for n, v in traces.values.items()}
    top = {n: float(traces.time[late][np.abs(v).argmax()]) for n, v in above_start.items()}

    besides = {key: partial(_study, other) for key, other in others.items()}
    course, left_out = over_time(study, result.details["transient"], besides, list(top.values()))
    at = {n: int(np.abs(v).argmax()) for n, v in course.traces.items()}
    known, none = _known({n: Estimate(float(v[at[n]]), traces.errors[n]) for n, v in course.traces.items()})
    table, errors = Table(), dict[str, dict[str, float]]()
    for key, by_name in course.values.items():
        table[key], errors[key] = {}, {}
        for n, change in by_name.items():
            share = traces.errors[n] * float(np.abs(change).max()) / max(float(np.abs(above_start[n]).max()), 1e-300)
            errors[key][n] = float(course.less[key][n].max()) + share
            if n in known:
                value = known[n].value
                table[key][n] = Estimate(float(change[at[n]]) / value, errors[key][n] / abs(value))
    return Slopes(table, known, left_out | none, course.times, course.values, errors)


def _study(scene: AnyScene) -> Study:
    return probe_quantities.study(scene, scene_run.part_of(scene, True))


def _known(estimates: Mapping[str, Estimate]) -> tuple[dict[str, Estimate], dict[str, str]]:
    """The quantities that are not zero within their errors, and what is said of the others."""
    known = {n: e for n, e in estimates.items() if abs(e.value) > e.error}
    why = "it is zero within its error, of which there is no percent"
    return known, {f"probe {quoted(n)}": why for n in estimates if n not in known}


def floor_of(scene: AnyScene, other: AnyScene) -> float:
    """What temperatures are above: the mean in another scene of those that are the coldest given ones in this."""
    pairs: list[tuple[Any, Any]] = []
    both: Iterable[tuple[Any, Any]] = zip(scene.boundaries, other.boundaries, strict=True)
    for a, b in both:
        if a.kind == "temperature":
            pairs.append((a.value, b.value))
        elif a.kind == "convection":
            pairs.append((a.ambient, b.ambient))
    if not pairs:
        return other.initial_temperature
    lowest = min(min(values(a)) for a, _ in pairs)
    return float(np.mean([min(values(b)) for a, b in pairs if min(values(a)) <= lowest + SAME]))
