"""The interface of all 1D and lumped models: a question about a scene, and the answer and the Result of a model."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from compare.course import ascending
from compare.data.columns import Column, plain_name, refusing
from compare.verdict import unit_of
from scenes.errors import SceneError, listed, quoted, unknown
from scenes.expressions import Measure, measured
from scenes.formats import quantity
from scenes.free import as_dict
from scenes.loading import as_dict as parametric_as_dict
from scenes.model import UNITS, AnyScene, OwnModel
from scenes.result import Estimate, Result, Traces
from scenes.sink import Sink
from scenes.units import PLAIN, UnitError, called, parse_unit
from scenes.varied import of_free

LONGEST = 600.0
"""s by the clock that a model may take for one answer; 3D itself takes minutes at most."""
STEPS = (500, 2000)
"""The least number of steps of the two runs of a simulation, each with a relative tolerance of 0.01 over that."""


@dataclass(frozen=True)
class Question:
    """A scene as a model sees it.

    Attributes
    ----------
    scene : a sink or a free scene
    units : of the quantities that 3D has, by name
    times : (n,) s, ascending; None in the steady state
    parameters, outputs : of the scene's [model]: values (SI), and the model's own names of quantities
    """

    scene: AnyScene | Sink
    units: Mapping[str, str]
    times: NDArray[np.float64] | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)

    @property
    def when(self) -> str:
        return "in the steady state" if self.times is None else "over time"

    @property
    def document(self) -> dict[str, object]:
        """The scene in SI numbers, as summary.json has it."""
        document = parametric_as_dict(self.scene) if isinstance(self.scene, Sink) else as_dict(self.scene)
        if self.parameters:
            document["model"]["parameters"] = self.parameters
        return document


@dataclass(frozen=True)
class Model:
    """A 1D or lumped model of a scene.

    Attributes
    ----------
    name : in reports
    answer : the function of the values at a question's times, or at own rows up to the last of these
    exact : whether answers repeat to rounding

    Notes
    -----
    The answer to a question about the steady state is one row at infinite time. Some values may have an error. The
    function raises SceneError, before which `ask` puts the name of the model.
    """

    name: str
    answer: Callable[[Question], Traces] = field(repr=False)
    exact: bool = field(default=False, repr=False)

    def ask(self, question: Question) -> Traces:
        """Return the answer at the question's times, linear between its own rows, checked; all values have an error.

        Raises SceneError for unknown quantities and values that are not finite.
        """
        with refusing(f"the model {quoted(self.name)}"):
            answer = self.answer(question)
            for name, values in answer.values.items():
                if name not in question.units:
                    raise unknown(f"no quantity {question.when} is", name, question.units)
                if (gaps := np.flatnonzero(~np.isfinite(values))).size:
                    at = question.when if question.times is None else f"at {quantity(float(answer.time[gaps[0]]), 's')}"
                    raise SceneError(f"{quoted(name)} {at} is not a finite number")
        errors = {name: answer.errors.get(name, 0.0) for name in answer.values}
        if question.times is None:
            return replace(answer, errors=errors)
        between = {name: np.interp(question.times, answer.time, v) for name, v in answer.values.items()}
        return Traces(question.times, between, errors)

    def solve(self, scene: AnyScene | Sink, fem3d: Result, say: Callable[[str], None]) -> Result:
        """Return the model's result: its steady state where 3D has one, and traces at the times of 3D's and at seven
        between two of them, where a model may bend or jump.

        The details hold it as "own_model", and "warnings" of quantities that it leaves out. Raises SceneError where it
        has none of them.
        """
        say(f"asking {self.name}")
        steady, traces, wanted = dict[str, Estimate](), None, list[str]()
        if fem3d.steady:
            question = make_question(scene, fem3d)
            at_rest = self.ask(question)
            steady = {name: Estimate(float(v[0]), at_rest.errors[name]) for name, v in at_rest.values.items()}
            wanted += question.units
        if fem3d.traces is not None:
            rows = np.arange(len(fem3d.traces.time))
            times = np.unique(np.interp(np.arange(8 * rows[-1] + 1) / 8, rows, ascending(fem3d.traces.time)))
            question = make_question(scene, fem3d, times)
            traces = self.ask(question)
            wanted += question.units
        over_time = {} if traces is None else traces.values
        silent = [name for name in dict.fromkeys(wanted) if name not in {*steady, *over_time}]
        said = f"{self.name} has no value of {listed(silent)}" if silent else ""
        if not (steady or over_time):
            raise SceneError(f"{said}: give at least one of them")
        warnings = [f"{said}, which {'have' if len(silent) > 1 else 'has'} no check"] * bool(silent)
        if not isinstance(scene, Sink):  # whose temperatures are rises
            pairs = [(n, own.value, fem3d.steady[n].value) for n, own in steady.items()]
            pairs += [(n, float(v.min()), float(fem3d.over_time.values[n].min())) for n, v in over_time.items()]
            warnings += [
                f"{self.name} has {quantity(one, 'K')} for {quoted(n)}, and absolute kelvins are compared: add the "
                "initial temperature to a rise, 273.15 to degrees Celsius"
                for n, one, three in pairs
                if question.units[n] == "K" and one < max(three / 2, three - 250)
            ][:1]
        return Result(self.name, steady, traces, {"own_model": self, "warnings": warnings})


def make_question(
    scene: AnyScene | Sink, fem3d: Result | None = None, times: NDArray[np.float64] | None = None
) -> Question:
    """Return the question about the probes of a scene, or about all quantities of a sink that ``fem3d`` has.

    Raises SceneError for a parameter of [model.parameters] that has no value.
    """
    if isinstance(scene, Sink):
        assert fem3d is not None
        names = fem3d.steady if times is None else fem3d.over_time.values
        return Question(scene, {name: unit_of(name) for name in names}, times)
    own_model, units = scene.model or OwnModel(), {probe.name: UNITS[probe.quantity] for probe in scene.probes}
    return Question(scene, units, times, _parameters(scene, own_model), own_model.outputs)


def _parameters(scene: AnyScene, own_model: OwnModel) -> dict[str, float]:
    """Return the SI values of a model's parameters: numbers, quantities, or expressions of parameters and keys."""
    if not own_model.parameters:
        return {}
    known = {} if scene.parameters is None else dict(scene.parameters.measures)
    keys, varied, values = dict(_numbers(as_dict(scene))), of_free(scene), dict[str, float]()
    for name, given in own_model.parameters.items():
        text = str(given)
        # Keys have dots, and perhaps blanks: names of an expression stand for them, the longest first.
        for n, key in enumerate(sorted((key for key in keys if key in text), key=len, reverse=True)):
            text = re.sub(rf"(?<![\w.]){re.escape(key)}(?![\w.])", f"key_{n}_", text)
            plane = parse_unit("m").powers if key.endswith((".x", ".y", ".z")) else PLAIN
            powers = varied[key].kind.dimension.powers if key in varied else plane
            known[f"key_{n}_"] = Measure.from_float(keys[key], powers)
        try:
            values[name] = measured(text, known)[0]
        except UnitError:
            raise SceneError(
                f"model.parameters.{name} = {quoted(given)} is neither a quantity nor a key of the scene with a "
                f'number, nor made of its parameters: give such as "300 ohm", "box.beam.upper.y", or "w/2"'
            ) from None
    return values


