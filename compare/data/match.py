"""Match the columns of a file to quantities and keys of the scene, and pick one run of the file.

Columns are matched by `--column`, or by their names and units. A sweep has its runs below one another with a column for
each parameter; parameters that stand for keys of the scene decide on the run.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from compare import quantities
from compare.data.columns import Column, find_times, refusing, split_unit
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.model import values as values_of
from scenes.parameters import SECTION
from scenes.units import CURRENT, TEMPERATURE, TIME, VOLTAGE, Unit, called, parse_unit
from scenes.varied import every_number, varied

IGNORED = "ignore"
"""The role of a column that is left out."""
_VOLTAGE = re.compile(r"[vu](_?(0|in|app|applied|dc|drive|src|source|tot))?", re.IGNORECASE)


class Target:
    """A sink, or a scene with probes and parameters, as the target of data.

    ``numbers`` are the keys that a column or a parameter may stand for, ``initial`` is the key of the temperature at
    the start.
    """

    def __init__(self, scene: Any) -> None:
        self.scene, self.quantities, self._is_sink = scene, quantities.of(scene), scene.kind == "sink"
        self.numbers = {k: n for k, n in every_number(scene).items() if self._is_sink or k.startswith(SECTION)}
        self.initial = "room_temperature" if self._is_sink else "scene.initial_temperature"

    def show(self, key: str, value: float) -> str:
        """Return an SI value of a key in words, to six digits."""
        return self.numbers[key].kind.dimension.show(float(f"{value:.6g}"))

    def find_key(self, name: str) -> str:
        """Return the key that ends with a name, of the scene's main section where there are several; "" for none."""
        wanted = "." + re.sub(r"\s+", "_", name.strip())
        for text, ends in ((wanted, str), (wanted.lower(), str.lower)):
            keys = [key for key in self.numbers if ends(f".{key}").endswith(text)]
            keys = [key for key in keys if ends(key) in (text[1:], f"sink{text}")] or keys
            if len(keys) == 1:
                return keys[0]
        return "drive.voltage" if self._is_sink and _VOLTAGE.fullmatch(name) else ""

    def find_quantity(self, column: Column) -> str:
        """Return the quantity that a column is called as, also as v(NAME), "NAME rise" or in traces.csv; or ""."""

        def plain(name: str) -> str:
            return re.sub(r"[\s_]+", " ", name).strip().lower()

        node = re.sub(r"^[vi]\((.*)\)$|^(.*)#branch$", r"\1\2", column.name, flags=re.IGNORECASE)
        spellings = {plain(text) for text in (column.name, column.plain, node)}
        spellings |= {re.sub(r"^fem3d | rise$", "", text) for text in spellings}
        found = [name for word, name in self.quantities.names.items() if {plain(word), plain(name)} & spellings]
        return found[0] if len(found) == 1 else self._find_point(column)

    def _find_point(self, column: Column) -> str:
        """Return the probe at the point in the name of a column, in m, mm or um, as COMSOL's tables have it; or ""."""
        number, units = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)", self.quantities.units
        match = re.search(rf"\({number}, *{number}, *{number}\)", column.name, re.IGNORECASE)
        for factor in (1.0, 1e-3, 1e-6) if match and not self._is_sink else ():
            at = factor * np.array([float(each) for each in match.groups()]) if match else np.empty(3)
            found = [
                p.name for p in self.scene.probes
                if parse_unit(units[p.name]).powers == column.powers
                and (place := getattr(p, "at", None) or (p.lower if p.lower == p.upper else None)) is not None
                and np.abs(at - place).max() <= 1e-3 * np.abs(at).max()
            ]  # fmt: skip
            if len(found) == 1:
                return found[0]
        return ""

    def sign(self, key: str) -> float:
        """Return the sign of a current: 1 at an electrode of the largest voltage, -1 of the smallest, otherwise 0."""
        if self._is_sink:
            return float(np.sign(self.scene.voltage if self.scene.current is None else self.scene.current))

        def place_of(item: Any) -> object:
            return item.group if hasattr(item, "group") else (item.lower, item.upper)

        place = place_of(next(probe for probe in self.scene.probes if probe.name == key))
        drives = [b for b in self.scene.boundaries if b.kind == "voltage"]
        largest = {place_of(b): max(values_of(b.value), key=abs) for b in drives}
        given = [place_of(b) for b in drives if b.series_resistance == np.inf]  # a current in place of a voltage
        if place in given:
            return float(np.sign(largest[place]))
        here, others = largest.pop(place, None), largest.values()
        if here is None or not others or given:
            return 0.0
        return float((here > max(others)) - (here < min(others)))


