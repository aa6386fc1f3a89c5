"""A model's answers to what 3D found: steady, and at times so dense that straight lines between them suffice."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from compare.verdict import unit_of
from scenes.errors import SceneError, did_you_mean, listed, quoted
from scenes.expressions import Measure, measured
from scenes.formats import quantity
from scenes.free import as_dict
from scenes.model import UNITS, AnyScene, OwnModel
from scenes.result import Estimate, Result, Traces
from scenes.sink import Sink
from scenes.units import UnitError
from validate.models import Answer, Asked, Model

BENDS = 0.1
"""Straight lines between a model's values may be off by this part of the accuracy before it is asked between them."""
ROUNDS = 8
"""How often intervals that are too long are halved."""
SHORT = 1e-7
"""Intervals shorter than this part of the run belong to a jump and are not halved."""
MOST = 20_000
"""The most times that a model is asked for."""


def of_sink(sink: Sink, fem3d: Result) -> Asked:
    """What a model of a sink is asked for: all that 3D has answered, by the names of summary.json and traces.csv."""
    from scenes.loading import as_dict as of_parametric

    over_time = () if fem3d.traces is None else fem3d.traces.values
    steady = {name: unit_of(name) for name in fem3d.steady}
    return Asked(sink.name, of_parametric(sink), steady, {name: unit_of(name) for name in over_time}, {}, {})


def of_scene(scene: AnyScene) -> Asked:
    """What a model of a scene of boxes, or on a mesh, is asked for: its probes. Raises SceneError for a parameter
    that is neither a quantity, nor a key of the scene, nor made of its parameters."""
    document = as_dict(scene)
    units = {probe.name: UNITS[probe.quantity] for probe in scene.probes}
    own_model = scene.model or OwnModel()
    measures = {} if scene.parameters is None else scene.parameters.measures()
    parameters = {name: _value(name, value, document, measures) for name, value in own_model.parameters}
    if parameters:
        # A model sees numbers: what they are made of is the scene's affair.
        document["model"] = {**document["model"], "parameters": parameters}
    return Asked(scene.name, document, units, units, parameters, dict(own_model.outputs))


def _value(name: str, given: float | str, document: Mapping[str, Any], known: Mapping[str, Measure]) -> float:
    """The value of a model's parameter in SI units: a number, a quantity, an expression of the scene's parameters,
    which are ``known``, or the value of a key of the scene."""
    if not isinstance(given, str):
        return given
    try:
        return measured(given, known)[0]
    except UnitError:
        value = _at(given, document)
    if isinstance(value, bool) or not isinstance(value, float | int):
        raise SceneError(
            f"model.parameters.{name} = {quoted(given)} is neither a quantity nor a key of the scene with a number, "
            'nor made of its parameters: give such as "300 ohm", "box.beam.upper.y", or "w/2"'
        )
    return float(value)


def _at(key: str, document: Any) -> Any:
    """What stands in a document at a key, "box.arm.upper.x"; ``None`` where there is nothing."""
    if isinstance(document, list):
        if document and not isinstance(document[0], Mapping):
            return document["xyz".index(key)] if len(document) == 3 and key in ("x", "y", "z") else None
        # Names may have dots in them: the longest that fits.
        named = sorted((i for i in document if key.startswith(f"{i.get('name')}.")), key=lambda i: -len(i["name"]))
        return _at(key.removeprefix(f"{named[0]['name']}."), named[0]) if named else None
    if not isinstance(document, Mapping):
        return None
    first, _, rest = key.partition(".")
    return _at(rest, document.get(first)) if rest else document.get(first)


def solve(
    model: Model, question: Asked, fem3d: Result, accuracy: float, steady: bool, say: Callable[[str], None]
) -> Result:
    """The model's own result: its steady state where 3D has one (``steady``), and its traces over the time of 3D's, at
    so many times that straight lines between them hold a part of the ``accuracy``; 0: at those of 3D.

    ``details`` say which quantities it says nothing of. Raises SceneError for an answer that is none: not by
    quantity, of another shape, not finite, or of nothing that is asked for.
    """
    say(f"asking {model.name}")
    estimates: dict[str, Estimate] = {}
    traces = None
    if steady and question.steady:
        answer, errors = checked(model, model.steady(question), question.steady, None)
        estimates = {name: Estimate(float(value), errors.get(name, 0.0)) for name, value in answer.items()}
    if fem3d.traces is not None:
        traces = (_over_time if accuracy else _at_its_times)(model, question, fem3d.traces, accuracy)
    if not estimates and (traces is None or not traces.values):
        wanted = [*question.steady] if steady else [*question.over_time]
        courses = len(model.rows(question)) and fem3d.traces is None
        alone = " in the steady state, which alone is solved" if courses else ""
        raise SceneError(f"--model {model.name} says nothing of {listed(wanted)}{alone}: give at least one of them")
    names = {*(question.steady if steady else ()), *(question.over_time if traces else ())}
    silent = [n for n in dict.fromkeys([*question.steady, *question.over_time]) if n in names and n not in estimates]
    silent = [n for n in silent if traces is None or n not in traces.values]
    return Result(model.name, estimates, traces, {"silent": silent})


def _at_its_times(model: Model, question: Asked, three: Traces, _: float) -> Traces:
    """The model's traces at the times of 3D's."""
    values, errors = checked(model, model.over_time(question, three.time), question.over_time, three.time)
    return Traces(three.time, values, {name: errors.get(name, 0.0) for name in values})


