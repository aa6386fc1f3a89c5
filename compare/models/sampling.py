"""Questions about a scene, and the Result of a model that answers them, at times that resolve its bends."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from compare.models.model import Answer, Model, Question
from compare.verdict import unit_of
from scenes.errors import SceneError, did_you_mean, listed, quoted
from scenes.expressions import Measure, measured
from scenes.formats import quantity
from scenes.free import as_dict
from scenes.loading import as_dict as parametric_as_dict
from scenes.model import UNITS, AnyScene, OwnModel
from scenes.result import Estimate, Result, Traces
from scenes.sink import Sink
from scenes.units import PLAIN, UnitError, parse_unit
from scenes.varied import of_free

BENDS = 0.1
"""Straight lines between a model's values may be off by this part of the accuracy."""
ROUNDS = 8
"""How often intervals that are too long are halved."""


def make_question(scene: AnyScene | Sink, fem3d: Result | None = None) -> Question:
    """Return the question about the probes of a scene, or about all quantities of a sink that ``fem3d`` has.

    Raises SceneError for a parameter of [model.parameters] that has no value.
    """
    if isinstance(scene, Sink):
        assert fem3d is not None
        over_time = () if fem3d.traces is None else fem3d.traces.values
        steady, traces = ({name: unit_of(name) for name in names} for names in (fem3d.steady, over_time))
        return Question(scene.name, parametric_as_dict(scene), steady, traces)
    document = as_dict(scene)
    units = {probe.name: UNITS[probe.quantity] for probe in scene.probes}
    own_model = scene.model or OwnModel()
    parameters = _parameters(scene, own_model, document)
    if parameters:
        document["model"] = {**document["model"], "parameters": parameters}
    return Question(scene.name, document, units, units, parameters, own_model.outputs)


def _parameters(scene: AnyScene, own_model: OwnModel, document: Mapping[str, object]) -> dict[str, float]:
    """Return the SI values of a model's parameters: numbers, quantities, or expressions of parameters and keys."""
    names = {} if scene.parameters is None else dict(scene.parameters.measures)
    keys = dict(_numbers(document)) if any(isinstance(given, str) for given in own_model.parameters.values()) else {}
    varied = of_free(scene) if keys else {}
    values = {}
    for name, given in own_model.parameters.items():
        if not isinstance(given, str):
            values[name] = given
            continue
        text, known = given, dict(names)
        # Keys have dots, and perhaps blanks: names of an expression stand for them, the longest first.
        for n, key in enumerate(sorted((key for key in keys if key in given), key=len, reverse=True)):
            text, stood = re.subn(rf"(?<![\w.]){re.escape(key)}(?![\w.])", f"key_{n}_", text)
            if stood:
                plane = parse_unit("m").powers if key.endswith((".x", ".y", ".z")) else PLAIN
                powers = varied[key].kind.dimension.powers if key in varied else plane
                known[f"key_{n}_"] = Measure.from_float(keys[key], powers)
        try:
            values[name] = measured(text, known)[0]
        except UnitError as error:
            reason = "" if text == given else f" ({error})"
            raise SceneError(
                f"model.parameters.{name} = {quoted(given)} is neither a quantity nor a key of the scene with a "
                f'number, nor made of its parameters{reason}: give such as "300 ohm", "box.beam.upper.y", or "w/2"'
            ) from None
    return values


