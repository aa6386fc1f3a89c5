"""Read a user's own data from a file of another program: columns, the run of the scene, quantities, uncertainties."""

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from compare.against import Data
from compare.data import raw, text
from compare.data.columns import Column, refusing
from compare.data.match import IGNORED, Target, assign, count_runs, pick
from compare.quantities import AT_REST, EDGE, Quantities
from compare.verdict import COVERS
from scenes.errors import SceneError, printable, quoted
from scenes.formats import quantity
from scenes.units import UnitError, parse_quantity, parse_unit


def read(path: Path, scene: Any, columns: Sequence[str] = (), uncertainty: Sequence[str] = ()) -> Data:
    """Read data of a sink, or of a scene with probes, from a table of text or a raw file.

    ``columns`` and ``uncertainty`` are as `--column` and `--data-uncertainty` have them. Raises SceneError where no
    column is a quantity of the scene, or no run is the scene's.
    """
    target, named, content = Target(scene), f"--against {quoted(path)}", text.read_bytes(path)
    with refusing(named):
        data = _read(path.name, content, target, columns)
    if data.curve and uncertainty:
        raise SceneError("--data-uncertainty is of traces or of one steady state: leave it out with a curve")
    data = replace(data, u=read_uncertainty(target.quantities, data, uncertainty))
    with refusing(named):
        return data if data.at_rest else replace(data, warnings=_compare_run(data, target))


def _read(name: str, content: bytes, target: Target, given: Sequence[str]) -> Data:
    """The data of a file, without uncertainties."""
    catalogue = target.quantities
    if not catalogue.units:
        raise SceneError("the scene has no [[probe]] that data could be of: add one")
    plots = "operating point|dc transfer|" * catalogue.steady + "transient"
    kind, columns = raw.read(content, plots) if raw.is_raw(content) else text.read(content)
    if kind == text.LIST and not catalogue.steady:
        cure = "give traces" if target.scene.kind == "sink" else "give traces, or --steady"
        raise SceneError(f"a list of steady values, and the scene is compared over time: {cure}")
    every = assign(columns, target, given)
    columns, left_out = _sort(every, target)
    clock = _find_time(columns, every, catalogue.steady)
    time = np.zeros(len(every[0].values)) if clock is None else clock.si
    traces, keys = ([c for c in columns if c.role in roles] for roles in (catalogue.units, target.numbers))
    runs = count_runs(time[np.isfinite(time)])
    for column in [c for c in keys if not c.is_curve and len(np.unique(c.values)) > runs]:
        _leave_out(column, f"varies over time, as no {column.role} of a run does", left_out)
        keys = [c for c in keys if c is not column]
    rows, words, notes, scenes = pick(time, traces, keys, target)
    values: dict[str, np.ndarray] = {}
    headers = {"time_s": clock.name} if clock else {}
    how = {"time_s": ", ".join(filter(None, [clock.note if clock else "", *notes]))}
    for column in traces:
        key, word = column.role, catalogue.word(column.role)
        if np.isnan(column.values[rows]).all():
            _leave_out(column, "has no number in this run", left_out)
        elif key in values:
            raise SceneError(
                f"both {quoted(headers[key])} and {quoted(column.name)} may be the scene's {word}: say which, by name "
                f'or number, --column {word}="{printable(column.name)}"'
            )
        else:
            values[key], how[key] = _read_values(replace(column, values=column.values[rows]), target, scenes)
            headers[key] = column.name
    if not values:
        reasons = "".join(f"; {quoted(n)} {why}" for n, why in [*left_out.items()][:8])
        known = ", ".join(f"{word} ({catalogue.units[name]})" for word, name in [*catalogue.names.items()][:8])
        raise SceneError(
            f"none of its columns is a quantity of the scene, {known}{reasons}: call them so, or say which they are, "
            f'--column "{known.partition(", ")[0]}=NAME"'
        )
    names = ", ".join(quoted(headers[key]) for key, each in values.items() if np.isnan(each).any())
    full = np.all([np.isfinite(each) for each in values.values()], axis=0)
    if not full.any():
        raise SceneError(f"every row is empty in one of {names}: leave one of them out, --column ignore=COLUMN")
    notes = [f"{(~full).sum()} of {len(full)} rows are left out, for {names} has no number there"] * bool(names)
    values = {key: each[full] for key, each in values.items()}
    time = np.repeat(AT_REST, full.sum()) if catalogue.steady else time[rows][full]
    # Other columns may be uncertainties: of temperatures they are differences.
    others = {c.name: replace(c, values=c.values[rows][full]) for c in every if c.name not in headers.values()}
    report = {
        "file": name, "kind": kind, "rows": len(time), "from_s": float(time[0]), "to_s": float(time[-1]),
        "run": words or None, "columns": headers, "read_as": {key: note for key, note in how.items() if note},
        "left_out": left_out, "notes": notes,
    }  # fmt: skip
    said = _describe(report, catalogue, bool(scenes))
    return Data(name, time, values, report, said, others=others, curve=list(compress(scenes, full)))


