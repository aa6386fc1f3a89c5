"""Pick one run of a file: its times, its columns and its rows.

A sweep has its runs below one another with a column for each parameter. Parameters that stand for keys of the scene
decide on the run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.data.columns import Column, Table, find_unit, to_si
from compare.data.match import IGNORED, Meaning, find_time
from compare.data.target import Target
from scenes.errors import SceneError, quoted

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
