"""Match the columns of a file to quantities and keys of the scene, and pick one run of the file.

Columns are matched by `--column`, or by their names and units. A sweep has its runs below one another with a column for
each parameter; parameters that stand for keys of the scene decide on the run.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from compare.data.columns import Column, find_times, refusing, split_unit
from compare.data.target import RISE_WORDS, Target
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.units import CURRENT, TEMPERATURE, TIME, VOLTAGE, Unit, called, parse_unit

IGNORED = "ignore"
"""The role of a column that is left out."""
_DIFFERENCE = re.compile(r"\bT\)?\s*-\s*[\dT]")


def assign(columns: Sequence[Column], target: Target, given: Sequence[str]) -> list[Column]:
    """Return the columns with the roles, and the units, that `--column NAME=COLUMN` gives them. Raises SceneError."""
    assigned = list(columns)
    for text in given:
        with refusing(f"--column {quoted(text)}"):
            word, _, wanted = (part.strip() for part in text.partition("="))
            if not word or not wanted:
                raise SceneError('give NAME=COLUMN, such as peak="T (K), Point 1"')
            role, unit, kind = _read_role(target, word)
            name = _find_column(assigned, wanted)
            if taken := next((c.role for c in assigned if c.name == name and c.role), ""):
                raise SceneError(f"{quoted(name)} is the {taken} already")
            if role != IGNORED and any(c.role == role for c in assigned):
                raise SceneError(f"another column is the {role} already")
            # Vectors of ngspice may share one name, the time, which stands before each.
            assigned = [
                replace(c, role=role, kind=kind, unit=unit or c.unit) if c.name == name else c for c in assigned
            ]
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


def _find_column(columns: Sequence[Column], wanted: str) -> str:
    """The name of a column: as the header has it, without its unit where that is enough, or by number."""
    names = list(dict.fromkeys(c.name for c in columns))
    plain = " ".join(wanted.split())
    loose = {c.name for c in columns if plain.lower() in (c.name.lower(), c.plain.lower())}
    if plain in names or len(loose) == 1:
        return plain if plain in names else loose.pop()
    if wanted.isdigit() and 0 < int(wanted) <= len(columns):
        return columns[int(wanted) - 1].name
    shown = ", ".join(map(quoted, names[:12]))
    raise SceneError(f"no column is called so: there are {shown}{did_you_mean(plain, names)}")


def match(column: Column, target: Target) -> tuple[str, np.ndarray, str]:
    """Return the quantity of a column, its values and a note on them; "" and the reason where there is none.

    The values are in SI units, temperatures absolute, NaN in rows to leave out. Raises SceneError where --column gives
    another unit.
    """
    if not column.role and "reduced1d" in column.name.lower():
        return "", column.values, "is of a 1D model"
    if np.isnan(column.values).all():
        return "", column.values, "has no number in this run"
    key, note = (column.role, "") if column.role else target.find_quantity(column)
    if not key:
        return "", column.values, note
    symbol = target.quantities.units[key]
    wanted, notes, bare = parse_unit(symbol), [note], column.unit is None
    if bare or (column.spice and column.powers == VOLTAGE.powers != wanted.powers):
        # A circuit has volts for all that is no current.
        taken = "it has no unit and is taken in" if bare else "volts taken for"
        notes.append(f"{taken} {'kelvins' if symbol == 'K' and not bare else symbol}")
        column = replace(column, unit=wanted)
    if column.powers != wanted.powers:
        why = f"is {called(column.powers or ())}, not {called(wanted.powers)}"
        if column.role:
            raise SceneError(f"--column: {quoted(column.name)} can't be the {target.quantities.word(key)}: it {why}")
        return "", column.values, why
    values = column.si
    if wanted.powers == TEMPERATURE.powers:
        values, how = _make_absolute(target, key, column)
        notes.append(how)
        first = next(v for v in column.values if v == v)
        if bare and how.startswith("a rise, for") and abs(first) > 0.005 * np.nanmax(np.abs(column.values - first)):
            initial = target.quantities.initial
            return "", values, f"has no unit, and starts at {first:.4g}: neither at 0 nor at {initial:g} K"
    elif wanted.powers == CURRENT.powers and float(np.nanmedian(values)) * target.sign(key) < 0:
        # SPICE counts the current of a source as negative where the source delivers.
        values = -values
        notes.append("sign turned to that of the voltage")
    return key, values, ", ".join(filter(None, notes))


def _make_absolute(target: Target, key: str, column: Column) -> tuple[np.ndarray, str]:
    """Absolute temperatures (K) of a column, and a note.

    Without a word for a rise, the whole column decides: its numbers other than zero are absolute where they start at
    the initial temperature of the scene, or where all are above half of it. Zeros of such a column are placeholders,
    and so are numbers below 0 K however they are read, such as -999.
    """
    initial = target.quantities.initial
    words = set(re.findall(r"[a-z]+", column.name.lower()))
    named = bool(words & RISE_WORDS or _DIFFERENCE.search(column.name)) and target.quantities.word(key) != column.name
    if named or column.kind == "rise":
        return column.differences + initial, "a rise"
    values, zero = np.where(column.differences < -initial, np.nan, column.si), column.values == 0
    kept = values[~np.isnan(values) & ~zero]
    off = float(abs(kept[0] - initial)) if kept.size else np.inf
    if not kept.size or not (off <= 0.05 * initial or (kept > initial / 2).all()):
        return values + initial, f"a rise, for it starts at {values[~np.isnan(values)][0]:.4g} K"
    if column.unit is not None and column.unit.celsius:
        # 0 degC is a temperature, but at the top of a column that goes on at the initial temperature.
        zero &= (np.cumsum(~zero) == 0) & bool(off <= 0.05 * np.ptp(kept))
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
    curve : the key of the scene and its values (rows,), at which the rows are steady states, or ``None``
    """

    clock: str
    time: np.ndarray
    columns: list[Column]
    notes: list[str] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    words: str = ""
    curve: tuple[str, np.ndarray] | None = None

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
        raise SceneError(f"{quoted(run.clock)}, the time, is empty")
    run.keep(filled, "" if filled.all() else f"{(~filled).sum()} rows without one are left out")
    parameters = _take_parameters(run, target)
    curve = next((p for p in parameters if p.kind == "curve"), None)
    fits = _choose(run, [p for p in parameters if p is not curve], target)
    if curve is None:
        run.keep(fits)
        _keep_one_run(run, steady)
    elif not steady:
        raise SceneError(f"a curve over {curve.plain} is one of steady states: give --steady")
    else:
        # A scene without a drive is refused: a row of zeros has no 3D solution.
        rows = fits & (curve.values != 0)
        run.keep(rows)
        run.curve = curve.role, curve.values[rows]
        dropped = f"rows at {curve.plain} = 0 are left out" if (curve.values == 0).any() else ""
        said = f"the curve over {curve.plain} ({curve.role}) at {_listed(curve.at(rows), target)}"
        run.words = "; ".join(filter(None, (run.words, dropped, said)))
    return run


