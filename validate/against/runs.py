"""One run out of a file: its time, its columns, its rows, and nothing that belongs to another.

COMSOL writes the runs of a parametric sweep below one another with a column for each parameter, or beside one another
with the parameters behind an "@" in the headers: which run is that of the scene is told by those that stand for its
keys. `--column` says "peak=T (K), Point 1", "peak rise (K)=3", "sink.width=w0 (um)", each a name for a column.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from scenes.errors import SceneError, did_you_mean, printable, quoted
from scenes.units import TIME, UnitError, parse_quantity
from validate.against import quantities
from validate.against.quantities import IGNORED, Meaning, Subject
from validate.against.tables import Column, Table, has_time, in_si, is_time, split, unit_of

_CLOSE = 1e-4
"""A run's parameter counts as the scene's within this relative distance: tables round to five digits, and differences
move by a few times this at most."""
_MANY = 100_000
"""Rows that are searched for a parameter's distinct values."""
_VOLTAGE = re.compile(r"[vu](_?(0|in|app|applied|dc|drive|src|source|tot))?", re.IGNORECASE)
_BARE = re.compile(r"[-+.\deE\s]+")


@dataclass(frozen=True)
class Parameter:
    """A parameter of the file's runs: its name there, the scene's key that it stands for, that key's SI value for each
    row or header, and its distinct values in words."""

    name: str
    path: str
    values: np.ndarray
    shown: tuple[str, ...]

    def matches(self, subject: Subject) -> np.ndarray:
        wanted = subject.values(self.path)
        return np.isclose(self.values, np.nan if wanted is None else wanted, rtol=_CLOSE, atol=1e-15)

    def of(self, subject: Subject) -> str:
        """The key's value in the scene, in words."""
        return subject.kinds[self.path].show(subject.values(self.path))

    @property
    def listed(self) -> str:
        return ", ".join(self.shown[:12]) + (f" and {len(self.shown) - 12} more" if len(self.shown) > 12 else "")


def key_of(subject: Subject, name: str) -> str | None:
    """The path of the scene's key that a name stands for: "drive.voltage", "voltage", "V0"; ``None`` for none."""
    plain = re.sub(r"\s+", "_", name.strip()).lower()
    by_lower = {path.lower(): path for path in subject.kinds}
    ends = [path for path in by_lower if f".{path}".endswith(f".{plain}")]
    ends = [path for path in ends if path == f"{subject.main}.{plain}"] or ends
    if plain in by_lower or len(ends) == 1:
        return by_lower[plain if plain in by_lower else ends[0]]
    return "drive.voltage" if "drive.voltage" in by_lower and _VOLTAGE.fullmatch(plain) else None


def of_column(subject: Subject, column: Column, path: str | None, unit: str = "") -> Parameter | None:
    """A column as the key that it is said to stand for, or the one of its name if it has that key's unit; ``None`` for
    none. SceneError where what is said can't be."""
    key = path or key_of(subject, split(column.name)[0])
    if key is None:
        return None
    said = unit_of(unit or column.unit)
    dimension = subject.kinds[key].dimension
    if said is not None and said.powers != dimension.powers:
        if path is None:
            return None
        raise SceneError(f"--column: {quoted(column.name)} is not {dimension.name}, as {key} is")
    values = column.values if said is None else in_si(column.values, said)
    distinct = dict.fromkeys(values[:_MANY].tolist())
    return Parameter(split(column.name)[0], key, values, tuple(_show(subject, key, value) for value in distinct))


def of_header(
    subject: Subject, name: str, texts: Sequence[str], path: str | None, unit: str = ""
) -> Parameter | None:  # fmt: skip
    """A parameter behind the headers' "@", a text for each run, as a scene's key; ``None`` where it stands for none."""
    key = path or key_of(subject, name)
    if key is None:
        return None
    values = []
    for text in texts:
        spelled = text.replace("[", " ").replace("]", "")
        try:
            value, said = parse_quantity(f"{spelled} {unit}" if unit and _BARE.fullmatch(spelled) else spelled)
        except UnitError:
            return None
        if said is not None and said.powers != subject.kinds[key].dimension.powers:
            return None
        values.append(value)
    return Parameter(name, key, np.array(values), tuple(dict.fromkeys(texts)))