def _numbers(document: object, key: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers of a document by their keys: "box.arm.upper.x"."""
    if isinstance(document, Mapping):
        for name, value in document.items():
            yield from _numbers(value, f"{key}.{name}" if key else name)
    elif isinstance(document, list):
        if len(document) == 3 and not any(isinstance(item, Mapping | list) for item in document):
            yield from ((f"{key}.{axis}", float(item)) for axis, item in zip("xyz", document, strict=True))
        for item in document:
            if isinstance(item, Mapping) and "name" in item:
                yield from _numbers(item, f"{key}.{item['name']}")
    elif isinstance(document, int | float) and not isinstance(document, bool):
        yield key, float(document)


def ask(model: Model, question: Question, times: np.ndarray | None) -> Answer:
    """Return a model's answer, checked. Raises SceneError for unknown quantities and values that are not finite."""
    answer, units = model.answer(question, times), question.units(times)
    when = "in the steady state" if times is None else "over time"
    for name, values in answer.values.items():
        if name not in units:
            raise SceneError(
                f"--model {model.name} gives {quoted(name)} {when}, which is not asked for: give {listed(list(units))}"
                f"{did_you_mean(name, units)}"
            )
        if not np.isfinite(values).all():
            at = ""
            if times is not None:
                at = f" at {quantity(float(times[np.flatnonzero(~np.isfinite(values))[0]]), 's', 3)}"
            raise SceneError(f"--model {model.name}: {quoted(name)} {when} is not a finite number{at}")
    return answer


def solve(
    model: Model, question: Question, fem3d: Result, accuracy: float, steady: bool, say: Callable[[str], None]
) -> Result:
    """Return the model's result: its steady state where 3D has one (``steady``), and traces over the time of 3D's.

    Straight lines between the traces hold a part of the ``accuracy``; for 0 they are at the times of 3D. The details
    list the quantities that are "silent". Raises SceneError where the model has none of the quantities.
    """
    say(f"asking {model.name}")
    estimates: dict[str, Estimate] = {}
    traces = None
    if steady and question.steady:
        answer = ask(model, question, None)
        estimates = {name: Estimate(float(v), answer.errors.get(name, 0.0)) for name, v in answer.values.items()}
    if fem3d.traces is not None:
        traces = _sample(model, question, fem3d.traces, accuracy)
    if not estimates and (traces is None or not traces.values):
        alone = " in the steady state, which alone is solved" if len(model.rows) and fem3d.traces is None else ""
        wanted = [*question.units(None if steady else np.empty(0))]
        raise SceneError(f"--model {model.name} says nothing of {listed(wanted)}{alone}: give at least one of them")
    names = {*(question.steady if steady else ()), *(question.over_time if traces else ())}
    silent = [n for n in dict.fromkeys([*question.steady, *question.over_time]) if n in names and n not in estimates]
    silent = [n for n in silent if traces is None or n not in traces.values]
    return Result(model.name, estimates, traces, {"silent": silent})


def _sample(model: Model, question: Question, fem3d: Traces, accuracy: float) -> Traces:
    """Return the model's traces at the times of 3D, at its own rows, and halfway wherever it bends between these."""
    if not accuracy:
        answer = ask(model, question, fem3d.time)
        return Traces(fem3d.time, dict(answer.values), {name: answer.errors.get(name, 0.0) for name in answer.values})
    # Of two equal times, between which something jumps, the first is taken a hair earlier: the later value holds.
    doubled = np.flatnonzero(np.diff(fem3d.time) <= 0)
    once = fem3d.time.copy()
    once[doubled] = np.nextafter(once[doubled], -np.inf)
    given = dict(zip(once[doubled].tolist(), fem3d.time[doubled].tolist(), strict=True))
    once = np.unique(once)
    times = np.union1d(once, model.rows[(model.rows > once[0]) & (model.rows < once[-1])])
    answer = ask(model, question, times)
    values, noise = dict(answer.values), dict.fromkeys(answer.values, 0.0)
    for _ in range(ROUNDS):
        halfway = (times[1:] + times[:-1]) / 2
        every = np.union1d(times, halfway)
        # A model that repeats its answers need not answer twice, but each run has to end with the last time.
        asked = np.union1d(halfway, times[-1:]) if model.exact else every
        answer = ask(model, question, asked)
        at, again, bent = np.searchsorted(every, asked), np.isin(every, times), np.zeros(len(every), bool)
        for name in values.keys() & answer.values.keys():
            line = np.interp(every, times, values[name])
            values[name] = line.copy()
            values[name][at] = answer.values[name]
            off = np.abs(values[name] - line)
            noise[name] = max(noise[name], float(off[again].max()))
            least = accuracy * BENDS * max(float(np.ptp(values[name])), float(np.ptp(fem3d.values[name])))
            bent |= ~again & (off > least + noise[name])
        values = {name: course[again | bent] for name, course in values.items()}
        times = every[again | bent]
        if not bent.any():
            break
    errors = {name: answer.errors.get(name, 0.0) + noise[name] for name in values}
    return Traces(np.array([given.get(t, t) for t in times.tolist()]), values, errors)