def _numbers(document: object, key: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers of a document by their keys: "box.arm.upper.x"."""
    items: Iterable[tuple[str, object]] = ()
    if isinstance(document, Mapping):
        items = document.items()
    elif isinstance(document, list):
        items = [(item["name"], item) for item in document if isinstance(item, Mapping) and "name" in item]
        items = items or (zip("xyz", document, strict=True) if len(document) == 3 else ())
    elif isinstance(document, int | float) and not isinstance(document, bool):
        yield key, float(document)
    for name, value in items:
        yield from _numbers(value, f"{key}.{name}" if key else name)


def run_twice(run: Callable[[int], Traces]) -> Traces:
    """Return the finer of two runs, of at least so many steps each, with an error by their difference."""
    coarse, fine = map(run, STEPS)
    # A jump of an output takes a whole step here: the two runs differ most at the end of the short step, by all
    # but its part of the long one, and right after the jump the short one is off by all of it.
    share = STEPS[1] / (STEPS[1] - STEPS[0])
    off = {name: v - np.interp(fine.time, coarse.time, coarse.values[name]) for name, v in fine.values.items()}
    return replace(fine, errors={name: share * float(np.abs(each).max()) for name, each in off.items()})


def find_file(given: str, folder: str, example: str) -> Path:
    """Return the path of a model's file. Raises SceneError where there is none."""
    path = Path(folder, given)
    if not path.is_file():
        raise SceneError(f"{quoted(path)} is no file: give {example}")
    return path


def match_outputs(
    noun: str, outputs: Mapping[str, str], wanted: Mapping[str, str], own: Mapping[str, Column]
) -> dict[str, str]:
    """Return the model's own name of each wanted probe that it has: of the scene's ``outputs``, or alike.

    Raises SceneError where it has none of them, or not the given one, or not in a unit that is alike to the ``wanted``
    one; ``noun`` is the kind of its names.
    """
    plain = {plain_name(name): name for name in own}
    alike = {p: p if p in own else plain[plain_name(p)] for p in wanted if plain_name(p) in plain}
    found = alike | {probe: name for probe, name in outputs.items() if probe in wanted}
    for probe, name in found.items():
        if name not in own:
            raise unknown(f"for {quoted(probe)} it has no {noun}", name, own)
        column, symbol = own[name], wanted[probe]
        if column.powers not in (None, parse_unit(symbol).powers):
            other = column.note or called(column.powers)
            raise SceneError(f"{quoted(name)}, for {quoted(probe)}, is {other}, not in {symbol}: give one in {symbol}")
    if not found:
        has = listed(sorted(own)) if own else "none"
        raise SceneError(
            f'it has no {noun} called as a probe ({", ".join(wanted)}), but {has}: say [model.outputs] probe = "name"'
        )
    return found