def choose(shown: str, parameters: Sequence[Parameter], subject: Subject, count: int) -> tuple[np.ndarray, str]:
    """Which of ``count`` rows or headers are of the scene's run, and a text on that: "the run at V0 = 1 V of 0.5, 1,
    2 V". SceneError, with the choices, where none is. All are where there is no parameter."""
    if not parameters:
        return np.ones(count, dtype=bool), ""
    fits: np.ndarray = np.all([p.matches(subject) for p in parameters], axis=0)
    if not fits.any():
        first = parameters[0]
        value = _show(subject, first.path, float(first.values[0])).replace(" ", "")
        raise SceneError(
            f"--against {shown} has no run of this scene: "
            + "; ".join(f"{p.name} ({p.path}) is {p.listed}, in the scene {p.of(subject)}" for p in parameters)
            + f": export that run, or set the scene: --set {first.path}={value}"
            + f' (--column "ignore={first.name}" where it is no such parameter)'
        )
    several = (f" of {p.listed}" * (len(p.shown) > 1) for p in parameters)
    said = (f"{p.name} = {p.of(subject)} ({p.path}){others}" for p, others in zip(parameters, several, strict=True))
    return fits, f"the run at {', '.join(said)}"


def tells_apart(values: np.ndarray, time: np.ndarray) -> bool:
    """Whether values are those of a parameter: the same throughout each run that stands below another, or, where the
    rows of runs take turns, each as often as any other."""
    breaks = [0, *(np.flatnonzero(np.diff(time) <= 0) + 1).tolist(), len(time)]
    if all(bool((values[a:b] == values[a]).all()) for a, b in pairwise(breaks)):
        return True
    counts = np.unique(values, return_counts=True)[1]
    return len(breaks) > 2 and bool(counts[0] > 2 and (counts == counts[0]).all())


def _show(subject: Subject, path: str, value: float) -> str:
    return subject.kinds[path].show(float(f"{value:.6g}"))


def meanings(subject: Subject, table: Table, given: Sequence[str]) -> dict[str, Meaning]:
    """The meaning of columns and of parameters behind an "@" by their names. SceneError for what names no quantity, no
    column, or one of them twice."""
    meanings: dict[str, Meaning] = {}
    for text in given:
        quantity, equals, wanted = (part.strip() for part in text.partition("="))
        if not equals or not quantity or not wanted:
            raise SceneError(f'--column {quoted(text)}: give NAME=COLUMN, such as peak="T (K), Point 1"')
        meaning = _meaning(subject, quantity)
        name = _column(table, wanted, text)
        if name in meanings:
            raise SceneError(f"--column {quoted(text)}: {quoted(name)} is the {meanings[name].what} already")
        if meaning.what != IGNORED and meaning.what in (other.what for other in meanings.values()):
            raise SceneError(f"--column {quoted(text)}: another column is the {meaning.what} already")
        meanings[name] = meaning
    return meanings


def _meaning(subject: Subject, quantity: str) -> Meaning:
    name, unit = split(quantity)
    names, lower = subject.names, {word.lower(): name for word, name in subject.names.items()}
    for text in (quantity, name):
        if text.strip().lower() in lower:
            return Meaning(lower[text.strip().lower()], unit if text == name else "")
    plain = re.sub(r"\s*\brise\b\s*", "", name, flags=re.IGNORECASE).strip().lower()
    if plain in ("time", IGNORED):
        return Meaning(plain, unit)
    if plain in lower:
        return Meaning(lower[plain], unit, plain != name.strip().lower())
    path = key_of(subject, plain)
    if path is None:
        choices = ("time", *names, IGNORED)
        example = "drive.voltage" if "drive.voltage" in subject.kinds else next(iter(subject.kinds), "")
        key = f", or a key of the scene such as {example}" if example else ""
        raise SceneError(
            f"--column {quoted(quantity)} is no quantity: give {', '.join(choices)}{key}{did_you_mean(plain, choices)}"
        )
    return Meaning(path, unit)


