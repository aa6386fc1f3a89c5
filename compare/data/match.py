"""Match the columns of a file to quantities and keys of the scene, and pick one run of the file.

Columns are matched by `--column`, or by their names and units. A run has times, columns and rows. A sweep has its runs
below one another with a column for each parameter. Parameters that stand for keys of the scene decide on the run.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.data.columns import Column, Table, find_unit, refusing, split_unit, to_si
from compare.data.target import RISE_WORDS, Target
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.units import CURRENT, TEMPERATURE, TIME, VOLTAGE, Unit, called, parse_unit

IGNORED = "ignore"
"""The name of a column that is left out."""
_DIFFERENCE = re.compile(r"\bT\)?\s*-\s*[\dT]")
_NEAR_INITIAL = 0.05
"""Part of the initial temperature (K), or of the change in degC, within which a trace starts there."""
_ZERO = 0.005
"""Part of its change within which a rise starts at zero."""
_CLOSE = 1e-4
"""Relative distance within which a parameter of a run is the scene's: tables round to five digits."""


@dataclass(frozen=True)
class Meaning:
    """The meaning of a column by `--column`: "time", "ignore", a quantity or a key; its unit; whether the column is a
    rise, or the abscissa of a ``curve``."""

    name: str
    unit: str = ""
    rise: bool = False
    curve: bool = False


def read_meanings(target: Target, table: Table, given: Sequence[str]) -> dict[str, Meaning]:
    """Read `--column NAME=COLUMN` as meanings by the names of columns and parameters. Raises SceneError."""
    meanings: dict[str, Meaning] = {}
    for text in given:
        with refusing(f"--column {quoted(text)}"):
            quantity, equals, wanted = (part.strip() for part in text.partition("="))
            if not equals or not quantity or not wanted:
                raise SceneError('give NAME=COLUMN, such as peak="T (K), Point 1"')
            meaning, name = _read_meaning(target, quantity), _find_column(table, wanted)
            if name in meanings:
                raise SceneError(f"{quoted(name)} is the {meanings[name].name} already")
            if meaning.name != IGNORED and meaning.name in (other.name for other in meanings.values()):
                raise SceneError(f"another column is the {meaning.name} already")
            meanings[name] = meaning
    return meanings


def _read_meaning(target: Target, text: str) -> Meaning:
    """The meaning of "time (ms)", "peak rise (K)", "drive.voltage curve" or "ignore"."""
    words = {word.lower(): key for word, key in target.quantities.names.items()}
    name, unit = (text, "") if text.lower() in words else split_unit(text)
    plain = name if name.lower() in words else re.sub(r"\s*\brise\b\s*", "", name, flags=re.IGNORECASE).strip()
    if plain.lower() in ("time", IGNORED, *words):
        return Meaning(words.get(plain.lower(), plain.lower()), unit, plain != name)
    path = target.find_key(plain.removesuffix(" curve"))
    if not path:
        choices = ("time", *target.quantities.names, IGNORED)
        example = "drive.voltage" if "drive.voltage" in target.keys else next(iter(target.keys), "")
        key = f", or a key of the scene such as {example}" if example else ""
        raise SceneError(f"it is no quantity: give {', '.join(choices)}{key}{did_you_mean(plain, choices)}")
    return Meaning(path, unit, curve=plain.endswith(" curve"))


def _find_column(table: Table, wanted: str) -> str:
    """The name of a column: as the header has it, without its unit where that is enough, or by number."""
    names = list(dict.fromkeys(c.name for c in table.columns))
    plain = " ".join(wanted.split())
    loose = [c.name for c in table.columns if plain.lower() in (c.name.lower(), c.plain.lower())]
    if plain in names or len(set(loose)) == 1:
        return plain if plain in names else loose[0]
    if wanted.isdigit() and 0 < int(wanted) <= len(table.columns):
        return table.columns[int(wanted) - 1].name
    shown = ", ".join(map(quoted, names[:12]))
    raise SceneError(f"no column is called so: there are {shown}{did_you_mean(plain, names)}")


