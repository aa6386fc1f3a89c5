"""How the quantities of a sink follow its keys, in 3D: steady and over time, from a run that is there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any

import numpy as np

from fem3d.results.study import Study
from fem3d.runs import sink as sink_run
from fem3d.sensitivity import over_time
from fem3d.sensitivity import steady as steady_slopes
from fem3d.sensitivity.motion import STEP
from fem3d.sensitivity.steady import Table
from meshes import symmetry
from scenes import physics
from scenes.model import Probe
from scenes.result import Estimate, Result
from scenes.sink import Sink
from scenes.varied import neighbour, numbers

VOLTAGE = "drive.voltage"
PROFILE = "profile"


@dataclass(frozen=True, eq=False)
class Course:
    """d ln quantity / d ln key (times,) at ``times`` (s), by key and quantity, and errors, the largest over time."""

    times: np.ndarray
    values: dict[str, dict[str, np.ndarray]]
    errors: dict[str, dict[str, float]]


@dataclass(frozen=True)
class Slopes:
    """d ln quantity / d ln key, by key and quantity: ``steady`` with errors, and the ``course`` of the traces (of
    rises, for temperatures) where the run has them; ``left_out`` says why a key has none. ``profile``: what a sum of
    the profile's rises changes with each key (K)."""

    steady: Table
    course: Course | None
    left_out: dict[str, str] = field(default_factory=dict)
    profile: dict[str, float] = field(default_factory=dict)


def of_sink(
    sink: Sink,
    result: Result,
    instants: Sequence[float] = (),
    keys: Sequence[str] | None = None,
    weights: np.ndarray | None = None,
) -> Slopes:
    """The derivatives of a result of `fem3d.runs.sink.solve` by every physical key whose value is a number other than
    zero; those of the traces at some ``instants`` (s) too. ``keys`` are these alone. With ``weights`` (places,) of the
    rises of its profile also what their sum changes with each key, at places that go along. Raises ConvergenceError."""
    answer = result.details["answer"]
    state, response = answer.fine.state, answer.response

    @cache
    def study(key: str = "") -> Study:
        other = neighbour(sink, key, STEP) if key else sink
        return sink_run.study(other, symmetry.reduce(other.scene()))

    others = {key: partial(study, key) for key in keys or numbers(sink)}
    by, left_out = steady_slopes.motions(study(), state.heat.domain, others)
    known = {name: e for name, e in result.steady.items() if name in answer.fine.quantities}
    rows = dict[str, np.ndarray]()
    if weights is not None:
        at = [tuple(point) for point in result.details["profile"]["points_m"]]
        domain: Any = state.heat.domain
        rows[PROFILE] = sum(w * domain.mean(Probe("", x, x)) for w, x in zip(weights, at, strict=True))
    one = dict.fromkeys(rows, Estimate(1.0, 0.0))
    steady, _ = steady_slopes.steady_table(study(), state, steady_slopes.Known(known | one, {}, rows), by)
    profile = {key: by_name.pop(PROFILE).value for key, by_name in steady.items() if PROFILE in by_name}
    if sink.spans > 1 and VOLTAGE in steady:
        # The power of a row is the current's times the voltage, which is the key itself.
        current = steady[VOLTAGE]["current_A"]
        steady[VOLTAGE]["power_W"] = Estimate(1 + current.value, current.error)
    course = None
    if response is not None and (why := physics.nonlinear(study().part.scene, True)):
        left_out = left_out | {"the traces": f"{why}, and a sensitivity is then one of the steady state alone"}
    elif response is not None:
        beside = {key: others[key] for key in by}
        absolute, _ = over_time.over_time(study(), response.transient, beside, instants)
        course = _logarithmic(absolute, steady, {n: e / response.scales[n] for n, e in response.errors.items()})
    return Slopes(steady, course, left_out, profile)


def _logarithmic(absolute: over_time.Course, steady: Table, relative: Mapping[str, float]) -> Course:
    """A course relative to its traces, whose errors are ``relative`` ones of the traces, those of the ``steady``
    derivatives, and what less fields and steps make of it."""
    values, errors = dict[str, dict[str, np.ndarray]](), dict[str, dict[str, float]]()
    for key, by_name in absolute.values.items():
        values[key] = {n: v / absolute.traces[n] for n, v in by_name.items()}
        errors[key] = {
            n: float(np.abs(absolute.less[key][n] / absolute.traces[n]).max() + np.abs(v).max() * relative[n])
            + steady[key][n.replace("_K", "_rise_K")].error
            for n, v in values[key].items()
        }
    return Course(absolute.times, values, errors)
