"""One run out of a file: its time, its columns, its rows, and nothing that belongs to another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenes.errors import SceneError, quoted
from scenes.sink import Sink
from scenes.units import TIME
from validate.against import parameters, quantities
from validate.against.columns import Column, Table, in_si, unit_of
from validate.against.meanings import IGNORED, Meaning
from validate.against.parameters import Parameter


@dataclass(frozen=True)
class Picked:
    """The run that is compared: ``time`` in s and the name of its column, the columns that may be quantities, why
    others are none, and in words which run it is."""

    time: np.ndarray
    clock: str
    columns: tuple[Column, ...]
    left_out: Mapping[str, str]
    run: str


def pick(table: Table, given: Mapping[str, Meaning], sink: Sink, shown: str) -> Picked:
    """The run of the scene; SceneError where there is none, or several that the scene does not tell apart."""
    columns, beside = _beside(table.columns, given, sink, shown)
    time, clock, rest = _time(columns, table, given, shown)
    if not np.isfinite(time).all():
        raise SceneError(f"--against {shown}: its times are not all finite numbers")
    below, others, left = _below(rest, given, time, shown)
    fits, said = parameters.choose(shown, below, sink, len(time))
    time, others = time[fits], [replace(c, values=c.values[fits]) for c in others]
    again = np.flatnonzero(np.diff(time) <= 0)
    if len(again):
        raise SceneError(_several(shown, time, int(again[0]), others, said))
    return Picked(time, clock, tuple(others), left, "; ".join(filter(None, (beside, said))))


def constant(column: Column) -> str:
    """What to add of a column that is no quantity: where it is the same throughout, it may be a parameter."""
    if np.ptp(column.values) > 0:
        return ""
    value = f"{column.values[0]:g} {column.unit}".strip()
    return f" ({value} throughout; --column KEY={quoted(column.name)} holds it against the scene's)"


def _beside(
    columns: Sequence[Column], given: Mapping[str, Meaning], sink: Sink, shown: str
) -> tuple[list[Column], str]:  # fmt: skip
    """Of columns with parameters behind an "@" those of the scene's run, and in words which that is."""
    at = list(dict.fromkeys(c.at for c in columns if c.at))
    if not at:
        return list(columns), ""
    found: list[Parameter] = []
    untold: dict[str, list[str]] = {}
    for name in dict.fromkeys(name for pairs in at for name, _ in pairs):
        texts = [dict(pairs).get(name, "") for pairs in at]
        meaning = given.get(name)
        parameter = parameters.of_header(name, texts, *((meaning.what, meaning.unit) if meaning else (None,)))
        if parameter is not None:
            found.append(parameter)
        else:
            untold[name] = texts
    fits, said = parameters.choose(shown, found, sink, len(at))
    left = [pairs for pairs, fit in zip(at, fits, strict=True) if fit]
    if len(left) > 1:
        names = [name for name in untold if len({dict(pairs).get(name) for pairs in left}) > 1]
        raise SceneError(
            f"--against {shown} has {len(left)} runs beside one another: "
            + ("; ".join(f"{n} is {', '.join(dict(p).get(n, 'not given') for p in left[:12])}" for n in names))
            + f": say which key of the scene tells them apart, --column KEY={names[0] if names else 'V0'}"
        )
    said += "".join(f"; {name} = {texts[0]} is no key of the scene" for name, texts in untold.items())
    return [c for c in columns if not c.at or c.at == left[0]], said.removeprefix("; ")


def _time(
    columns: Sequence[Column], table: Table, given: Mapping[str, Meaning], shown: str
) -> tuple[np.ndarray, str, list[Column]]:  # fmt: skip
    """The times in s, the name of their column, and the others. A time that is repeated before every vector is one."""
    said = [c for c in columns if (m := given.get(c.name)) is not None and m.what == "time"]
    free = [c for c in columns if quantities.has_time(c) and c.name not in given]
    # Whatever it is called, the only column in a unit of time is the time.
    times = said or [c for c in free if quantities.is_time(c)] or free
    same = [c for c in times if c.unit == times[0].unit and np.array_equal(c.values, times[0].values)]
    if not times or len(same) != len(times):
        if table.unnamed and not times:
            raise SceneError(f"--against {shown}: {quantities.refusal(table, {})}")
        names = ", ".join(quoted(c.name) for c in (times or columns)[:8])
        told = "several columns are the time" if times else "no column is the time with its unit"
        raise SceneError(
            f'--against {shown}: {told}, such as "Time (s)" (or --column "time (s)=NAME"): there are {names}'
        )
    unit = unit_of((given[said[0].name].unit if said else "") or times[0].unit)
    if unit is None or unit.powers != TIME.powers:
        raise SceneError(f'--column: {quoted(times[0].name)} has no unit of time: say it, --column "time (s)=NAME"')
    return in_si(times[0].values, unit), times[0].name, [c for c in columns if all(c is not t for t in times)]


def _below(
    columns: Sequence[Column], given: Mapping[str, Meaning], time: np.ndarray, shown: str
) -> tuple[list[Parameter], list[Column], dict[str, str]]:  # fmt: skip
    """Columns that stand for keys of the scene as parameters of the runs below one another, the other columns, and
    what is left out."""
    found, others, left = [], [], {}
    for column in columns:
        meaning = given.get(column.name)
        said = meaning.what if meaning is not None and "." in meaning.what else None
        unit = meaning.unit if meaning is not None else ""
        parameter = parameters.of_column(column, said, unit) if said or meaning is None else None
        if meaning is not None and meaning.what == IGNORED:
            left[column.name] = "is left out by --column"
        elif parameter is None:
            others.append(column)
        elif not parameters.tells_apart(column.values, time):
            if said is not None:
                raise SceneError(
                    f"--against {shown}: {quoted(column.name)} varies over time, as no {said} of a run does"
                )
            left[column.name] = "varies over time"
        else:
            found.append(parameter)
    return found, others, left


def _several(shown: str, time: np.ndarray, row: int, columns: Sequence[Column], said: str) -> str:
    """Why rows are not those of one run, and by what they may be told apart."""
    telling = [
        c for c in columns if 1 < len(np.unique(c.values)) <= len(time) / 2 and parameters.tells_apart(c.values, time)
    ]
    of = f", {said}," if said else ""
    what = (
        f"--against {shown}{of} has the time {time[row + 1]:.9g} s after {time[row]:.9g} s: times that repeat or step "
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
