"""A model that is an FMU, run by fmpy in a process of its own, so that a fault in it is a sentence here.

The scene's values are the start values of its parameters and inputs. Over time it is run twice, with steps of
different length, whose difference estimates the error. For the steady state its runs get ever longer (`Fmu._longest`).
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple
from zipfile import BadZipFile, ZipFile

import numpy as np

from compare.data.columns import ICE_POINT, find_unit
from compare.models.model import LONGEST, Answer, Model, Question, check_parameters, find_file, match_outputs
from compare.worker import Worker
from scenes.errors import SceneError, printable, quoted
from scenes.formats import quantity
from scenes.units import parse_unit

STEPS = (500, 2000)
"""Numbers of steps of the two runs over time; an FMU integrated here has a relative tolerance of 0.01 over that."""
HORIZONS = tuple(10.0**n for n in range(-6, 7))
"""Ends (s) of the runs to the steady state, from below the time constants of a film to eleven days."""
REST = 1e-6
"""An output rests where it changes by at most this part of its whole change in the second half of a run."""
ROUNDING = 1e-12
"""A change below this part of an output's size is a rounding error."""
UNRESOLVED = 0.1
"""A longer run has too long steps where it differs by this part of the change from a shorter one that came to rest."""
BUDGET = 60.0
"""s by the clock that all runs to one steady state may take together."""
LARGEST = 2e9
"""Bytes that an FMU may unpack to; those with the data of whole buildings have some hundred million."""