def _describe(report: dict[str, Any], catalogue: Quantities, is_curve: bool) -> str:
    """One sentence: which column is which quantity, of which run, and which are left out, and why."""
    parts = []
    for key, header in report["columns"].items():
        word = "time" if key == "time_s" else catalogue.word(key)
        note = report["read_as"].get(key, "")
        parts.append(word + f" is {quoted(header)}" * (key != header) + f" ({note})" * bool(note))
    omitted = [f"{quoted(name)}, it {why}" for name, why in report["left_out"].items()]
    omitted[6:] = [f"{len(omitted) - 6} more"] * (len(omitted) > 6)
    parts = [", ".join(parts), report["run"], *report["notes"], omitted and f"left out: {'; '.join(omitted)}"]
    covered = f"{report['rows']} steady states" if is_curve else "the steady state"
    if not catalogue.steady:
        first, last = (quantity(report[end], "s", 3) for end in ("from_s", "to_s"))
        covered = f"{report['rows']} rows, {first} to {last}"
    return f"{report['file']} ({report['kind']}, {covered}): {'; '.join(filter(None, parts))}."


def _sort(columns: Sequence[Column], target: Target) -> tuple[list[Column], dict[str, str]]:
    """The columns that have a role, in a unit of it, and the reasons of the others."""
    named, kept, left_out = {c.role for c in columns if c.called}, list[Column](), dict[str, str]()
    for column in columns:
        if column.role == IGNORED:
            why = "is left out by --column"
        elif np.isnan(column.values).all():
            why = 'has no numbers (give 90, not 00:01:30 or 1+2i, and 1234.5, not "1,234.5")'
        elif not column.role:
            bare = replace(column, name=re.sub(r" *[(\[{].*", "", column.name))
            is_known = column.unit is None and target.find_role(bare)
            why = "has an unknown unit" if is_known else "is called as no quantity of the scene"
        elif column.role in named and not column.called:
            why = "is not the one that --column names"
        else:
            column, why = target.convert(column)
        if why:
            _leave_out(column, why, left_out)
        else:
            kept.append(column)
    return kept, left_out


def _leave_out(column: Column, why: str, left_out: dict[str, str]) -> None:
    """Note why a column is left out; raises SceneError for one that `--column` names."""
    if column.called and column.role != IGNORED:
        raise SceneError(f"--column: {quoted(column.name)} can't be {quoted(column.called)}: it {why}")
    left_out[column.name] = why


def _find_time(columns: Sequence[Column], every: Sequence[Column], steady: bool) -> Column | None:
    """The column of times; ngspice may write the same times before every vector."""
    times = [c for c in columns if c.role == "time"]
    if steady and not times:
        return None
    if not times or not all(np.array_equal(c.si, times[0].si, equal_nan=True) for c in times):
        names = ", ".join(quoted(c.name) for c in (times or every)[:8])
        such = 'no column is the time in numbers, such as "Time (s)" with 90 or 1234.5, not 00:01:30 or "1,234.5"'
        problem = "several columns are the time" if times else such
        raise SceneError(f'{problem} (give --column "time (s)=NAME"): there are {names}')
    return times[0]


def _read_values(column: Column, target: Target, curve: Sequence[tuple[str, Any]]) -> tuple[np.ndarray, str]:
    """The values of a quantity in SI units, temperatures absolute, NaN in rows to leave out, and a note on them."""
    values, notes, unit = column.si, [column.note], target.quantities.units[column.role]
    if unit == "K":
        values, note = _make_absolute(target, column)
        notes.append(note)
    elif unit == "A":
        # SPICE counts the current of a source as negative where the source delivers.
        signs = [Target(scene).sign(column.role) for _, scene in curve] or [target.sign(column.role)]
        if np.nansum(values * np.abs(values) * signs) < 0:
            values = -values
            notes.append("sign turned to that of the voltage")
    return values, ", ".join(filter(None, notes))


