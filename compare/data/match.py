"""Match the columns of a file to quantities and keys of the scene, and pick one run of the file.

Columns are matched by `--column`, or by their names and units. A sweep has its runs below one another with a column for
each parameter; parameters that stand for keys of the scene decide on the run.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from compare.data.columns import Column, refusing, split_unit
from compare.data.target import RISE_WORDS, Target
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.units import CURRENT, TEMPERATURE, TIME, VOLTAGE, called, parse_unit

IGNORED = "ignore"
"""The role of a column that is left out."""
_DIFFERENCE = re.compile(r"\bT\)?\s*-\s*[\dT]")
_NEAR_INITIAL = 0.05
"""Part of the initial temperature (K), or of the change in degC, within which a trace starts there."""
_ZERO = 0.005
"""Part of its change within which a rise starts at zero."""
_CLOSE = 1e-4
"""Relative distance within which a parameter of a run is the scene's: tables round to five digits."""


def assign(target: Target, read: Sequence[Column], given: Sequence[str]) -> list[Column]:
    """Return the columns with the roles, and the units, that `--column NAME=COLUMN` gives them. Raises SceneError."""
    columns = {column.name: column for column in read}
    roles: dict[str, str] = {}
    for text in given:
        with refusing(f"--column {quoted(text)}"):
            quantity, equals, wanted = (part.strip() for part in text.partition("="))
            if not equals or not quantity or not wanted:
                raise SceneError('give NAME=COLUMN, such as peak="T (K), Point 1"')
            role, unit, kind = _read_role(target, quantity)
            name = _find_column(read, wanted)
            if name in roles:
                raise SceneError(f"{quoted(name)} is the {roles[name]} already")
            if role != IGNORED and role in roles.values():
                raise SceneError(f"another column is the {role} already")
            roles[name] = role
            columns[name] = replace(columns[name], role=role, kind=kind, unit=unit or columns[name].unit)
    # Vectors of ngspice may share one name, the time, which stands before each.
    return [columns[column.name] if column.name in roles else column for column in read]


def _read_role(target: Target, text: str) -> tuple[str, str, str]:
    """Role, unit, and "rise" or "curve", of "time (ms)", "peak rise (K)", "drive.voltage curve" or "ignore"."""
    words = {word.lower(): key for word, key in target.quantities.names.items()}
    name, unit = (text, "") if text.lower() in words else split_unit(text)
    plain = name if name.lower() in words else re.sub(r"\s*\brise\b\s*", "", name, flags=re.IGNORECASE).strip()
    if plain.lower() in ("time", IGNORED, *words):
        return words.get(plain.lower(), plain.lower()), unit, "rise" * (plain != name)
    path = target.find_key(plain.removesuffix(" curve"))
    if not path:
        choices = ("time", *target.quantities.names, IGNORED)
        example = "drive.voltage" if "drive.voltage" in target.keys else next(iter(target.keys), "")
        key = f", or a key of the scene such as {example}" if example else ""
        raise SceneError(f"it is no quantity: give {', '.join(choices)}{key}{did_you_mean(plain, choices)}")
    return path, unit, "curve" * plain.endswith(" curve")


def _find_column(columns: Sequence[Column], wanted: str) -> str:
    """The name of a column: as the header has it, without its unit where that is enough, or by number."""
    names = list(dict.fromkeys(c.name for c in columns))
    plain = " ".join(wanted.split())
    loose = [c.name for c in columns if plain.lower() in (c.name.lower(), c.plain.lower())]
    if plain in names or len(set(loose)) == 1:
        return plain if plain in names else loose[0]
    if wanted.isdigit() and 0 < int(wanted) <= len(columns):
        return columns[int(wanted) - 1].name
    shown = ", ".join(map(quoted, names[:12]))
    raise SceneError(f"no column is called so: there are {shown}{did_you_mean(plain, names)}")


