"""A model that is an FMU, run by fmpy in a process of its own, so that a fault in it is a sentence here.

The scene's values are the start values of its parameters and inputs. For the steady state its runs get ever longer
(`Fmu.settle`).
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from importlib.util import find_spec
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from compare.data.columns import find_unit
from compare.models.model import (
    LONGEST,
    STEPS,
    Answer,
    Question,
    Simulation,
    check_parameters,
    find_file,
    match_outputs,
)
from compare.worker import Worker
from scenes.errors import SceneError, printable, quoted
from scenes.formats import quantity
from scenes.units import ICE_POINT, TEMPERATURE, parse_unit

HORIZONS = tuple(10.0**n for n in range(-6, 7))
"""Ends (s) of the runs to the steady state, from below the time constants of a film to eleven days."""
REST = 1e-6
"""An output rests where it changes by at most this part of its whole change in the second half of a run."""


class Unit(NamedTuple):
    """The unit that an FMU declares for a variable, SI where it declares none.

    ``factor`` * value + ``offset`` is in SI units; ``powers`` (of m, kg, s, A, K) are empty in an unknown unit.
    """

    name: str = ""
    powers: tuple[Any, ...] | None = None
    factor: float = 1.0
    offset: float = 0.0


class Fmu(Simulation):
    """An FMU unpacked in a ``folder``, and the units of its variables that can be set and read."""

    def __init__(
        self, name: str, folder: TemporaryDirectory[str], settable: Mapping[str, Unit], readable: Mapping[str, Unit]
    ) -> None:
        self.name, self._folder, self._settable, self._readable = name, folder, settable, readable
        self._worker = Worker("it", quiet=True)

    def settle(self, question: Question) -> Answer:
        """Run the FMU to ends that are ten times later each, and return the end of the longest run that rests.

        A run rests where the outputs moved, and then stayed for as long again; this does not depend on a scale of time.
        All ends are tried, because an FMU may move again. A run that fails has too long steps and ends the series.
        Raises SceneError where no run rests.
        """
        rested: Answer | None = None
        failure: SceneError | None = None
        last, until = 0.0, time.monotonic() + LONGEST / 10
        for end in HORIZONS:
            try:
                run = self._run(question, question.steady, end, STEPS[0], until - time.monotonic())
            except SceneError as error:
                failure = error
                if last:
                    break
                continue
            last, values = end, np.array(list(run.values.values()))
            change, rounding = np.ptp(values, axis=1), 1e-12 * np.abs(values).max(axis=1)
            late = np.ptp(values[:, values.shape[1] // 2 :], axis=1)
            moved = (change > rounding).any() or end == HORIZONS[-1]
            if moved and (late <= REST * change + rounding).all():
                errors = dict(zip(run.values, late.tolist(), strict=True))
                rested = Answer({name: v[-1] for name, v in run.values.items()}, errors)
        if rested is None and not last and failure is not None:
            raise failure
        if rested is None:
            why = "" if failure is None else f": {failure}"
            raise SceneError(f"it does not come to rest within {quantity(last, 's')}{why}")
        return rested

    def simulate(self, question: Question, end: float, steps: int) -> Answer:
        return self._run(question, question.over_time, end, steps, LONGEST)

    def _run(self, question: Question, wanted: Mapping[str, str], end: float, steps: int, seconds: float) -> Answer:
        """Return a run to an end (s), which may take some seconds, in SI units."""
        check_parameters("parameter or input", question.parameters, self._settable)
        outputs = match_outputs("variable", question, wanted, self._readable)
        read = {name: self._readable[variable] for name, variable in outputs.items()}
        units = {name: self._settable[name] for name in question.parameters}
        needed = [(f"{quoted(own)}, for {quoted(name)},", read[name], wanted[name]) for name, own in outputs.items()]
        for called, unit, symbol in needed + [(quoted(name), unit, "") for name, unit in units.items()]:
            if unit.powers == () or (symbol and unit.powers not in (None, parse_unit(symbol).powers)):
                known = symbol or "a unit that is known"
                raise SceneError(f"{called} is in {quoted(unit.name)}, not in {known}")
        start = {name: (v - units[name].offset) / units[name].factor for name, v in question.parameters.items()}
        names = list(outputs.values())
        try:
            rows = self._worker.run(max(seconds, 0.1), simulate, self._folder.name, end, steps, start, names)
        except SceneError:
            raise
        except Exception as error:
            raise SceneError(f"it failed: {printable(str(error), 200)}") from None
        if rows["time"][-1] < end - end / steps / 2:
            stop = quantity(rows["time"][-1], "s")
            raise SceneError(f"it stops at {stop} of {quantity(end, 's')}: a step of it says that it failed")
        values = {name: rows[outputs[name]] * unit.factor + unit.offset for name, unit in read.items()}
        if not np.isfinite([*values.values()]).all():
            raise SceneError("it has an output that is not finite")
        return Answer(values, time=rows["time"])


def open_model(given: str, folder: str) -> Fmu:
    """Return the FMU of a file. Raises SceneError where it cannot be read."""
    path = find_file(given, folder, "an FMU, such as bridge.fmu")
    if find_spec("fmpy") is None:
        raise SceneError("it is run by fmpy: pip install 'heated-microstructure-validation[fmu]'")
    from fmpy import extract, read_model_description

    unpacked = TemporaryDirectory()
    try:
        description = read_model_description(str(path), validate=False)
        extract(str(path), unpacked.name)
    except Exception as error:
        raise SceneError(f"it is no FMU that can be read ({printable(str(error), 120)})") from None
    definitions = {unit.name: unit.baseUnit for unit in description.unitDefinitions}
    settable, others = {}, {}
    for variable in description.modelVariables:
        unit = _declared_unit(variable, definitions)
        if variable.causality in ("parameter", "input"):
            settable[variable.name] = unit
        if variable.causality != "parameter":
            others[variable.name] = unit
    return Fmu(path.name, unpacked, settable, others)


def _declared_unit(variable: Any, definitions: Mapping[str, Any]) -> Unit:
    """The unit that an FMU declares for a variable: by its BaseUnit, or else by its name."""
    kind = variable.declaredType
    name = variable.unit or (kind.unit if kind else None) or ""
    base = definitions.get(name)
    if base is not None:
        relative = variable.relativeQuantity or (kind and kind.relativeQuantity)
        # A mole or a candela is in no unit of ours, so that these powers fit no probe.
        powers = tuple(int(getattr(base, symbol)) for symbol in ("m", "kg", "s", "A", "K", "mol", "cd"))
        powers = powers if any(powers[5:]) else powers[:5]
        if relative and powers == TEMPERATURE.powers:
            name, powers = f"{name} as a difference", ()
        return Unit(name, powers, float(base.factor), 0.0 if relative else float(base.offset))
    unit = find_unit(name)
    if unit is None:
        return Unit(name, () if name else None)
    return Unit(name, unit.powers, float(unit.factor), float(ICE_POINT) * unit.celsius)


def simulate(folder: str, end: float, steps: int, start: Mapping[str, float], outputs: list[str]) -> Any:
    """Run an unpacked FMU from 0 to ``end`` (s), and return "time" and outputs in its own units; for a process of its
    own."""
    from fmpy import simulate_fmu

    columns = simulate_fmu(
        folder, validate=False, stop_time=end, output_interval=end / steps, step_size=end / steps, output=outputs,
        start_values=dict(start), relative_tolerance=1e-2 / steps, record_events=False,
    )  # fmt: skip
    return {name: columns[name].astype(float) for name in ("time", *outputs)}
