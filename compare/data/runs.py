"""Pick one run of a file: its times, its columns and its rows.

A sweep has its runs below one another with a column for each parameter. Parameters that stand for keys of the scene
decide on the run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.data.columns import Column, Table, has_time, is_time, scale_of, split_unit
from compare.data.targets import IGNORED, Meaning, Target, refusal
from scenes.errors import SceneError, quoted
from scenes.units import TIME

_CLOSE = 1e-4
"""Relative distance within which a parameter of a run is the scene's: tables round to five digits."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of the runs in a file: its name, the key of the scene, and the SI value of the key by row."""

    name: str
    key: str
    values: np.ndarray
    curve: bool = False

    def listed(self, target: Target) -> str:
        """The distinct values in words."""
        values = [target.show(self.key, value) for value in dict.fromkeys(self.values.tolist())]
        return ", ".join(values[:12]) + (f" and {len(values) - 12} more" if len(values) > 12 else "")


@dataclass(frozen=True)
class Run:
    """The run that is compared.

    ``time`` (rows,) in s or ``None``, ``clock`` the header of the time and ``how`` it was read where that is not plain,
    the ``columns`` that may be quantities, ``left_out`` the reasons of the others, the run in ``words``, and the
    ``curve`` over a parameter of the scene whose rows are steady states.
    """

    time: np.ndarray | None
    clock: str
    how: str
    columns: tuple[Column, ...]
    left_out: Mapping[str, str]
    words: str
    curve: Parameter | None = None


def pick(table: Table, given: Mapping[str, Meaning], target: Target, shown: str) -> Run:
    """Pick the run of the scene. Raises SceneError where there is none, or several that no key tells apart."""
    clock, how, columns = _find_time(table, given, target, shown)
    if clock is None:
        time = np.zeros(len(columns[0].values))
    else:
        time = clock.values
        filled = np.isfinite(time)
        if not filled.any():
            raise SceneError(f"--against {shown}: {quoted(clock.name)}, the time, is empty")
        if not filled.all():
            columns = [replace(c, values=c.values[filled]) for c in columns]
            how = "; ".join(filter(None, (how, f"{(~filled).sum()} rows without one are left out")))
            time = time[filled]
    parameters, columns, omitted = _below(columns, given, time, target, shown)
    over = next((p for p in parameters if p.curve), None)
    fits, words = _choose(shown, [p for p in parameters if not p.curve], target, len(time))
    if over is not None:
        # A scene that nothing drives is refused, and so its row of zeros has no 3D.
        fits &= over.values != 0
        words += f"{words and '; '}rows at {over.name} = 0 are left out" if (over.values == 0).any() else ""
    time, columns = time[fits], [replace(c, values=c.values[fits]) for c in columns]
    if over is not None and target.quantities.steady:
        rows, said = np.arange(len(time)), ""
        over = replace(over, values=over.values[fits])
        words = "; ".join(filter(None, (words, f"the curve over {over.name} ({over.key}) at {over.listed(target)}")))
    elif over is not None:
        raise SceneError(f"--against {shown}: a curve over {over.name} is one of steady states: give --steady")
    elif target.quantities.steady:
        rows, said = _settled(time, clock, columns, parameters, target, shown)
    else:
        rows, said = _ascending(time, columns, target, words, shown)
    how = "; ".join(filter(None, (how, said)))
    columns = [replace(c, values=c.values[rows]) for c in columns]
    return Run(time[rows] if clock else None, clock.name if clock else "", how, tuple(columns), omitted, words, over)