def _column(table: Table, wanted: str, text: str) -> str:
    """The name of the column that is wanted: as the header has it, without its unit if that is enough, or by number."""
    names = list(dict.fromkeys(c.name for c in table.columns))
    parameters = list(dict.fromkeys(name for c in table.columns for name, _ in c.at))
    plain = " ".join(wanted.split())
    for candidate in (*names, *parameters):
        behind = next((c.at for c in table.columns if c.name == candidate), ())
        if plain in (candidate, f"{candidate} @ {', '.join(f'{key}={value}' for key, value in behind)}"):
            return candidate
    loose = [name for name in (*names, *parameters) if plain.lower() in (name.lower(), split(name)[0].lower())]
    if len(loose) == 1:
        return loose[0]
    if wanted.isdigit() and 0 < int(wanted) <= len(table.columns):
        name = table.columns[int(wanted) - 1].name
        if sum(c.name == name for c in table.columns) > 1:
            raise SceneError(f"--column: several columns are called {quoted(printable(name))}, so no number tells them")
        return name
    shown = ", ".join(quoted(name) for name in (*names[:12], *parameters[:4]))
    raise SceneError(f"--column {quoted(text)}: no column is called so: there are {shown}{did_you_mean(plain, names)}")


@dataclass(frozen=True)
class Picked:
    """The run that is compared: ``time`` in s, the name of its column and how it was read where that is not plain; the
    columns that may be quantities, why others are none, and in words which run it is."""

    time: np.ndarray
    clock: str
    how: str
    columns: tuple[Column, ...]
    left_out: Mapping[str, str]
    run: str


def pick(table: Table, given: Mapping[str, Meaning], subject: Subject, shown: str) -> Picked:
    """The run of the scene; SceneError where there is none, or several that the scene does not tell apart."""
    columns, beside = _beside(table.columns, given, subject, shown)
    clock, how, rest = _time(columns, table, given, subject, shown)
    if clock.empty.any():
        rest = [c.of_rows(~clock.empty) for c in rest]
        how = "; ".join(filter(None, (how, f"{clock.empty.sum()} rows without one are left out")))
        clock = clock.of_rows(~clock.empty)
    time = clock.values
    if not len(time):
        raise SceneError(f"--against {shown}: {quoted(clock.name)}, the time, is empty")
    unknown = np.flatnonzero(~np.isfinite(time))
    if len(unknown):
        raise SceneError(
            f"--against {shown}: {quoted(clock.name)} is {time[unknown[0]]} at number {unknown[0] + 1} of {len(time)} "
            "times: give finite ones, or leave such rows out"
        )
    below, others, omitted = _below(rest, given, time, subject, shown)
    fits, said = choose(shown, below, subject, len(time))
    time, others = time[fits], [c.of_rows(fits) for c in others]
    again = np.flatnonzero(np.diff(time) <= 0)
    if len(again):
        raise SceneError(_several(shown, time, int(again[0]), others, said))
    return Picked(time, clock.name, how, tuple(others), omitted, "; ".join(filter(None, (beside, said))))


def constant(column: Column) -> str:
    """What to add of a column that is no quantity: where it is the same throughout, it may be a parameter."""
    if np.ptp(column.values) > 0:
        return ""
    value = f"{column.values[0]:g} {column.unit}".strip()
    return f" ({value} throughout; --column KEY={quoted(column.name)} holds it against the scene's)"


def _beside(
    columns: Sequence[Column], given: Mapping[str, Meaning], subject: Subject, shown: str
) -> tuple[list[Column], str]:  # fmt: skip
    """Of columns with parameters behind an "@" those of the scene's run, and in words which that is."""
    at = list(dict.fromkeys(c.at for c in columns if c.at))
    if not at:
        return list(columns), ""
    parameters: list[Parameter] = []
    untold: dict[str, list[str]] = {}
    for name in dict.fromkeys(name for pairs in at for name, _ in pairs):
        texts = [dict(pairs).get(name, "") for pairs in at]
        meaning = given.get(name, Meaning(""))
        if meaning.what not in ("", IGNORED, *subject.kinds):
            raise SceneError(f"--column: {quoted(name)} is a parameter of runs, which can be a key of the scene only")
        parameter = (
            of_header(subject, name, texts, meaning.what or None, meaning.unit) if meaning.what != IGNORED else None
        )
        if parameter is None:
            untold[name] = texts
        else:
            parameters.append(parameter)
    fits, said = choose(shown, parameters, subject, len(at))
    remaining = [pairs for pairs, fit in zip(at, fits, strict=True) if fit]
    if len(remaining) > 1:
        names = [name for name in untold if len({dict(pairs).get(name) for pairs in remaining}) > 1]
        raise SceneError(
            f"--against {shown} has {len(remaining)} runs beside one another: "
            + ("; ".join(f"{n} is {', '.join(dict(p).get(n, 'not given') for p in remaining[:12])}" for n in names))
            + f": say which key of the scene tells them apart, --column KEY={names[0] if names else 'V0'}"
        )
    for name, texts in untold.items():
        said += f"; {name} = {texts[0]} is {'left out by --column' if name in given else 'no key of the scene'}"
    return [c for c in columns if not c.at or c.at == remaining[0]], said.removeprefix("; ")