def assign(columns: Sequence[Column], target: Target, given: Sequence[str]) -> list[Column]:
    """Return the columns with the roles, and the units, that `--column NAME=COLUMN` gives them. Raises SceneError."""
    assigned = list(columns)
    for text in given:
        with refusing(f"--column {quoted(text)}"):
            word, _, wanted = (part.strip() for part in text.partition("="))
            if not word or not wanted:
                raise SceneError('give NAME=COLUMN, such as peak="T (K), Point 1"')
            role, unit, kind = _read_role(target, word)
            places = _find_columns(assigned, wanted)
            if any(c.role and (n in places or c.role == role != IGNORED) for n, c in enumerate(assigned)):
                raise SceneError("this column, or another one for it, is named already: name each once")
            for n in places:
                assigned[n] = replace(assigned[n], role=role, kind=kind, unit=unit or assigned[n].unit)
    return assigned


def _read_role(target: Target, text: str) -> tuple[str, Unit | None, str]:
    """Role, unit, and "rise" or "curve", of "time (ms)", "peak rise (K)", "drive.voltage curve" or "ignore"."""
    words = {word.lower(): key for word, key in target.quantities.names.items()} | {"time": "time", IGNORED: IGNORED}
    name, unit = (text, None) if text.lower() in words else split_unit(text)
    kind = next((k for k in ("rise", "curve") if name.lower().endswith(f" {k}") and name.lower() not in words), "")
    plain = name[: len(name) - len(kind)].strip()
    role = words.get(plain.lower()) if kind != "curve" else None
    if role := role or target.find_key(plain):
        return role, unit, kind
    choices = ("time", *target.quantities.names, IGNORED)
    key = f", or a key of the scene such as {next(iter(target.numbers))}" if target.numbers else ""
    raise SceneError(f"it is no quantity: give {', '.join(choices)}{key}{did_you_mean(plain, choices)}")


def _find_columns(columns: Sequence[Column], wanted: str) -> list[int]:
    """The places of a column: by number, or by its header, without its unit where that is enough. Vectors of ngspice
    may share one header, the time, which stands before each."""
    plain, names = " ".join(wanted.split()), [c.name for c in columns]
    loose = {c.name for c in columns if plain.lower() in (c.name.lower(), c.plain.lower())}
    if plain in names or len(loose) == 1:
        return [n for n, name in enumerate(names) if name == plain or (plain not in names and name in loose)]
    if wanted.isdigit() and 0 < int(wanted) <= len(columns):
        return [int(wanted) - 1]
    shown = ", ".join(map(quoted, dict.fromkeys(names[:12])))
    raise SceneError(f"no column is called so: there are {shown}{did_you_mean(plain, names)}")


def match(column: Column, target: Target, curve: Sequence[tuple[str, Any]]) -> tuple[str, np.ndarray, str]:
    """Return the quantity of a column, its values and a note on them; "" and the reason where there is none.

    The values are in SI units, temperatures absolute, NaN in rows to leave out. Raises SceneError where --column gives
    another unit.
    """
    key, notes = column.role or target.find_quantity(column), []
    if not key or np.isnan(column.values).all():
        return "", column.values, "has no number in this run" if key else "is called as no quantity of the scene"
    symbol = target.quantities.units[key]
    wanted = parse_unit(symbol)
    if column.unit is None:
        notes.append(f"it has no unit and is taken in {symbol}")
        column = replace(column, unit=wanted)
    elif column.spice and column.powers == VOLTAGE.powers != wanted.powers:
        # A circuit has volts for all that is no current.
        notes.append(f"volts taken for {'kelvins' if symbol == 'K' else symbol}")
        column = replace(column, unit=wanted)
    if column.powers != wanted.powers:
        why = f"is {called(column.powers or ())}, not {called(wanted.powers)}"
        if column.role:
            raise SceneError(f"--column: {quoted(column.name)} can't be the {target.quantities.word(key)}: it {why}")
        return "", column.values, why
    values, signs = column.si, [Target(scene).sign(key) for _, scene in curve] or [target.sign(key)]
    if wanted.powers == TEMPERATURE.powers:
        values, how = _make_absolute(target, key, column)
        notes += [how] * bool(how)
    elif wanted.powers == CURRENT.powers and np.nanmedian(values * signs) < 0:
        # SPICE counts the current of a source as negative where the source delivers.
        values = -values
        notes.append("sign turned to that of the voltage")
    return key, values, ", ".join(notes)