def _find_time(columns: Sequence[Column], steady: bool) -> Run:
    """The run of all rows, with the column of times and the other columns."""
    times = [c for c in columns if c.role == "time"] or find_times([c for c in columns if not c.role])
    if not times and steady:
        return Run("", np.zeros(len(columns[0].values)), list(columns))
    same = [c for c in times if c.unit == times[0].unit and np.array_equal(c.values, times[0].values, equal_nan=True)]
    if not times or len(same) != len(times):
        names = ", ".join(quoted(c.name) for c in (times or columns)[:8])
        problem = "several columns are the time" if times else "no column is the time with its unit"
        raise SceneError(f'{problem}, such as "Time (s)" (or --column "time (s)=NAME"): there are {names}')
    clock, bare = times[0], times[0].unit is None and not times[0].role
    if not bare and clock.powers != TIME.powers:
        raise SceneError(f'--column: {quoted(clock.name)} has no unit of time: say it, --column "time (s)=NAME"')
    others = [c for c in columns if c.name not in {c.name for c in times}]
    return Run(clock.name, clock.si, others, ["it has no unit and is taken in s"] * bare)


def _take_parameters(run: Run, target: Target) -> list[Column]:
    """Take the parameters of the runs from the others, in SI units with their keys as roles; drop useless columns."""
    most = 1 if _is_one_run(run.time) else _most_runs(run.time)
    parameters, others = [], []
    for column in run.columns:
        key = target.find_key(column.plain) if not column.role else column.role * (column.role in target.numbers)
        dimension = target.numbers[key].kind.dimension if key else None
        fits = dimension is not None and column.powers in (None, dimension.powers)
        varies = column.kind != "curve" and len(np.unique(column.values)) > most
        if np.isnan(column.values).all() or column.role == IGNORED:
            run.left_out[column.name] = "is left out by --column" if column.role else "has no numbers"
        elif fits and not varies:
            parameters.append(replace(column, role=key, values=column.si))
        elif dimension and column.role:
            why = f"varies over time, as no {key} of a run does" if fits else f"is not {dimension.name}, as {key} is"
            raise SceneError(f"--column: {quoted(column.name)} {why}")
        elif fits and not target.find_quantity(column)[0]:
            run.left_out[column.name] = "varies over time"
        else:
            others.append(column)  # A "current" that varies over time is the quantity, not the drive of the same name.
    run.columns = others
    return parameters