def find_time(table: Table, given: Mapping[str, Meaning], target: Target) -> tuple[Column | None, str, list[Column]]:
    """Return the column of times in s, how it was read where that is not plain, and the other columns."""
    columns = list(table.columns)
    named = [c for c in columns if c.name in given and given[c.name].name == "time"]
    free = [c for c in columns if c.powers == TIME.powers and c.name not in given]
    bare = [c for c in columns if c.name.lower() in ("time", "zeit", "t") and not c.unit and c.name not in given]
    # The only column in a unit of time is the time, whatever its name.
    times = named or [c for c in free if c.is_time] or free or bare
    same = [c for c in times if c.unit == times[0].unit and np.array_equal(c.values, times[0].values, equal_nan=True)]
    if not times and target.quantities.steady:
        return None, "", columns
    if not times or len(same) != len(times):
        names = ", ".join(quoted(c.name) for c in (times or columns)[:8])
        problem = "several columns are the time" if times else "no column is the time with its unit"
        raise SceneError(f'{problem}, such as "Time (s)" (or --column "time (s)=NAME"): there are {names}')
    unit = find_unit("s" if times is bare else (given[named[0].name].unit if named else "") or times[0].unit)
    if unit is None or unit.powers != TIME.powers:
        raise SceneError(f'--column: {quoted(times[0].name)} has no unit of time: say it, --column "time (s)=NAME"')
    clock = Column(times[0].name, "s", to_si(times[0].values, unit))
    names_of_time = {c.name for c in times}
    how = "it has no unit and is taken in s" if times is bare else ""
    return clock, how, [c for c in columns if c.name not in names_of_time]


@dataclass(frozen=True)
class Match:
    """The column of a quantity: ``values`` in SI units, temperatures absolute, NaN in rows to leave out."""

    key: str
    header: str
    values: np.ndarray
    note: str = ""


def match_column(column: Column, meaning: Meaning | None, target: Target) -> Match | str:
    """Return the quantity of a column, or why it is none. Raises SceneError where --column gives another unit."""
    if meaning is None and "reduced1d" in column.name.lower():
        return "is of a 1D model"
    key, note = (meaning.name, "") if meaning else target.find_quantity(column)
    if not key:
        return note
    symbol = target.quantities.units[key]
    wanted, unit, notes = parse_unit(symbol), find_unit((meaning.unit if meaning else "") or column.unit), [note]
    bare = unit is None
    if column.spice and unit is not None and unit.powers == VOLTAGE.powers != wanted.powers:
        # A circuit has volts for all that is no current.
        notes.append(f"volts taken for {'kelvins' if symbol == 'K' else symbol}")
        unit = wanted
    elif unit is None:
        notes.append(f"it has no unit and is taken in {symbol}")
        unit = wanted
    if unit.powers != wanted.powers:
        why = f"is {called(unit.powers)}, not {called(wanted.powers)}"
        if meaning is None:
            return why
        raise SceneError(f"--column: {quoted(column.name)} can't be the {target.quantities.word(key)}: it {why}")
    values = to_si(column.values, unit)
    if wanted.powers == TEMPERATURE.powers:
        values, how = _make_absolute(target, key, column, meaning, unit)
        notes.append(how)
        first = next(v for v in column.values if v == v)
        if bare and how.startswith("a rise, for") and abs(first) > _ZERO * np.nanmax(np.abs(column.values - first)):
            initial = target.quantities.initial
            return f"has no unit, and starts at {first:.4g}: neither at 0 nor at {initial:g} K"
    elif wanted.powers == CURRENT.powers and float(np.nanmedian(values)) * target.sign(key) < 0:
        # SPICE counts the current of a source as negative where the source delivers.
        values = -values
        notes.append("sign turned to that of the voltage")
    return Match(key, column.name, values, ", ".join(filter(None, notes)))


def _make_absolute(
    target: Target, key: str, column: Column, meaning: Meaning | None, unit: Unit
) -> tuple[np.ndarray, str]:  # fmt: skip
    """Absolute temperatures (K) of a column, and a note.

    Without a word for a rise, the whole column decides: its numbers other than zero are absolute where they start at
    the initial temperature of the scene, or where all are above half of it. Zeros of such a column are placeholders.
    """
    initial = target.quantities.initial
    words = set(re.findall(r"[a-z]+", column.name.lower()))
    named = bool(words & RISE_WORDS or _DIFFERENCE.search(column.name)) and target.quantities.word(key) != column.name
    if named or (meaning is not None and meaning.rise):
        return column.values * float(unit.factor) + initial, "a rise"
    values = to_si(column.values, unit)
    zero = column.values == 0
    kept = values[~np.isnan(values) & ~zero]
    starts = bool(kept.size) and abs(kept[0] - initial) <= _NEAR_INITIAL * initial
    if not (starts or (kept > initial / 2).all()) or not kept.size:
        first = float(values[~np.isnan(values)][0])
        return values + initial, f"a rise, for it starts at {first:.4g} K"
    if unit.celsius:
        # 0 degC is a temperature, but at the top of a column that goes on at the initial temperature.
        zero &= (np.cumsum(~zero) == 0) & bool(abs(kept[0] - initial) <= _NEAR_INITIAL * np.ptp(kept))
    if not zero.any():
        return values, ""
    return np.where(zero, np.nan, values), f"{zero.sum()} placeholder rows of zeros"