def _make_absolute(target: Target, key: str, column: Column) -> tuple[np.ndarray, str]:
    """Absolute temperatures (K) of a column, and a note.

    Unless the column is called a rise, its numbers other than zero are absolute where all are above half of the
    initial temperature of the scene. Zeros among absolute kelvins are placeholders, and so are numbers below 0 K
    however they are read, such as -999.
    """
    initial = target.quantities.initial
    of_column, of_quantity = (set(re.split(r"[\W_]+", n.lower())) for n in (column.name, target.quantities.word(key)))
    if column.kind == "rise" or "rise" in of_column - of_quantity:
        return column.differences + initial, "a rise"
    values, zero = np.where(column.differences < -initial, np.nan, column.si), column.values == 0
    known = values[~np.isnan(values) & ~zero]
    starts = known.size and abs(known[0] - initial) <= 0.05 * initial
    celsius = column.unit is not None and column.unit.celsius
    if not known.size or not (starts or celsius or (known > initial / 2).all()):
        return values + initial, f"a rise, for it starts at {values[~np.isnan(values)][0]:.4g} K"
    zero &= column.unit is not None and not celsius
    return np.where(zero, np.nan, values), f"{zero.sum()} placeholder rows of zeros" * bool(zero.any())


@dataclass
class Run:
    """The run that is compared.

    Attributes
    ----------
    clock : the name of the column of times, "" for none
    time : (rows,) in s, zeros without times
    columns : the columns that may be quantities
    notes : how the time was read where that is not plain
    left_out : the reasons of the other columns
    words : the run in words
    curve : of a curve of steady states the value in words and the scene of each row
    """

    clock: str
    time: np.ndarray
    columns: list[Column]
    notes: list[str] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    words: str = ""
    curve: list[tuple[str, Any]] = field(default_factory=list)

    def keep(self, rows: np.ndarray, note: str = "") -> None:
        """Keep some rows, and note why."""
        self.columns, self.time = [c.at(rows) for c in self.columns], self.time[rows]
        self.notes += [note] * bool(note)


def pick(columns: Sequence[Column], target: Target) -> Run:
    """Return the run of the scene. Raises SceneError where there is none, or several that no key tells apart."""
    steady = target.quantities.steady
    run = _find_time(columns, steady)
    filled = np.isfinite(run.time)
    if not filled.any():
        raise SceneError(f"{quoted(run.clock)}, the time, has no numbers: give 90, not 00:01:30")
    run.keep(filled, "" if filled.all() else f"{(~filled).sum()} rows without one are left out")
    parameters = _take_parameters(run, target)
    curve = next((p for p in parameters if p.kind == "curve"), None)
    fits = _choose(run, [p for p in parameters if p is not curve], target)
    if curve is None:
        numbers = [np.isfinite(c.values) for c in run.columns if c.role or target.find_quantity(c)]
        run.keep(fits & np.any(numbers, axis=0) if steady and numbers else fits)
        _keep_one_run(run, steady)
    elif not steady:
        raise SceneError(f"a curve over {curve.plain} is one of steady states: give --steady")
    elif not (now := target.numbers[curve.role].value):
        raise SceneError(f"{curve.role} is 0 in the scene: give it another value for a curve")
    else:
        # A scene without a drive is refused: a row of zeros has no 3D solution.
        rows = fits & (curve.values != 0)
        run.keep(rows)
        for value in curve.values[rows].tolist():
            words = f"{curve.role} = {target.show(curve.role, value)}"
            run.curve.append((words, varied(target.scene, curve.role, value / now)))
        said = f"the curve over {curve.plain} ({curve.role}) at {_listed(curve.at(rows), target)}"
        dropped = f", rows at {curve.plain} = 0 left out" if (curve.values == 0).any() else ""
        run.words = "; ".join(filter(None, (run.words, said + dropped)))
    return run


