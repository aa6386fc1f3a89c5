"""Read a user's own data from a file of another program: columns, the run of the scene, quantities, uncertainties."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.against import Data
from compare.data import raw, text
from compare.data.columns import ICE_POINT, Column, refusing
from compare.data.match import Match, assign, match_column, pick, refusal
from compare.data.target import Target, make_target
from compare.quantities import AT_REST, EDGE, Quantities
from compare.verdict import COVERS
from scenes.errors import SceneError, did_you_mean, printable, quoted
from scenes.formats import quantity
from scenes.units import UnitError, parse_quantity, parse_unit

_NOTICED, _REFUSED = 0.005, 0.05
"""Distances of a trace's start from the initial temperature, over its change, that are warned of and refused: the
tolerance of the checks is 5 %."""


def read(path: Path, scene: Any, columns: Sequence[str] = (), uncertainty: Sequence[str] = ()) -> Data:
    """Read data of a scene from a file.

    Parameters
    ----------
    path : Path
        A COMSOL table or data export, a table of text, or a raw file of ngspice or LTspice.
    scene : Scene
        A sink or a scene with probes.
    columns : sequence of str
        The meanings of columns, "peak=T (K), Point 1", as `--column` gives them.
    uncertainty : sequence of str
        Standard uncertainties as `--data-uncertainty` gives them.

    Raises
    ------
    SceneError
        Where no column is a quantity of the scene, or no run is the scene's.
    """
    target, named, content = make_target(scene), f"--against {quoted(path)}", text.read_bytes(path)
    with refusing(named):
        data = _read(path.name, content, target, columns)
    if data.curve is not None and uncertainty:
        raise SceneError("--data-uncertainty is of traces or of one steady state: leave it out with a curve")
    data = replace(data, u=read_uncertainty(target.quantities, data, uncertainty))
    with refusing(named):
        return data if data.at_rest else replace(data, warnings=_compare_run(data, target))


def _read(name: str, content: bytes, target: Target, given: Sequence[str]) -> Data:
    """The data of a file, without uncertainties."""
    catalogue = target.quantities
    if not catalogue.units:
        raise SceneError("the scene has no [[probe]] that data could be of: add one")
    kind, columns = _read_columns(content, catalogue.steady)
    columns = assign(target, columns, given)
    roles = {column.role for column in columns}
    run = pick(columns, target)
    matches: dict[str, Match] = {}
    for column in run.columns:
        match = match_column(column, target)
        if isinstance(match, str):
            run.left_out[column.name] = match + _describe_constant(column)
        elif not column.role and match.key in roles:
            run.left_out[column.name] = "is not the one that --column names"
        elif match.key in matches:
            word = catalogue.word(match.key)
            raise SceneError(
                f"both {quoted(matches[match.key].header)} and {quoted(column.name)} may be the scene's {word}: say "
                f'which, --column {word}="{printable(column.name)}"'
            )
        else:
            matches[match.key] = match
    if not matches:
        raise SceneError(refusal(columns, run.left_out, target))
    rows, notes = _full_rows(matches)
    values = {key: match.values[rows] for key, match in matches.items()}
    for key, each in values.items():
        if not np.isfinite(each).all():
            raise SceneError(f"{quoted(matches[key].header)} has values that are not finite numbers")
    headers = {key: match.header for key, match in matches.items()}
    how = {"time_s": run.how} | {key: match.note for key, match in matches.items()}
    time = run.time[rows]
    if catalogue.steady:
        time = np.repeat(AT_REST, len(time))
    else:
        _check_times(time, catalogue.end)
    # Other columns in SI units may be uncertainties: of temperatures they are differences.
    known = [column for column in run.columns if column.name not in headers.values() and column.powers is not None]
    return Data(
        name, kind, time, values, {"time_s": run.clock} | headers if run.clock else headers,
        {key: note for key, note in how.items() if note}, notes, run.left_out, run.words,
        others={column.name: column.differences[rows] for column in known}, words=catalogue.words,
        curve=run.curve and (run.curve[0], run.curve[1][rows]),
    )  # fmt: skip


def _read_columns(content: bytes, steady: bool) -> tuple[str, list[Column]]:
    """The kind and the columns of a file; columns of one name are numbered, but the times before every vector."""
    if raw.is_raw(content):
        kind, read = raw.read(content)
    elif not (pairs := text.read_pairs(content)):
        kind, read = text.read(content)
    elif steady:
        kind, read = "list of values", pairs
    else:
        raise SceneError("a list of values of the steady state, and the scene is solved over time: give --steady")
    seen: Counter[str] = Counter()
    columns = []
    for column in read:
        seen[column.name] += 1
        again = seen[column.name] > 1 and column.name.lower() != "time" and not column.is_time
        columns.append(replace(column, name=f"{column.name} #{seen[column.name]}") if again else column)
    return kind, columns


def _describe_constant(column: Column) -> str:
    """The value of a column that may be a parameter, as it is the same throughout."""
    if np.ptp(column.values) != 0 or len(column.values) < 2:
        return ""
    value = f"{column.values[0]:g} {column.unit}".strip()
    return f" ({value} throughout; --column KEY={quoted(column.name)} holds it against the scene's)"


def _full_rows(matches: Mapping[str, Match]) -> tuple[np.ndarray, tuple[str, ...]]:
    """(rows,): the rows in which no column is empty, and a note on the others."""
    empty = {match.header: np.isnan(match.values) for match in matches.values()}
    gaps: np.ndarray = np.any(list(empty.values()), axis=0)
    names = [name for name, where in empty.items() if where.any()]
    if gaps.all():
        raise SceneError(
            f"every row is empty in one of {', '.join(map(quoted, names))}: leave one of them out, --column "
            f'"ignore={printable(names[0])}"'
        )
    note = f"{gaps.sum()} of {len(gaps)} rows are left out, for {', '.join(map(quoted, names))} has no number there"
    return ~gaps, (note,) if names else ()


def _check_times(time: np.ndarray, end: float) -> None:
    """Refuse fewer than three rows within the run, as a file in another unit of time has."""
    inside = int((time <= end * (1 + 1e-9)).sum())
    if inside < 3:
        covered = " to ".join(quantity(float(t), "s", 3) for t in (time[0], time[-1]))
        raise SceneError(
            f"it covers {covered} with {inside} {'time' if inside == 1 else 'times'} up to the run's "
            f"end, {quantity(end, 's')}: three are the least to compare curves by (times in another unit: "
            '--column "time (ms)=NAME"; a longer run: --set end_time=T)'
        )


def _compare_run(data: Data, target: Target) -> tuple[str, ...]:
    """Warnings of traces whose times, or whose temperatures at the start, are not the run's. Raises SceneError."""
    catalogue, warnings, last = target.quantities, [], float(data.time[-1])
    if not 0.5 * catalogue.end <= last <= 10 * catalogue.end:
        unit = "is its time in another unit? only what the run covers is compared"
        ends = f"it ends at {quantity(last, 's', 3)}, the run at {quantity(catalogue.end, 's', 3)}"
        warnings.append(f"{ends}: {'only that is compared' if last < catalogue.end else unit}")
    if data.time[0] > max(catalogue.first / 10, EDGE * catalogue.end):
        return tuple(warnings)
    for key, values in data.values.items():
        if catalogue.units[key] != "K":
            continue
        off, change = float(values[0]) - catalogue.initial, float(np.abs(values - values[0]).max())
        surely = abs(off) - (COVERS * float(data.u[key][0]) if key in data.u else 0.0)
        header, initial = data.headers[key], "room" if target.initial == "room_temperature" else "initial"
        where = f"starts {abs(off):.4g} K {'above' if off > 0 else 'below'} the scene's {initial} temperature"
        other = f"--set {target.initial}={catalogue.initial + off:.6g}"
        if surely > _REFUSED * change:
            noisy = "" if key in data.u else "; where it is noise, say how much of it there is, --data-uncertainty U"
            raise SceneError(
                f"{quoted(header)} {where}, {catalogue.initial:g} K: give {other}, "
                f'or where it is a rise --column "{catalogue.word(key)} rise={printable(header)}"{noisy}'
            )
        if surely > _NOTICED * change:
            warnings.append(f"{quoted(header)} {where}, which goes into the difference: {other} would meet it")
    return tuple(warnings)