class Run(NamedTuple):
    """The ``time`` (steps,) of a run in s, and its outputs ``values`` (steps, outputs) in SI units."""

    time: np.ndarray
    values: np.ndarray

    @property
    def changes(self) -> np.ndarray:
        """(outputs,): the whole change of each output, 0 where that is rounding."""
        change = np.ptp(self.values, axis=0)
        return np.where(change > ROUNDING * np.abs(self.values).max(axis=0), change, 0.0)

    @property
    def late_changes(self) -> np.ndarray:
        """(outputs,): the change of each output in the second half of the run."""
        return Run(*(part[len(self.time) // 2 :] for part in self)).changes

    @property
    def rests(self) -> bool:
        """Whether each output has moved and come to rest, or never moved."""
        return bool((self.late_changes <= REST * self.changes).all())

    def at(self, times: np.ndarray) -> np.ndarray:
        """(times, outputs): the outputs at times (s)."""
        return np.column_stack([np.interp(times, self.time, values) for values in self.values.T])

    def goes_on(self, shorter: Run) -> bool:
        """Whether the run is finite, and as a shorter one in its middle, if the outputs were at rest by then."""
        middle = shorter.time[-1:] / 2
        off = np.abs(self.at(middle) - shorter.at(middle))[0]
        contradicts = shorter.rests and ((off > UNRESOLVED * shorter.changes) & (shorter.changes > 0)).any()
        return bool(np.isfinite(self.values).all() and not contradicts)


@dataclass(frozen=True)
class Unit:
    """The unit that an FMU declares for a variable, SI where it declares none.

    ``factor`` * value + ``offset`` is in SI units; ``powers`` (of m, kg, s, A, K) are None where they are unknown.
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
        self._worker = Worker(f"--model {name}", quiet=True)
        self._runs: dict[object, list[Run]] = {}

    def answer(self, question: Question, times: np.ndarray | None) -> Answer:
        check_parameters(self.name, "parameter or input", question, self._settable)
        wanted = question.units(times)
        outputs = match_outputs(self.name, "variable", question, wanted, self._readable)
        for name, variable in outputs.items():
            declared = self._known(variable, self._readable)
            if declared.powers not in (None, parse_unit(wanted[name]).powers):
                raise SceneError(
                    f"--model {self.name}: {quoted(variable)} is in {quoted(declared.name)}, not in {wanted[name]}, as "
                    f"{quoted(name)} is"
                )
        units = {name: self._known(name, self._settable) for name in question.parameters}
        start = {name: (v - units[name].offset) / units[name].factor for name, v in question.parameters.items()}
        variables = list(outputs.values())
        key = (times is None or float(times[-1]), *start.items(), *variables)
        if key not in self._runs:
            if times is None:
                self._runs[key] = [self._settle(start, variables)]
            else:
                self._runs[key] = [self._run(start, variables, float(times[-1]), n, LONGEST) for n in STEPS]
        runs = self._runs[key]
        if times is None:
            last, errors = runs[0].values[-1], runs[0].late_changes
        else:
            # A jump of an output takes a whole step here: the two runs differ most at the end of the short step, by
            # all but its part of the long one, and right after the jump the short one is off by all of it.
            everywhere, share = np.union1d(times, runs[1].time), STEPS[1] / (STEPS[1] - STEPS[0])
            coarse, fine = (run.at(everywhere) for run in runs)
            last, errors = fine[np.isin(everywhere, times)], share * np.abs(fine - coarse).max(axis=0)
        return Answer(dict(zip(outputs, last.T, strict=True)), dict(zip(outputs, errors.tolist(), strict=True)))

    def _settle(self, start: Mapping[str, float], outputs: list[str]) -> Run:
        """Run the FMU to ever later ends, and return the longest run whose steps are short enough for the FMU.

        Rest does not depend on a scale of time: an output has to have moved, and then to have stayed for as long
        again. All ends are tried, because an FMU may move again. The first run with too long steps ends the series: it
        fails, is not finite, or contradicts the middle of a shorter run. Raises SceneError where no run rests.
        """
        longest: Run | None = None
        failure: SceneError | None = None
        until = time.monotonic() + BUDGET
        for end in HORIZONS:
            try:
                run = self._run(start, outputs, end, STEPS[0], until - time.monotonic())
            except SceneError as error:
                failure = error
                if longest is not None:
                    break
                continue
            failure = None
            if longest is not None and not run.goes_on(longest):
                break
            longest = run
        if longest is None:
            raise failure or AssertionError
        moved = longest.changes.any()
        if np.isfinite(longest.values).all() and not (longest.rests and (moved or longest.time[-1] >= HORIZONS[-1])):
            why = str(failure).removeprefix(f"--model {self.name} ") if failure else "it has no steady state"
            raise SceneError(
                f"--model {self.name} {'does not come to rest' if moved else 'has not moved'} within "
                f"{quantity(float(longest.time[-1]), 's')}: {'a longer run ' * bool(failure)}{why}"
            )
        return longest

    def _known(self, variable: str, units: Mapping[str, Unit]) -> Unit:
        """The unit of a variable. Raises SceneError for a unit that nobody defines."""
        unit = units[variable]
        if unit.name and unit.powers is None:
            raise SceneError(
                f"--model {self.name}: {quoted(variable)} is in {quoted(unit.name)}, a unit that is not known: give it "
                "a BaseUnit in modelDescription.xml"
            )
        return unit

    def _run(self, start: Mapping[str, float], outputs: list[str], end: float, steps: int, seconds: float) -> Run:
        """The run to an end (s)."""
        try:
            run = self._worker.run(max(seconds, 0.1), simulate, self._folder.name, end, steps, start, outputs)
        except SceneError:
            raise
        except Exception as error:
            raise SceneError(f"--model {self.name} failed: {printable(str(error), 200)}") from None
        if run.time[-1] < end - end / steps / 2:
            raise SceneError(
                f"--model {self.name} stops at {quantity(run.time[-1], 's')} of {quantity(end, 's')}: a step of it "
                "says that it failed"
            )
        read = [self._readable[variable] for variable in outputs]
        return Run(run.time, run.values * [unit.factor for unit in read] + [unit.offset for unit in read])


def open_model(given: str, folder: str) -> Fmu:
    """Return the FMU of a file. Raises SceneError where it cannot be read."""
    path = find_file(given, folder, "an FMU, such as bridge.fmu")
    if find_spec("fmpy") is None:
        raise SceneError(f"--model {quoted(given)} is run by fmpy: pip install 'heated-microstructure-validation[fmu]'")
    from fmpy import extract, read_model_description

    with suppress(OSError, BadZipFile), ZipFile(path) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
        if size > LARGEST:
            raise SceneError(
                f"--model {quoted(given)} unpacks to {size / 1e9:.3g} GB: give one of {LARGEST / 1e9:g} at most"
            )
    unpacked = TemporaryDirectory()
    try:
        description = read_model_description(str(path), validate=False)
        extract(str(path), unpacked.name)
    except Exception as error:
        raise SceneError(f"--model {quoted(given)} is no FMU that can be read ({printable(str(error), 120)})") from None
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
        return Unit(name, powers, float(base.factor), 0.0 if relative else float(base.offset))
    unit = find_unit(name)
    if unit is None:
        return Unit(name)
    return Unit(name, unit.powers, float(unit.factor), ICE_POINT if unit.celsius else 0.0)


def simulate(folder: str, end: float, steps: int, start: Mapping[str, float], outputs: list[str]) -> Run:
    """Run an unpacked FMU from 0 to ``end`` (s), with outputs in its own units; for a process of its own."""
    from fmpy import simulate_fmu

    columns = simulate_fmu(
        folder, validate=False, stop_time=end, output_interval=end / steps, step_size=end / steps, output=outputs,
        start_values=dict(start), relative_tolerance=1e-2 / steps, record_events=False,
    )  # fmt: skip
    return Run(np.array(columns["time"]), np.column_stack([columns[name].astype(float) for name in outputs]))
