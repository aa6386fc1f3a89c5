"""A model that is an FMU, run by fmpy in a process of its own, so that a fault in it is a sentence here.

The scene's values are the start values of its parameters and inputs. For the steady state its runs get ever longer
(`Fmu._settle`).
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from importlib.util import find_spec
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any
from xml.etree import ElementTree

import numpy as np

from compare.data.columns import Column, find_unit
from compare.models.model import LONGEST, STEPS, Model, Question, find_file, match_outputs, run_twice
from compare.quantities import AT_REST
from compare.worker import Worker
from scenes.errors import SceneError, printable, quoted, unknown
from scenes.formats import quantity
from scenes.result import Traces
from scenes.units import PLAIN, TEMPERATURE, Unit

HORIZONS = tuple(10.0**n for n in range(-6, 7))
"""Ends (s) of the runs to the steady state, from below the time constants of a film to eleven days."""
NO_UNIT = Unit(PLAIN, Fraction(1))


@dataclass(frozen=True)
class Fmu:
    """An FMU unpacked in a ``folder``, its variables that can be set and read, and the process that runs it.

    Variables are columns without values, with their declared units; unknown units have no powers.
    """

    folder: TemporaryDirectory[str]
    settable: Mapping[str, Column]
    readable: Mapping[str, Column]
    worker: Worker

    def answer(self, question: Question) -> Traces:
        if question.times is None:
            return self._settle(question)
        return run_twice(partial(self._run, question, float(question.times[-1])))

    def _settle(self, question: Question) -> Traces:
        """Run the FMU to ends that are ten times later each, and return the end of the longest run that rests.

        A run rests where the outputs moved, and then stayed for as long again, to a millionth of the change; this does
        not depend on a scale of time. All ends are tried, because an FMU may move again. A run that fails has too long
        steps and ends the series.
        """
        rested: Traces | None = None
        failure, last, until = "", 0.0, monotonic() + LONGEST / 10
        for end in HORIZONS:
            try:
                run = self._run(question, end, STEPS[0], until - monotonic()).values
            except SceneError as error:
                failure = str(error)
                if last:
                    break
                continue
            last, values = end, np.array(list(run.values()))
            change, rounding = np.ptp(values, axis=1), 1e-12 * np.abs(values).max(axis=1)
            late = np.ptp(values[:, values.shape[1] // 2 :], axis=1)
            moved = (change > rounding).any() or end == HORIZONS[-1]
            if moved and (late <= 1e-6 * change + rounding).all():
                errors = dict(zip(run, late.tolist(), strict=True))
                rested = Traces(AT_REST, {name: v[-1:] for name, v in run.items()}, errors)
        if rested is None:
            unsettled = f"it does not come to rest within {quantity(last, 's')}" * bool(last)
            raise SceneError(": ".join(filter(None, (unsettled, failure))))
        return rested

    def _run(self, question: Question, end: float, steps: int, seconds: float = LONGEST) -> Traces:
        """Run the FMU to an end (s), which may take some seconds."""
        from fmpy import simulate_fmu

        for name in question.parameters:
            if name not in self.settable:
                raise unknown("it has no parameter or input in a known unit", name, self.settable)
        outputs = match_outputs("variable", question.outputs, question.units, self.readable)
        given = {name: (value, self.settable[name].unit or NO_UNIT) for name, value in question.parameters.items()}
        start = {name: (value - float(unit.offset)) / float(unit.factor) for name, (value, unit) in given.items()}
        simulate = partial(
            simulate_fmu, self.folder.name, validate=False, start_time=0.0, stop_time=end, output_interval=end / steps,
            step_size=end / steps, output=list(outputs.values()), start_values=start, relative_tolerance=1e-2 / steps,
            record_events=False,
        )  # fmt: skip
        try:
            rows = self.worker.run(max(seconds, 0.1), simulate)
        except SceneError:
            raise
        except Exception as error:
            last = re.search(r"At t = (\S+?),", str(error))
            why = f"no step of its integration leads beyond {last[1]} s" if last else printable(str(error), 200)
            raise SceneError(f"it failed: {why}") from None
        if rows["time"][-1] < end - end / steps / 2:
            stop = quantity(float(rows["time"][-1]), "s")
            raise SceneError(f"it stops at {stop} of {quantity(end, 's')}: a step of it says that it failed")
        values = {name: replace(self.readable[own], values=rows[own]).si for name, own in outputs.items()}
        if not np.isfinite([*values.values()]).all():
            raise SceneError("it has an output that is not finite")
        return Traces(rows["time"], values, {})


def open_model(given: str, folder: str) -> Model:
    """Return the FMU of a file. Raises SceneError where it cannot be read."""
    path = find_file(given, folder, "an FMU, such as bridge.fmu")
    if find_spec("fmpy") is None:
        raise SceneError("it is run by fmpy: pip install 'heated-microstructure-validation[fmu]'")
    from fmpy import extract, platform, read_model_description, supported_platforms

    unpacked = TemporaryDirectory()
    try:
        description = read_model_description(str(path), validate=False)
        extract(str(path), unpacked.name)
        platforms = supported_platforms(str(path))
        definitions = {unit.name: unit.baseUnit for unit in description.unitDefinitions}
        tags = ElementTree.parse(f"{unpacked.name}/modelDescription.xml").iter()
        # fmpy 0.3.32 overlooks this attribute of a variable; its tag, or the one inside, has it.
        differences = {t.get("name") for t in tags for each in (t, *t) if each.get("relativeQuantity") in ("true", "1")}
        variables = [(each, _column(each, definitions, differences)) for each in description.modelVariables]
    except Exception:
        raise SceneError("it is no FMU that can be read, of FMI 2 or 3: export it again") from None
    if platform not in platforms:
        raise SceneError(f"it has programs for {', '.join(platforms) or 'no system'}: export it for {platform}")
    settable = {v.name: c for v, c in variables if v.causality in ("parameter", "input") and c.powers != ()}
    readable = {v.name: c for v, c in variables if v.causality != "parameter"}
    return Model(path.name, Fmu(unpacked, settable, readable, Worker("it")).answer)


def _column(variable: Any, definitions: Mapping[str, Any], differences: set[str | None]) -> Column:
    """A variable in the unit that an FMU declares: by its BaseUnit, or else by its name."""
    kind, unknown = variable.declaredType, Unit((), Fraction(1))
    if not (name := variable.unit or (kind.unit if kind else None)):
        return Column(variable.name, None, np.empty(0))
    unit = find_unit(name) or unknown
    if base := definitions.get(name):
        powers = tuple(int(getattr(base, symbol)) for symbol in ("m", "kg", "s", "A", "K"))
        unit = unknown if base.mol or base.cd else Unit(powers, Fraction(base.factor), Fraction(base.offset))
    if variable.name in differences or (kind and kind.name in differences):
        name, unit = f"{name} as a difference", unknown if unit.powers == TEMPERATURE.powers else unit
    return Column(variable.name, unit, np.empty(0), note=f"in {quoted(name)}")