def read_uncertainty(catalogue: Quantities, data: Data, given: Sequence[str]) -> dict[str, np.ndarray]:
    """Read `--data-uncertainty` as standard uncertainties (times,) by quantity, in SI units.

    A number with a unit is of all quantities in that unit, a percentage is of the rise or value, a name is a column of
    the file; "peak=0.5K" is of one quantity. Raises SceneError.
    """
    uncertainties: dict[str, np.ndarray] = {}
    names = catalogue.names
    example = next((word for word, name in names.items() if catalogue.units[name] == "K"), next(iter(names)))
    form = f'give 0.5K, 1%, {example}=1%, or {example}="a column of the file"'
    for entry in given:
        name, equals, value = entry.partition("=")
        if equals and name.strip() not in names:
            raise SceneError(
                f"--data-uncertainty {quoted(entry)}: {printable(name)} is no quantity: give {', '.join(names)}"
                f"{did_you_mean(name.strip(), names)}"
            )
        keys = [names[name.strip()]] if equals else list(data.values)
        size = (value if equals else entry).strip()
        each = {key: u for key in keys if (u := _read_size(catalogue, data, key, size)) is not None}
        if not each:
            raise SceneError(f"--data-uncertainty {quoted(entry)} is one of no quantity of {data.name}: {form}")
        if any((u <= 0).any() or not np.isfinite(u).all() for u in each.values()):
            raise SceneError(f"--data-uncertainty {quoted(entry)}: an uncertainty must be more than nothing: {form}")
        uncertainties |= each
    return uncertainties


def _read_size(catalogue: Quantities, data: Data, key: str, size: str) -> np.ndarray | None:
    """(times,): the uncertainty of one quantity; ``None`` for a size of another kind."""
    if key not in data.values:
        return None
    if size in data.others:
        return data.others[size]
    try:
        number, unit = parse_quantity(size)
    except UnitError:
        return None
    if size.endswith("%"):
        # A rise is zero at the start, where half of the last digit of a double would do as well.
        return np.maximum(number * np.abs(data.values[key] - catalogue.base(key)), np.sign(number) * 1e-12)
    if unit is None or unit.powers != parse_unit(catalogue.units[key]).powers:
        return None
    return np.full(len(data.time), number - ICE_POINT if unit.celsius else number)
