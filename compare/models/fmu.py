"""A model that is an FMU, run by fmpy in a process of its own, so that a fault in it is a sentence here.

The scene's values are the start values of its parameters and inputs. For the steady state its runs get ever longer
(`Fmu._settle`).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from importlib.util import find_spec
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any, NamedTuple

import numpy as np

from compare.data.columns import find_unit
from compare.models.model import LONGEST, STEPS, Answer, Model, Question, find_file, match_outputs, run_twice
from compare.worker import Worker
from scenes.errors import SceneError, printable, quoted, unknown
from scenes.formats import quantity
from scenes.units import ICE_POINT, TEMPERATURE, parse_unit

HORIZONS = tuple(10.0**n for n in range(-6, 7))
"""Ends (s) of the runs to the steady state, from below the time constants of a film to eleven days."""


class Unit(NamedTuple):
    """The unit that an FMU declares for a variable, SI where it declares none.

    ``factor`` * value + ``offset`` is in SI units; ``powers`` (of m, kg, s, A, K, mol, cd) are () in an unknown unit.
    """

    name: str = ""
    powers: tuple[Any, ...] | None = None
    factor: float = 1.0
    offset: float = 0.0


class Fmu(Model):
    """An FMU unpacked in a ``folder``, and the units of its variables that can be set and read."""

    def __init__(
        self, name: str, folder: TemporaryDirectory[str], settable: Mapping[str, Unit], readable: Mapping[str, Unit]
    ) -> None:
        self.name, self._folder, self._settable, self._readable = name, folder, settable, readable
        self._worker = Worker("it", quiet=True)

    def answer(self, question: Question) -> Answer:
        if question.times is None:
            return self._settle(question)
        return run_twice(partial(self._run, question, float(question.times[-1])))

    def _settle(self, question: Question) -> Answer:
        """Run the FMU to ends that are ten times later each, and return the end of the longest run that rests.

        A run rests where the outputs moved, and then stayed for as long again, to a millionth of the change; this does
        not depend on a scale of time.
        All ends are tried, because an FMU may move again. A run that fails has too long steps and ends the series.
        Raises SceneError where no run rests.
        """
        rested: Answer | None = None
        failure: SceneError | None = None
        last, until = 0.0, monotonic() + LONGEST / 10
        for end in HORIZONS:
            try:
                _, run = self._run(question, end, STEPS[0], until - monotonic())
            except SceneError as error:
                failure = error
                if last:
                    break
                continue
            last, values = end, np.array(list(run.values()))
            change, rounding = np.ptp(values, axis=1), 1e-12 * np.abs(values).max(axis=1)
            late = np.ptp(values[:, values.shape[1] // 2 :], axis=1)
            moved = (change > rounding).any() or end == HORIZONS[-1]
            if moved and (late <= 1e-6 * change + rounding).all():
                errors = dict(zip(run, late.tolist(), strict=True))
                rested = Answer({name: v[-1] for name, v in run.items()}, errors)
        if rested is None and not last and failure is not None:
            raise failure
        if rested is None:
            why = "" if failure is None else f": {failure}"
            raise SceneError(f"it does not come to rest within {quantity(last, 's')}{why}")
        return rested

    def _run(
        self, question: Question, end: float, steps: int, seconds: float = LONGEST
    ) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Return the times (s) and the quantities, in SI units, of a run to an end (s) that may take some seconds."""
        from fmpy import simulate_fmu

        for name in question.parameters:
            if name not in self._settable:
                raise unknown("it has no parameter or input in a known unit", name, self._settable)
        outputs = match_outputs("variable", question.outputs, question.units, self._readable)
        units = {name: self._readable[own] for name, own in outputs.items()}
        for name, unit in units.items():
            symbol = question.units[name]
            if unit.powers not in (None, (*parse_unit(symbol).powers, 0, 0)):
                own = f"{quoted(outputs[name])}, for {quoted(name)},"
                raise SceneError(f"{own} is in {quoted(unit.name)}, not in {symbol}")
        given = {name: (value, self._settable[name]) for name, value in question.parameters.items()}
        start = {name: (value - unit.offset) / unit.factor for name, (value, unit) in given.items()}
        simulate = partial(
            simulate_fmu, self._folder.name, validate=False, stop_time=end, output_interval=end / steps,
            step_size=end / steps, output=list(outputs.values()), start_values=start, relative_tolerance=1e-2 / steps,
            record_events=False,
        )  # fmt: skip
        try:
            rows = self._worker.run(max(seconds, 0.1), simulate)
        except SceneError:
            raise
        except Exception as error:
            raise SceneError(f"it failed: {printable(str(error), 200)}") from None
        if rows["time"][-1] < end - end / steps / 2:
            stop = quantity(float(rows["time"][-1]), "s")
            raise SceneError(f"it stops at {stop} of {quantity(end, 's')}: a step of it says that it failed")
        values = {name: rows[outputs[name]] * unit.factor + unit.offset for name, unit in units.items()}
        if not np.isfinite([*values.values()]).all():
            raise SceneError("it has an output that is not finite")
        return rows["time"], values


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
    variables = [(each, _declared_unit(each, definitions)) for each in description.modelVariables]
    settable = {v.name: u for v, u in variables if v.causality in ("parameter", "input") and u.powers != ()}
    readable = {v.name: u for v, u in variables if v.causality != "parameter"}
    return Fmu(path.name, unpacked, settable, readable)


def _declared_unit(variable: Any, definitions: Mapping[str, Any]) -> Unit:
    """The unit that an FMU declares for a variable: by its BaseUnit, or else by its name."""
    kind = variable.declaredType
    name = variable.unit or (kind.unit if kind else None)
    if not name:
        return Unit()
    if (base := definitions.get(name)) is not None:
        relative = variable.relativeQuantity or (kind and kind.relativeQuantity)
        powers = tuple(int(getattr(base, symbol)) for symbol in ("m", "kg", "s", "A", "K", "mol", "cd"))
        if relative and powers == (*TEMPERATURE.powers, 0, 0):
            return Unit(f"{name} as a difference", ())
        return Unit(name, powers, float(base.factor), 0.0 if relative else float(base.offset))
    if (unit := find_unit(name)) is None:
        return Unit(name, ())
    return Unit(name, (*unit.powers, 0, 0), float(unit.factor), float(ICE_POINT) * unit.celsius)