def refusal(table: Table, reasons: Mapping[str, str], target: Target) -> str:
    """Return why no column of a table is a quantity of the scene."""
    names = target.quantities.names
    first = next(iter(names))
    unit = target.quantities.units[names[first]]
    listed = "; ".join(
        f"{quoted(name)} {reasons.get(name, 'is the time')}"
        for name in list(dict.fromkeys(c.name for c in table.columns))[:8]
    )
    return (
        f"none of its columns is {target.called}: {listed}; name them {target.example}, or say which they are: "
        f'--column "{first} ({unit})=NAME"'
    )


@dataclass(frozen=True)
class Parameter:
    """A parameter of the runs in a file: its name, the key of the scene, and the SI value of the key by row."""

    name: str
    key: str
    values: np.ndarray
    curve: bool = False

    def listed(self, target: Target) -> str:
        """Return the distinct values in words."""
        values = [target.show(self.key, value) for value in dict.fromkeys(self.values.tolist())]
        return ", ".join(values[:12]) + (f" and {len(values) - 12} more" if len(values) > 12 else "")


@dataclass(frozen=True)
class Run:
    """The run that is compared.

    Attributes
    ----------
    clock : the column of times (rows,) in s, or ``None``
    how : how the time was read where that is not plain
    columns : the columns that may be quantities
    left_out : the reasons of the other columns
    words : the run in words
    curve : the key of the scene and its values (rows,), at which the rows are steady states, or ``None``
    """

    clock: Column | None
    how: str
    columns: Sequence[Column]
    left_out: Mapping[str, str]
    words: str
    curve: tuple[str, np.ndarray] | None = None


def pick(table: Table, given: Mapping[str, Meaning], target: Target) -> Run:
    """Return the run of the scene. Raises SceneError where there is none, or several that no key tells apart."""
    clock, how, columns = find_time(table, given, target)
    notes, count = [how], len(table.columns[0].values)
    time = np.zeros(count) if clock is None else clock.values
    filled = np.isfinite(time)
    if clock is not None and not filled.any():
        raise SceneError(f"{quoted(clock.name)}, the time, is empty")
    if not filled.all():
        notes.append(f"{(~filled).sum()} rows without one are left out")
        time, columns = time[filled], _select(columns, filled)
    parameters, columns, left_out = _split_parameters(columns, given, time, target)
    curve = next((p for p in parameters if p.curve), None)
    fits, words = _choose([p for p in parameters if not p.curve], target, len(time))
    if curve is None:
        rows, note = _pick_rows(np.flatnonzero(fits), time, clock, columns, target, words)
        notes.append(note)
    elif not target.quantities.steady:
        raise SceneError(f"a curve over {curve.name} is one of steady states: give --steady")
    else:
        # A scene without a drive is refused: a row of zeros has no 3D solution.
        dropped = f"rows at {curve.name} = 0 are left out" if (curve.values == 0).any() else ""
        rows = np.flatnonzero(fits & (curve.values != 0))
        curve = replace(curve, values=curve.values[rows])
        said = f"the curve over {curve.name} ({curve.key}) at {curve.listed(target)}"
        words = "; ".join(filter(None, (words, dropped, said)))
    clock = None if clock is None else replace(clock, values=time[rows])
    pair = None if curve is None else (curve.key, curve.values)
    return Run(clock, "; ".join(filter(None, notes)), _select(columns, rows), left_out, words, pair)


def _select(columns: Sequence[Column], rows: np.ndarray) -> list[Column]:
    return [replace(c, values=c.values[rows]) for c in columns]


def _split_parameters(
    columns: Sequence[Column], given: Mapping[str, Meaning], time: np.ndarray, target: Target
) -> tuple[list[Parameter], list[Column], dict[str, str]]:  # fmt: skip
    """Columns that are parameters of the runs, the other columns, and the columns that are left out."""
    most = _count_runs(time)
    parameters, others, left_out = [], [], {}
    for column in columns:
        meaning = given.get(column.name)
        if np.isnan(column.values).all() or (meaning is not None and meaning.name == IGNORED):
            left_out[column.name] = "is left out by --column" if meaning else "has no numbers"
            continue
        key = target.find_key(column.plain) if meaning is None else meaning.name
        unit = find_unit((meaning.unit if meaning else "") or column.unit)
        if key in target.keys and unit is not None and unit.powers != target.keys[key].powers:
            if meaning is not None:
                raise SceneError(f"--column: {quoted(column.name)} is not {target.keys[key].name}, as {key} is")
            key = ""
        curve = meaning is not None and meaning.curve
        if key not in target.keys:
            others.append(column)
        elif curve or len(np.unique(column.values)) <= most:
            parameters.append(Parameter(column.plain, key, to_si(column.values, unit), curve))
        elif meaning is not None:
            raise SceneError(f"{quoted(column.name)} varies over time, as no {key} of a run does")
        elif target.find_quantity(column)[0]:
            others.append(column)  # A "current" that varies over time is the quantity, not the drive of the same name.
        else:
            left_out[column.name] = "varies over time"
    return parameters, others, left_out