def _over_time(model: Model, question: Asked, three: Traces, accuracy: float) -> Traces:
    """The model's traces at the times of 3D's, its own rows, and wherever it bends between them."""
    once, instead = _ascending(three.time)
    rows = model.rows(question)
    times = np.union1d(once, rows[(rows > once[0]) & (rows < once[-1])])
    values: dict[str, np.ndarray] = {}
    errors: Mapping[str, float] = {}
    answers = (_Once if getattr(model, "smooth", False) else _Asking)(model, question).at
    noise = dict.fromkeys(question.over_time, 0.0)
    for _ in range(ROUNDS):
        before = values
        wide = np.diff(times) > SHORT * times[-1]
        middle = ((times[1:] + times[:-1]) / 2)[wide]
        every = np.union1d(times, middle)
        values, errors = answers(every)
        wanted = np.zeros(len(every), bool)
        for name, course in values.items():
            if name in before:
                # The same times again: what a model answers otherwise than before is its noise.
                noise[name] = max(noise[name], float(np.abs(course[np.isin(every, times)] - before[name]).max()))
            least = accuracy * BENDS * max(float(np.ptp(course)), float(np.ptp(three.values[name])))
            off = np.abs(course - np.interp(every, times, course[np.isin(every, times)]))
            wanted |= off > least
        kept = wanted | np.isin(every, times)
        values = {name: course[kept] for name, course in values.items()}
        times = every[kept]
        if not wanted.any() or len(times) > MOST:
            break
    back = np.array([instead.get(float(t), float(t)) for t in times])
    return Traces(back, values, {name: errors.get(name, 0.0) + noise[name] for name in values})


@dataclass
class _Asking:
    """A model's answers over time, as numbers."""

    model: Model
    question: Asked

    def at(self, times: np.ndarray) -> tuple[dict[str, np.ndarray], Mapping[str, float]]:
        """Values (times,) by quantity, and errors."""
        return checked(self.model, self.model.over_time(self.question, times), self.question.over_time, times)


@dataclass
class _Once(_Asking):
    """Those of a model without noise, which is asked about no time twice but the last."""

    times: np.ndarray = field(default_factory=lambda: np.empty(0))
    values: dict[str, np.ndarray] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)

    def at(self, times: np.ndarray) -> tuple[dict[str, np.ndarray], Mapping[str, float]]:
        new = np.union1d(np.setdiff1d(times, self.times), times[-1:])
        answered, errors = super().at(new)
        every = np.union1d(self.times, new)
        for name, course in answered.items():
            merged = np.empty(len(every))
            merged[np.searchsorted(every, self.times)] = self.values.get(name, np.empty(0))
            merged[np.searchsorted(every, new)] = course
            self.values[name] = merged
            self.errors[name] = max(self.errors.get(name, 0.0), errors.get(name, 0.0))
        self.times = every
        return {name: course[np.isin(every, times)] for name, course in self.values.items()}, self.errors


def _ascending(times: np.ndarray) -> tuple[np.ndarray, dict[float, float]]:
    """Times that ascend, and which stand for others: of two equal ones, between which something jumps, the first is
    taken a hair earlier, for at a jump the later value holds."""
    once, instead = times.copy(), {}
    for n in np.flatnonzero(np.diff(times) <= 0):
        once[n] = np.nextafter(times[n], -np.inf)
        instead[float(once[n])] = float(times[n])
    return np.unique(once), instead


def checked(
    model: Model, given: Answer, known: Mapping[str, str], times: np.ndarray | None
) -> tuple[dict[str, np.ndarray], Mapping[str, float]]:
    """The values as numbers of the right shape. Raises SceneError."""
    answer, errors = given
    when, shape = ("in the steady state", ()) if times is None else ("over time", (len(times),))
    values = {}
    for name, value in answer.items():
        if name not in known:
            raise SceneError(
                f"--model {model.name} gives {quoted(str(name))} {when}, which is not asked for: give "
                f"{listed(list(known))}{did_you_mean(str(name), known)}"
            )
        values[name] = _numbers(model, name, value, shape, when)
        if not np.isfinite(values[name]).all():
            at = ""
            if times is not None:
                first = float(times[np.flatnonzero(~np.isfinite(values[name]))[0]])
                at = f" at {quantity(first, 's', 3)}"
            raise SceneError(f"--model {model.name}: {quoted(name)} {when} is not a finite number{at}")
    return values, errors


def _numbers(model: Model, name: str, value: Any, shape: tuple[int, ...], when: str) -> np.ndarray:
    what = f"{shape[0]} numbers, one for each time" if shape else "one number"
    try:
        numbers = np.ma.asarray(value)
        if numbers.dtype.kind not in "fiu":
            raise TypeError
        array = np.ma.filled(numbers.astype(float), np.nan)  # what is masked is not known
    except (TypeError, ValueError):
        raise SceneError(
            f"--model {model.name}: {quoted(name)} {when} is {quoted(type(value).__name__)} that holds no real "
            f"numbers: give {what}"
        ) from None
    if array.size == 1:
        return np.broadcast_to(array.reshape(()), shape).astype(float)
    if array.shape != shape:
        size = " x ".join(map(str, array.shape))
        raise SceneError(f"--model {model.name}: {quoted(name)} {when} has {size} numbers: give {what}")
    return array