def _find_time(columns: Sequence[Column], steady: bool) -> Run:
    """The run of all rows, with the column of times and the other columns."""
    free = [c for c in columns if c.powers == TIME.powers and not c.role]
    bare = [c for c in columns if c.name.lower() in ("time", "zeit", "t") and not c.unit and not c.role]
    # The only column in a unit of time is the time, whatever its name.
    times = [c for c in columns if c.role == "time"] or [c for c in free if c.is_time] or free or bare
    same = [c for c in times if c.unit == times[0].unit and np.array_equal(c.values, times[0].values, equal_nan=True)]
    if not times and steady:
        return Run("", np.zeros(len(columns[0].values)), list(columns))
    if not times or len(same) != len(times):
        names = ", ".join(quoted(c.name) for c in (times or columns)[:8])
        problem = "several columns are the time" if times else "no column is the time with its unit"
        raise SceneError(f'{problem}, such as "Time (s)" (or --column "time (s)=NAME"): there are {names}')
    clock = replace(times[0], unit="s") if times is bare else times[0]
    if clock.powers != TIME.powers:
        raise SceneError(f'--column: {quoted(clock.name)} has no unit of time: say it, --column "time (s)=NAME"')
    others = {c.name for c in times}
    how = "it has no unit and is taken in s" if times is bare else ""
    return Run(clock.name, clock.si, [c for c in columns if c.name not in others], how)


@dataclass(frozen=True)
class Match:
    """The column of a quantity: ``values`` in SI units, temperatures absolute, NaN in rows to leave out."""

    key: str
    header: str
    values: np.ndarray
    note: str = ""


def match_column(column: Column, target: Target) -> Match | str:
    """Return the quantity of a column, or why it is none. Raises SceneError where --column gives another unit."""
    if not column.role and "reduced1d" in column.name.lower():
        return "is of a 1D model"
    key, note = (column.role, "") if column.role else target.find_quantity(column)
    if not key:
        return note
    symbol, notes = target.quantities.units[key], [note]
    wanted, bare = parse_unit(symbol), column.powers is None
    if column.spice and column.powers == VOLTAGE.powers != wanted.powers:
        # A circuit has volts for all that is no current.
        notes.append(f"volts taken for {'kelvins' if symbol == 'K' else symbol}")
        column = replace(column, unit=symbol)
    elif bare:
        notes.append(f"it has no unit and is taken in {symbol}")
        column = replace(column, unit=symbol)
    if column.powers is not None and column.powers != wanted.powers:
        why = f"is {called(column.powers)}, not {called(wanted.powers)}"
        if not column.role:
            return why
        raise SceneError(f"--column: {quoted(column.name)} can't be the {target.quantities.word(key)}: it {why}")
    values = column.si
    if wanted.powers == TEMPERATURE.powers:
        values, how = _make_absolute(target, key, column)
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


def _make_absolute(target: Target, key: str, column: Column) -> tuple[np.ndarray, str]:
    """Absolute temperatures (K) of a column, and a note.

    Without a word for a rise, the whole column decides: its numbers other than zero are absolute where they start at
    the initial temperature of the scene, or where all are above half of it. Zeros of such a column are placeholders.
    """
    initial = target.quantities.initial
    words = set(re.findall(r"[a-z]+", column.name.lower()))
    named = bool(words & RISE_WORDS or _DIFFERENCE.search(column.name)) and target.quantities.word(key) != column.name
    if named or column.kind == "rise":
        return column.differences + initial, "a rise"
    values, zero = column.si, column.values == 0
    kept = values[~np.isnan(values) & ~zero]
    starts = bool(kept.size) and abs(kept[0] - initial) <= _NEAR_INITIAL * initial
    if not (starts or (kept > initial / 2).all()) or not kept.size:
        first = float(values[~np.isnan(values)][0])
        return values + initial, f"a rise, for it starts at {first:.4g} K"
    if column.is_celsius:
        # 0 degC is a temperature, but at the top of a column that goes on at the initial temperature.
        zero &= (np.cumsum(~zero) == 0) & bool(abs(kept[0] - initial) <= _NEAR_INITIAL * np.ptp(kept))
    if not zero.any():
        return values, ""
    return np.where(zero, np.nan, values), f"{zero.sum()} placeholder rows of zeros"