def _find_time(
    table: Table, given: Mapping[str, Meaning], target: Target, shown: str
) -> tuple[Column | None, str, list[Column]]:  # fmt: skip
    """The column of times in s, how it was read where that is not plain, and the other columns."""
    columns = table.columns
    named = [c for c in columns if (m := given.get(c.name)) is not None and m.name == "time"]
    free = [c for c in columns if has_time(c) and c.name not in given]
    words = ("time", "zeit", "t")
    bare = [replace(c, unit="s") for c in columns if c.name.lower() in words and not c.unit and c.name not in given]
    # The only column in a unit of time is the time, whatever its name.
    times = named or [c for c in free if is_time(c)] or free or bare
    same = [c for c in times if c.unit == times[0].unit and np.array_equal(c.values, times[0].values, equal_nan=True)]
    if not times and target.quantities.steady:
        return None, "", list(columns)
    if not times or len(same) != len(times):
        if table.unnamed and not times:
            raise SceneError(f"--against {shown}: {refusal(table, {}, target)}")
        names = ", ".join(quoted(c.name) for c in (times or columns)[:8])
        problem = "several columns are the time" if times else "no column is the time with its unit"
        raise SceneError(
            f'--against {shown}: {problem}, such as "Time (s)" (or --column "time (s)=NAME"): there are {names}'
        )
    scale = scale_of((given[named[0].name].unit if named else "") or times[0].unit)
    if scale is None or scale.powers != TIME.powers:
        raise SceneError(f'--column: {quoted(times[0].name)} has no unit of time: say it, --column "time (s)=NAME"')
    names_of_time = {c.name for c in times}
    clock = replace(times[0], values=scale.to_si(times[0].values))
    how = "it has no unit and is taken in s" if times is bare else ""
    return clock, how, [c for c in columns if c.name not in names_of_time]


def _below(
    columns: Sequence[Column], given: Mapping[str, Meaning], time: np.ndarray, target: Target, shown: str
) -> tuple[list[Parameter], list[Column], dict[str, str]]:  # fmt: skip
    """Columns that are parameters of runs below one another, the other columns, and the columns that are left out."""
    back = int((np.diff(time) < 0).sum())
    runs = back + 1 if back or _is_one_run(time) else int(np.unique(time, return_counts=True)[1].max())
    parameters, others, omitted = [], [], {}
    for column in columns:
        meaning = given.get(column.name, Meaning(""))
        key = meaning.name if meaning.name in target.keys else None
        if meaning.name == IGNORED:
            omitted[column.name] = "is left out by --column"
            continue
        parameter = _as_parameter(target, column, key, meaning.unit) if key or column.name not in given else None
        if parameter is not None and (len(np.unique(parameter.values)) <= runs or meaning.curve):
            parameters.append(replace(parameter, curve=meaning.curve))
        elif parameter is None or (key is None and _is_quantity(column, target)):
            # A "current" that varies over time is the quantity, not the drive of the same name.
            others.append(column)
        elif key is None:
            omitted[column.name] = "varies over time"
        else:
            raise SceneError(f"--against {shown}: {quoted(column.name)} varies over time, as no {key} of a run does")
    return parameters, others, omitted


def _is_quantity(column: Column, target: Target) -> bool:
    scale = scale_of(column.unit)
    return bool(target.find(column.name, None if scale is None else scale.powers, False)[0])


def _as_parameter(target: Target, column: Column, key: str | None, unit: str) -> Parameter | None:
    """A column as the key that --column names, or as the key of its own name and unit; ``None`` for none."""
    found = key or target.key_of(split_unit(column.name)[0])
    if found is None:
        return None
    scale, dimension = scale_of(unit or column.unit), target.keys[found]
    if scale is not None and scale.powers != dimension.powers:
        if key is None:
            return None
        raise SceneError(f"--column: {quoted(column.name)} is not {dimension.name}, as {key} is")
    return Parameter(split_unit(column.name)[0], found, column.values if scale is None else scale.to_si(column.values))