def _find_time(columns: Sequence[Column], steady: bool) -> Run:
    """The run of all rows, with the column of times and the other columns."""
    times = [c for c in columns if c.role == "time"] or find_times([c for c in columns if not c.role])
    if not times and steady:
        return Run("", np.zeros(len(columns[0].values)), list(columns))
    same = [c for c in times if c.unit == times[0].unit and np.array_equal(c.values, times[0].values, equal_nan=True)]
    if not times or len(same) != len(times):
        names = ", ".join(quoted(c.name) for c in (times or columns)[:8])
        such = 'no column is the time with its unit, such as "Time (s)" with 90, not 00:01:30'
        problem = "several columns are the time" if times else such
        raise SceneError(f'{problem} (give --column "time (s)=NAME"): there are {names}')
    clock, bare = times[0], times[0].unit is None and not times[0].role
    if not bare and clock.powers != TIME.powers:
        raise SceneError(f'--column: {quoted(clock.name)} has no unit of time: say it, --column "time (s)=NAME"')
    others = [c for c in columns if c.name not in {c.name for c in times}]
    return Run(clock.name, clock.si, others, ["it has no unit and is taken in s"] * bare)


def _take_parameters(run: Run, target: Target) -> list[Column]:
    """Take the parameters of the runs from the others, in SI units with their keys as roles; drop useless columns."""
    most = 1 if _is_one_run(run.time) else 1 + int((np.diff(run.time) <= 0).sum())
    parameters, others = [], []
    for column in run.columns:
        key = column.role * (column.role in target.numbers)
        if not column.role and not target.find_quantity(column):
            key = target.find_key(column.plain)
        why = "is left out by --column" if column.role == IGNORED else ""
        if not why and np.isnan(column.values).all():
            why = 'has no numbers (give 1234.5, not "1,234.5")'
        elif key:
            dimension = target.numbers[key].kind.dimension
            if column.powers not in (None, dimension.powers):
                why = f"is not {dimension.name}, as {key} is"
            elif column.kind != "curve" and len(np.unique(column.values)) > most:
                why = f"varies over time, as no {key} of a run does"
            if why and column.role:
                raise SceneError(f"--column: {quoted(column.name)} {why}")
        if why:
            run.left_out[column.name] = why
        elif key:
            parameters.append(replace(column, role=key, values=column.si))
        else:
            others.append(column)
    run.columns = others
    return parameters


def _listed(parameter: Column, target: Target) -> str:
    """The distinct values of a parameter in words."""
    values = [target.show(parameter.role, value) for value in dict.fromkeys(parameter.values.tolist())]
    return ", ".join(values[:12]) + (f" and {len(values) - 12} more" if len(values) > 12 else "")


def _choose(run: Run, parameters: Sequence[Column], target: Target) -> np.ndarray:
    """(rows,): whether a row is of the scene's run, where all parameters are the scene's to the digits of a table."""
    fits, said = np.ones(len(run.time), dtype=bool), []
    for p in parameters:
        value = target.numbers[p.role].value
        fits &= np.isclose(p.values, value, rtol=1e-4, atol=1e-15)
        others = f" of {_listed(p, target)}" if len(np.unique(p.values)) > 1 or not fits.any() else ""
        said.append(f"{p.plain} = {target.show(p.role, value)} ({p.role}){others}")
    if not said:
        return fits
    first, words = parameters[0], ", ".join(said)
    if not fits.any():
        other = target.show(first.role, float(first.values[0])).replace(" ", "")
        raise SceneError(
            f"it has no run of this scene, {words}: export that run, or set the scene: --set {first.role}={other} "
            f'(--column "ignore={first.plain}" where it is no such parameter)'
        )
    run.words = f"the run at {words}"
    return fits


def _is_one_run(time: np.ndarray) -> bool:
    """Whether times ascend, but for events: a solver stores a time twice there, before and after."""
    steps = np.diff(time)
    return bool((steps >= 0).all() and not ((steps[1:] == 0) & (steps[:-1] == 0)).any()
                and 2 * (steps == 0).sum() <= (steps > 0).sum())  # fmt: skip


def _keep_one_run(run: Run, steady: bool) -> None:
    """Keep the rows of one run at ascending times, or the last one for the steady state.

    Raises SceneError for rows of several runs or states.
    """
    count, is_one = len(run.time), _is_one_run(run.time)
    if steady and (count == 1 or (run.clock and is_one)):
        note = f"the last of {count} rows with numbers is taken for the steady state" if run.clock else ""
        run.keep(np.arange(count) == count - 1, note)
    elif not steady and is_one:
        last = np.append(np.diff(run.time) > 0, True)
        run.keep(last, "" if last.all() else f"{(~last).sum()} of them twice, the second row is taken")
    else:
        problem = f"it has {count} rows where the scene has one steady state"
        if not steady:
            problem = "its times repeat or step back, as those of several runs or of too few digits do"
        raise SceneError(f"{problem}: export one run, or name the column of a key of the scene, --column KEY=COLUMN")