def refusal(columns: Sequence[Column], reasons: Mapping[str, str], target: Target) -> str:
    """Return why no column of a file is a quantity of the scene."""
    names = target.quantities.names
    first = next(iter(names))
    shown = list(dict.fromkeys(c.name for c in columns))[:8]
    listed = "; ".join(f"{quoted(name)} {reasons.get(name, 'is the time')}" for name in shown)
    return (
        f"none of its columns is {target.called}: {listed}; name them {target.example}, or say which they are: "
        f'--column "{first} ({target.quantities.units[names[first]]})=NAME"'
    )


@dataclass
class Run:
    """The run that is compared.

    Attributes
    ----------
    clock : the name of the column of times, "" for none
    time : (rows,) in s, zeros without times
    columns : the columns that may be quantities
    how : how the time was read where that is not plain
    left_out : the reasons of the other columns
    words : the run in words
    curve : the key of the scene and its values (rows,), at which the rows are steady states, or ``None``
    """

    clock: str
    time: np.ndarray
    columns: list[Column]
    how: str = ""
    left_out: dict[str, str] = field(default_factory=dict)
    words: str = ""
    curve: tuple[str, np.ndarray] | None = None

    def keep(self, rows: np.ndarray, note: str = "") -> None:
        """Keep some rows, and note why."""
        self.columns, self.time = [c.at(rows) for c in self.columns], self.time[rows]
        self.how = "; ".join(filter(None, (self.how, note)))


def pick(columns: Sequence[Column], target: Target) -> Run:
    """Return the run of the scene. Raises SceneError where there is none, or several that no key tells apart."""
    run = _find_time(columns, target.quantities.steady)
    filled = np.isfinite(run.time)
    if not filled.any():
        raise SceneError(f"{quoted(run.clock)}, the time, is empty")
    run.keep(filled, "" if filled.all() else f"{(~filled).sum()} rows without one are left out")
    parameters = _take_parameters(run, target)
    curve = next((p for p in parameters if p.kind == "curve"), None)
    fits, run.words = _choose([p for p in parameters if p is not curve], target, len(run.time))
    if curve is None:
        _keep_one_run(run, fits, target)
    elif not target.quantities.steady:
        raise SceneError(f"a curve over {curve.plain} is one of steady states: give --steady")
    else:
        # A scene without a drive is refused: a row of zeros has no 3D solution.
        dropped = f"rows at {curve.plain} = 0 are left out" if (curve.values == 0).any() else ""
        rows = fits & (curve.values != 0)
        curve = curve.at(rows)
        run.keep(rows)
        run.curve = curve.role, curve.values
        said = f"the curve over {curve.plain} ({curve.role}) at {_listed(curve, target)}"
        run.words = "; ".join(filter(None, (run.words, dropped, said)))
    return run


def _listed(parameter: Column, target: Target) -> str:
    """The distinct values of a parameter in words."""
    values = [target.show(parameter.role, value) for value in dict.fromkeys(parameter.values.tolist())]
    return ", ".join(values[:12]) + (f" and {len(values) - 12} more" if len(values) > 12 else "")