def _choose(shown: str, parameters: Sequence[Parameter], target: Target, count: int) -> tuple[np.ndarray, str]:
    """(count,): the rows of the scene's run, and in words "the run at V0 = 1 V of 0.5, 1, 2 V"."""
    if not parameters:
        return np.ones(count, dtype=bool), ""
    wanted = [target.values.get(p.key, np.nan) for p in parameters]
    close = [np.isclose(p.values, w, rtol=_CLOSE, atol=1e-15) for p, w in zip(parameters, wanted, strict=True)]
    fits: np.ndarray = np.all(close, axis=0)
    if not fits.any():
        first = parameters[0]
        value = target.show(first.key, float(first.values[0])).replace(" ", "")
        raise SceneError(
            f"--against {shown} has no run of this scene: "
            + "; ".join(
                f"{p.name} ({p.key}) is {p.listed(target)}, in the scene {target.show(p.key, w)}"
                for p, w in zip(parameters, wanted, strict=True)
            )
            + f": export that run, or set the scene: --set {first.key}={value}"
            + (
                f', or compare the whole curve: --column "{first.key} curve={first.name}"'
                if target.quantities.steady
                else ""
            )
            + f' (--column "ignore={first.name}" where it is no such parameter)'
        )
    several = (f" of {p.listed(target)}" * (len(np.unique(p.values)) > 1) for p in parameters)
    words = (
        f"{p.name} = {target.show(p.key, w)} ({p.key}){others}"
        for p, w, others in zip(parameters, wanted, several, strict=True)
    )
    said = f"the run at {', '.join(words)}"
    if target.quantities.steady and fits.sum() < count:
        said += f' (the whole curve: --column "{parameters[0].key} curve={parameters[0].name}")'
    return fits, said


def _is_one_run(time: np.ndarray) -> bool:
    """Whether times ascend, but for events: a solver stores a time twice there, before and after."""
    steps = np.diff(time)
    return bool((steps >= 0).all() and not ((steps[1:] == 0) & (steps[:-1] == 0)).any()
                and 2 * (steps == 0).sum() <= (steps > 0).sum())  # fmt: skip


def _ascending(
    time: np.ndarray, columns: Sequence[Column], target: Target, words: str, shown: str
) -> tuple[np.ndarray, str]:  # fmt: skip
    """The rows of a run whose times ascend. Raises SceneError for times of several runs."""
    if _is_one_run(time):
        last = np.append(np.diff(time) > 0, True)
        repeated = int((~last).sum())
        return last, f"{repeated} of them twice, the second row is taken" if repeated else ""
    row = int(np.flatnonzero(np.diff(time) <= 0)[0])
    runs = max(int((np.diff(time) < 0).sum()) + 1, int(np.unique(time, return_counts=True)[1].max()))
    telling = [c for c in columns if 1 < len(np.unique(c.values)) <= runs]
    problem = (
        f"--against {shown}{f', {words},' if words else ''} has the time {time[row + 1]:.9g} s "
        f"after {time[row]:.9g} s: times that repeat or step back are of several runs, or rounded"
    )
    if not telling:
        raise SceneError(f"{problem}: export one run, with more digits")
    name, values = telling[0].name, ", ".join(f"{v:g}" for v in list(dict.fromkeys(telling[0].values.tolist()))[:12])
    raise SceneError(
        f"{problem}: {quoted(name)} ({values}) may tell them apart: say which key of the scene it is, "
        f"--column KEY={quoted(name)}"
    )


def _settled(
    time: np.ndarray, clock: Column | None, columns: Sequence[Column], parameters: Sequence[Parameter],
    target: Target, shown: str,
) -> tuple[np.ndarray, str]:  # fmt: skip
    """The one row of a steady state: the last of its times. Raises SceneError for rows of several states."""
    if clock is not None and _is_one_run(time):
        return np.array([len(time) - 1]), f"the last of {len(time)} rows is taken for the steady state"
    if len(time) == 1:
        return np.array([0]), ""
    names = [c.name for c in columns if len(np.unique(c.values)) > 1]
    raise SceneError(
        f"--against {shown} has {len(time)} rows where the scene has one steady state: give one row, or a column of a "
        f"parameter of the scene that tells rows apart, --column KEY={quoted(names[0] if names else 'V0')}"
    )