def _choose(parameters: Sequence[Parameter], target: Target, count: int) -> tuple[np.ndarray, str]:
    """(count,): whether a row is of the scene's run, and in words "the run at V0 = 1 V of 0.5, 1, 2 V"."""
    if not parameters:
        return np.ones(count, dtype=bool), ""
    wanted = [(p, target.values.get(p.key, np.nan)) for p in parameters]
    fits: np.ndarray = np.all([np.isclose(p.values, value, rtol=_CLOSE, atol=1e-15) for p, value in wanted], axis=0)
    first, steady = parameters[0], target.quantities.steady
    curve = f'the whole curve: --column "{first.key} curve={first.name}"'
    if not fits.any():
        runs = (f"{p.name} ({p.key}) is {p.listed(target)}, in the scene {target.show(p.key, v)}" for p, v in wanted)
        value = target.show(first.key, float(first.values[0])).replace(" ", "")
        raise SceneError(
            f"it has no run of this scene: {'; '.join(runs)}: export that run, or set the scene: "
            f"--set {first.key}={value}{f', or compare {curve}' if steady else ''} "
            f'(--column "ignore={first.name}" where it is no such parameter)'
        )
    several = (f" of {p.listed(target)}" * (len(np.unique(p.values)) > 1) for p in parameters)
    runs = (f"{p.name} = {target.show(p.key, v)} ({p.key}){of}" for (p, v), of in zip(wanted, several, strict=True))
    return fits, f"the run at {', '.join(runs)}{f' ({curve})' if steady and fits.sum() < count else ''}"


def _is_one_run(time: np.ndarray) -> bool:
    """Whether times ascend, but for events: a solver stores a time twice there, before and after."""
    steps = np.diff(time)
    return bool((steps >= 0).all() and not ((steps[1:] == 0) & (steps[:-1] == 0)).any()
                and 2 * (steps == 0).sum() <= (steps > 0).sum())  # fmt: skip


def _count_runs(time: np.ndarray) -> int:
    """The number of runs below one another, or of runs whose rows take turns."""
    back = int((np.diff(time) < 0).sum())
    return back + 1 if back or _is_one_run(time) else int(np.unique(time, return_counts=True)[1].max())


def _pick_rows(
    rows: np.ndarray, time: np.ndarray, clock: Column | None, columns: Sequence[Column], target: Target, run: str
) -> tuple[np.ndarray, str]:  # fmt: skip
    """The rows of one run at ascending times, or the last one for the steady state, and a note.

    Raises SceneError for rows of several runs or states.
    """
    time, steady = time[rows], target.quantities.steady
    if steady and (len(rows) == 1 or (clock is not None and _is_one_run(time))):
        note = f"the last of {len(rows)} rows is taken for the steady state" if clock is not None else ""
        return rows[-1:], note
    if not steady and _is_one_run(time):
        last = np.append(np.diff(time) > 0, True)
        repeated = int((~last).sum())
        return rows[last], f"{repeated} of them twice, the second row is taken" if repeated else ""
    problem, runs = f"it has {len(rows)} rows where the scene has one steady state", len(rows)
    if not steady:
        row = int(np.flatnonzero(np.diff(time) <= 0)[0])
        problem = (
            f"it has the time {time[row + 1]:.9g} s after {time[row]:.9g} s: times that repeat or step back are of "
            "several runs, or rounded"
        )
        runs = _count_runs(time)
    telling = [c for c in _select(columns, rows) if 1 < len(np.unique(c.values)) <= runs]
    if not telling:
        raise SceneError(f"{run and f'{run}, '}{problem}: export one {'state' if steady else 'run, with more digits'}")
    name, values = telling[0].name, ", ".join(f"{v:g}" for v in list(dict.fromkeys(telling[0].values.tolist()))[:12])
    raise SceneError(
        f"{run and f'{run}, '}{problem}: {quoted(name)} ({values}) may tell them apart: say which key of the scene it "
        f"is, --column KEY={quoted(name)}"
    )