def _take_parameters(run: Run, target: Target) -> list[Column]:
    """Take the parameters of the runs from the others, in SI units with their keys as roles; drop useless columns."""
    most = _count_runs(run.time)
    parameters, others = [], []
    for column in run.columns:
        if np.isnan(column.values).all() or column.role == IGNORED:
            run.left_out[column.name] = "is left out by --column" if column.role else "has no numbers"
            continue
        key = column.role or target.find_key(column.plain)
        dimension = target.keys.get(key)
        if dimension is not None and column.powers not in (None, dimension.powers):
            if column.role:
                raise SceneError(f"--column: {quoted(column.name)} is not {dimension.name}, as {key} is")
            dimension = None
        if dimension is None:
            others.append(column)
        elif column.kind == "curve" or len(np.unique(column.values)) <= most:
            parameters.append(replace(column, role=key, values=column.si))
        elif column.role:
            raise SceneError(f"{quoted(column.name)} varies over time, as no {key} of a run does")
        elif target.find_quantity(column)[0]:
            others.append(column)  # A "current" that varies over time is the quantity, not the drive of the same name.
        else:
            run.left_out[column.name] = "varies over time"
    run.columns = others
    return parameters


def _choose(parameters: Sequence[Column], target: Target, count: int) -> tuple[np.ndarray, str]:
    """(count,): whether a row is of the scene's run, and in words "the run at V0 = 1 V of 0.5, 1, 2 V"."""
    if not parameters:
        return np.ones(count, dtype=bool), ""
    wanted = [(p, target.values.get(p.role, np.nan)) for p in parameters]
    fits: np.ndarray = np.all([np.isclose(p.values, value, rtol=_CLOSE, atol=1e-15) for p, value in wanted], axis=0)
    first, steady = parameters[0], target.quantities.steady
    curve = f'the whole curve: --column "{first.role} curve={first.plain}"'
    if not fits.any():
        runs = (
            f"{p.plain} ({p.role}) is {_listed(p, target)}, in the scene {target.show(p.role, v)}" for p, v in wanted
        )
        value = target.show(first.role, float(first.values[0])).replace(" ", "")
        raise SceneError(
            f"it has no run of this scene: {'; '.join(runs)}: export that run, or set the scene: "
            f"--set {first.role}={value}{f', or compare {curve}' if steady else ''} "
            f'(--column "ignore={first.plain}" where it is no such parameter)'
        )
    runs = (
        f"{p.plain} = {target.show(p.role, v)} ({p.role})"
        + f" of {_listed(p, target)}" * (len(np.unique(p.values)) > 1)
        for p, v in wanted
    )
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


def _keep_one_run(run: Run, fits: np.ndarray, target: Target) -> None:
    """Keep the rows of one run at ascending times, or the last one for the steady state.

    Raises SceneError for rows of several runs or states.
    """
    steady = target.quantities.steady
    run.keep(fits)
    time, count = run.time, int(fits.sum())
    if steady and (count == 1 or (run.clock and _is_one_run(time))):
        note = f"the last of {count} rows is taken for the steady state" if run.clock else ""
        return run.keep(np.arange(count) == count - 1, note)
    if not steady and _is_one_run(time):
        last = np.append(np.diff(time) > 0, True)
        repeated = int((~last).sum())
        return run.keep(last, f"{repeated} of them twice, the second row is taken" if repeated else "")
    problem, runs = f"it has {count} rows where the scene has one steady state", count
    if not steady:
        row = int(np.flatnonzero(np.diff(time) <= 0)[0])
        problem = (
            f"it has the time {time[row + 1]:.9g} s after {time[row]:.9g} s: times that repeat or step back are of "
            "several runs, or rounded"
        )
        runs = _count_runs(time)
    problem = f"{run.words}, {problem}" if run.words else problem
    telling = [c for c in run.columns if 1 < len(np.unique(c.values)) <= runs]
    if not telling:
        raise SceneError(f"{problem}: export one {'state' if steady else 'run, with more digits'}")
    name, values = telling[0].name, ", ".join(f"{v:g}" for v in list(dict.fromkeys(telling[0].values.tolist()))[:12])
    raise SceneError(
        f"{problem}: {quoted(name)} ({values}) may tell them apart: say which key of the scene it is, --column "
        f"KEY={quoted(name)}"
    )