def _make_absolute(target: Target, column: Column) -> tuple[np.ndarray, str]:
    """Absolute temperatures (K) of a column, and a note.

    Unless the column is called a rise, its numbers other than zero are absolute where all are above half of the
    initial temperature of the scene. Zeros among absolute kelvins are placeholders, and so are numbers below 0 K
    however they are read, such as -999.
    """
    initial = target.quantities.initial
    names = f"{column.called} {column.name}", target.quantities.word(column.role)
    of_column, of_quantity = (set(re.split(r"[\W_]+", name.lower())) for name in names)
    if "rise" in of_column - of_quantity:
        return column.differences + initial, "a rise"
    values, zero = np.where(column.differences < -initial, np.nan, column.si), column.values == 0
    known = values[~np.isnan(values) & ~zero]
    starts = known.size and abs(known[0] - initial) <= 0.05 * initial
    offset = 0.0 if column.unit is None else float(column.unit.offset)
    if not known.size or not (starts or offset or (known > initial / 2).all()):
        first = next((float(each) for each in values if not np.isnan(each)), np.nan)
        return values + initial, f"a rise, for it starts at {first:.4g} K; give degC for degrees"
    if offset:  # Zeros in degrees are placeholders above a row that starts at the initial temperature.
        zero &= (np.cumsum(~zero) == 0) & (abs(known[:1].sum() - initial) <= 0.05 * abs(offset - initial))
    return np.where(zero, np.nan, values), f"{zero.sum()} placeholder rows of zeros" * bool(zero.any())


def _compare_run(data: Data, target: Target) -> tuple[str, ...]:
    """Warnings of traces whose times, or whose temperatures at the start, are not the run's. Raises SceneError."""
    catalogue, warnings, last = target.quantities, [], float(data.time[-1])
    end = quantity(catalogue.end, "s", 3)
    inside = int((data.time <= catalogue.end * (1 + 1e-9)).sum())
    if inside < 3:
        covered = f"{quantity(float(data.time[0]), 's', 3)} to {quantity(last, 's', 3)}"
        raise SceneError(
            f"{inside} of its times, {covered}, are within the run up to {end}, and three are the least: give a longer "
            'run, --set end_time=T, or the unit of the times, --column "time (ms)=NAME"'
        )
    if not 0.5 * catalogue.end <= last <= 10 * catalogue.end:
        warnings.append(f"it ends at {quantity(last, 's', 3)}, the run at {end}: only what both cover is compared")
    if data.time[0] > max(catalogue.first / 10, EDGE * catalogue.end):
        return tuple(warnings)
    for key, values in data.values.items():
        off, change = float(values[0]) - catalogue.initial, float(np.abs(values - values[0]).max())
        surely = abs(off) - (COVERS * float(data.u[key][0]) if key in data.u else 0.0)
        if catalogue.units[key] != "K" or surely <= 0.005 * change:
            continue
        word, header = catalogue.word(key), data.report["columns"][key]
        said = f"{quoted(header)} starts {abs(off):.4g} K {'above' if off > 0 else 'below'} {target.initial}, "
        said += f"{catalogue.initial:g} K: give --set {target.initial}={catalogue.initial + off:.6g}"
        if surely > 0.05 * change:  # the tolerance of the checks
            raise SceneError(
                f'{said}, or of a rise --column "{word} rise={printable(header)}", of degrees "{word} (degC)=...", or '
                "of noise --data-uncertainty U"
            )
        warnings.append(f"{said}, or the difference has it")
    return tuple(warnings)


def read_uncertainty(catalogue: Quantities, data: Data, given: Sequence[str]) -> dict[str, np.ndarray]:
    """Read `--data-uncertainty` as standard uncertainties (times,) by quantity, in SI units.

    A number with a unit is of all quantities in that unit, a percentage is of the rise or value, a name is a column of
    the file; "peak=0.5K" is of one quantity. Raises SceneError.
    """
    uncertainties: dict[str, np.ndarray] = {}
    words = {catalogue.word(key): key for key in data.values}
    example = next(iter(words))
    form = f'give 0.5K, 1%, {example}=1%, or {example}="a column of the file"'
    for entry in given:
        word, equals, size = (part.strip() for part in entry.rpartition("="))
        keys = [key for name, key in words.items() if name == word or not equals]
        each = {key: u for key in keys if (u := _read_size(catalogue, data, key, size)) is not None}
        with refusing(f"--data-uncertainty {quoted(entry)}"):
            if not each:
                raise SceneError(f"it is none, with its unit, of {', '.join(words)} in {data.name}: {form}")
            if any((u <= 0).any() or not np.isfinite(u).all() for u in each.values()):
                raise SceneError(f"an uncertainty must be more than nothing: {form}")
        uncertainties |= each
    return uncertainties


def _read_size(catalogue: Quantities, data: Data, key: str, size: str) -> np.ndarray | None:
    """(times,): the uncertainty of one quantity; ``None`` for a size of another kind."""
    if (column := data.others.get(size)) is not None:
        return column.differences if column.powers == parse_unit(catalogue.units[key]).powers else None
    try:
        number, unit = parse_quantity(size)
    except UnitError:
        return None
    if size.endswith("%"):
        # A rise is zero at the start, where half of the last digit of a double would do as well.
        return np.maximum(number * np.abs(data.values[key] - catalogue.base(key)), np.sign(number) * 1e-12)
    if unit is None or unit.powers != parse_unit(catalogue.units[key]).powers:
        return None
    return np.full(len(data.time), number - float(unit.offset))