def _listed(parameter: Column, target: Target) -> str:
    """The distinct values of a parameter in words."""
    values = [target.show(parameter.role, value) for value in dict.fromkeys(parameter.values.tolist())]
    return ", ".join(values[:12]) + (f" and {len(values) - 12} more" if len(values) > 12 else "")


def _choose(run: Run, parameters: Sequence[Column], target: Target) -> np.ndarray:
    """(rows,): whether a row is of the scene's run, where all parameters are the scene's to the digits of a table."""
    fits, steady = np.ones(len(run.time), dtype=bool), target.quantities.steady
    for p in parameters:
        fits &= np.isclose(p.values, target.numbers[p.role].value, rtol=1e-4, atol=1e-15)
    if not parameters:
        return fits
    shown = {p.role: target.show(p.role, target.numbers[p.role].value) for p in parameters}
    first = parameters[0]
    curve = f'the whole curve: --column "{first.role} curve={first.plain}"'
    if not fits.any():
        runs = (f"{p.plain} ({p.role}) is {_listed(p, target)}, in the scene {shown[p.role]}" for p in parameters)
        value = target.show(first.role, float(first.values[0])).replace(" ", "")
        raise SceneError(
            f"it has no run of this scene: {'; '.join(runs)}: export that run, or set the scene: "
            f"--set {first.role}={value}{f', or compare {curve}' if steady else ''} "
            f'(--column "ignore={first.plain}" where it is no such parameter)'
        )
    runs = (
        f"{p.plain} = {shown[p.role]} ({p.role})" + f" of {_listed(p, target)}" * (len(np.unique(p.values)) > 1)
        for p in parameters
    )
    run.words = f"the run at {', '.join(runs)}{f' ({curve})' if steady and not fits.all() else ''}"
    return fits


def _is_one_run(time: np.ndarray) -> bool:
    """Whether times ascend, but for events: a solver stores a time twice there, before and after."""
    steps = np.diff(time)
    return bool((steps >= 0).all() and not ((steps[1:] == 0) & (steps[:-1] == 0)).any()
                and 2 * (steps == 0).sum() <= (steps > 0).sum())  # fmt: skip


def _most_runs(time: np.ndarray) -> int:
    """The largest number of runs that rows below one another, or runs whose rows take turns, can be of."""
    return 1 + int((np.diff(time) <= 0).sum())


def _keep_one_run(run: Run, steady: bool) -> None:
    """Keep the rows of one run at ascending times, or the last one for the steady state.

    Raises SceneError for rows of several runs or states.
    """
    time, count, is_one = run.time, len(run.time), _is_one_run(run.time)
    if steady and (count == 1 or (run.clock and is_one)):
        note = f"the last of {count} rows is taken for the steady state" if run.clock else ""
        return run.keep(np.arange(count) == count - 1, note)
    if not steady and is_one:
        last = np.append(np.diff(time) > 0, True)
        return run.keep(last, "" if last.all() else f"{(~last).sum()} of them twice, the second row is taken")
    problem = f"it has {count} rows where the scene has one steady state"
    if not steady:
        row = int(np.flatnonzero(np.diff(time) <= 0)[0])
        problem = (
            f"it has the time {time[row + 1]:.9g} s after {time[row]:.9g} s: times that repeat or step back are of "
            "several runs, or rounded"
        )
    problem = f"{run.words}, {problem}" if run.words else problem
    telling = next((c for c in run.columns if 1 < len(np.unique(c.values)) <= _most_runs(time)), None)
    if telling is None:
        raise SceneError(f"{problem}: export one {'state' if steady else 'run, with more digits'}")
    name, values = quoted(telling.name), ", ".join(f"{v:g}" for v in list(dict.fromkeys(telling.values.tolist()))[:12])
    raise SceneError(
        f"{problem}: {name} ({values}) may tell them apart: say which key of the scene it is, --column KEY={name}"
    )