def _time(
    columns: Sequence[Column], table: Table, given: Mapping[str, Meaning], subject: Subject, shown: str
) -> tuple[Column, str, list[Column]]:  # fmt: skip
    """The column of times in s, how it was read where that is not plain, and the other columns. A time that is repeated
    before every vector is one."""
    said = [c for c in columns if (m := given.get(c.name)) is not None and m.what == "time"]
    free = [c for c in columns if has_time(c) and c.name not in given]
    bare = [replace(c, unit="s") for c in columns if c.name.lower() == "time" and not c.unit and c.name not in given]
    # Whatever it is called, the only column in a unit of time is the time.
    times = said or [c for c in free if is_time(c)] or free or bare
    same = [c for c in times if c.unit == times[0].unit and np.array_equal(c.values, times[0].values, equal_nan=True)]
    if not times or len(same) != len(times):
        if table.unnamed and not times:
            raise SceneError(f"--against {shown}: {quantities.refusal(table, {}, subject)}")
        names = ", ".join(quoted(c.name) for c in (times or columns)[:8])
        problem = "several columns are the time" if times else "no column is the time with its unit"
        raise SceneError(
            f'--against {shown}: {problem}, such as "Time (s)" (or --column "time (s)=NAME"): there are {names}'
        )
    unit = unit_of((given[said[0].name].unit if said else "") or times[0].unit)
    if unit is None or unit.powers != TIME.powers:
        raise SceneError(f'--column: {quoted(times[0].name)} has no unit of time: say it, --column "time (s)=NAME"')
    clock = replace(times[0], values=in_si(times[0].values, unit))
    how = "it has no unit and is taken in s" if times is bare else ""
    names_of_time = {c.name for c in times}
    return clock, how, [c for c in columns if c.name not in names_of_time]


def _below(
    columns: Sequence[Column], given: Mapping[str, Meaning], time: np.ndarray, subject: Subject, shown: str
) -> tuple[list[Parameter], list[Column], dict[str, str]]:  # fmt: skip
    """Columns that are parameters of runs below one another, the other columns, and what is left out."""
    parameters, others, omitted = [], [], {}
    for column in columns:
        meaning = given.get(column.name, Meaning(""))
        said = meaning.what if meaning.what in subject.kinds else None
        parameter = of_column(subject, column, said, meaning.unit) if said or column.name not in given else None
        if meaning.what == IGNORED:
            omitted[column.name] = "is left out by --column"
        elif parameter is None:
            others.append(column)
        elif tells_apart(column.values, time):
            parameters.append(parameter)
        elif said is None:
            omitted[column.name] = "varies over time"
        else:
            raise SceneError(f"--against {shown}: {quoted(column.name)} varies over time, as no {said} of a run does")
    return parameters, others, omitted


def _several(shown: str, time: np.ndarray, row: int, columns: Sequence[Column], said: str) -> str:
    """Why rows are not those of one run, and by what they may be told apart."""
    telling = [c for c in columns if 1 < len(np.unique(c.values)) <= len(time) / 2 and tells_apart(c.values, time)]
    run = f", {said}," if said else ""
    what = (
        f"--against {shown}{run} has the time {time[row + 1]:.9g} s after {time[row]:.9g} s: times that repeat or step "
        "back are of several runs, or rounded"
    )
    if not telling:
        return f"{what}: export one run, with more digits"
    name = telling[0].name
    values = ", ".join(f"{value:g}" for value in list(dict.fromkeys(telling[0].values.tolist()))[:12])
    return (
        f"{what}: {quoted(name)} ({values}) may tell them apart: say which key of the scene it is, "
        f"--column KEY={quoted(name)}"
    )
