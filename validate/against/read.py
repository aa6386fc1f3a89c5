"""A user's own traces, ready to be compared: read from whichever file it is, sorted by what the columns mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from compare.against import Data
from compare.quantities import AT_REST, EDGE, Quantities
from compare.verdict import COVERS
from scenes.errors import SceneError, printable, quoted
from scenes.formats import quantity
from scenes.units import UnitError, parse_quantity
from scenes.units import unit_of as unit_text
from validate.against import quantities, raw, runs, tables
from validate.against.quantities import Subject
from validate.against.tables import Column, Table, in_si, is_time, unit_of
from validate.against.uncertainty import data_uncertainty

_LONGEST_LIST = 100_000
"""Bytes of a list of steady values at most; a scene has some hundred probes."""


def subject_of(scene: Any) -> Subject:
    """What columns are looked for, of each kind of scene."""
    return import_module(f"validate.against.{scene.kind}_columns").subject(scene)


def _at_the_start(catalogue: Quantities) -> float:
    """Up to when (s) a first row is the run's start."""
    return max(catalogue.first / 10, EDGE * catalogue.end)


def read(path: Path, scene: Any, columns: Sequence[str] = (), uncertainty: Sequence[str] = ()) -> Data:
    """The traces in a file; ``columns`` say what some of its columns are, as `--column` does, and ``uncertainty`` what
    they are known to, as `--data-uncertainty` does. SceneError where there are none that the scene has, saying what was
    found, and where it can't be told which of several is meant."""
    subject, shown = subject_of(scene), quoted(path)
    if not subject.quantities.units:
        raise SceneError(f"--against {shown}: the scene has no [[probe]] that data could be of: add one")
    steady = subject.quantities.steady
    table = _list(path) if steady else _table(path)
    given = runs.meanings(subject, table, columns)
    at_rest = runs.Picked(AT_REST, "", "", table.columns, {}, "") if steady else None
    picked = at_rest or runs.pick(table, given, subject, shown)
    kept: dict[str, quantities.Match] = {}
    omitted = dict(picked.left_out)
    empty = {c.name: c.empty if c.empty.size else np.zeros(len(picked.time), dtype=bool) for c in picked.columns}
    for column in picked.columns:
        meaning = given.get(column.name)
        filled = column.values[~empty[column.name]]
        if not filled.size:
            omitted[column.name] = "is empty"
            continue
        start = float(filled[0]) if picked.time[0] <= _at_the_start(subject.quantities) else None
        column_match = quantities.match(column, meaning, subject, table.spice, start)
        if isinstance(column_match, str):
            omitted[column.name] = column_match + ("" if table.spice else runs.constant(column))
        elif meaning is None and column_match.key in (other.what for other in given.values()):
            omitted[column.name] = "is not the one that --column names"
        elif column_match.key in kept and given.get(kept[column_match.key].header) is None:
            name = subject.quantities.word(column_match.key)
            raise SceneError(
                f"--against {shown}: both {quoted(kept[column_match.key].header)} and {quoted(column.name)} may be the "
                f'scene\'s {name}: say which, --column {name}="{printable(column.name)}"'
            )
        else:
            kept[column_match.key] = column_match
    if not kept:
        raise SceneError(f"--against {shown}: {quantities.refusal(table, omitted, subject)}")
    gaps, notes = _gaps({match.header: empty[match.header] for match in kept.values()}, shown)
    kept = {key: replace(match, values=match.values[~gaps]) for key, match in kept.items()}
    time = picked.time[~gaps]
    for match in kept.values():
        if not np.isfinite(match.values).all():
            raise SceneError(f"--against {shown}: {quoted(match.header)} has values that are not finite numbers")
    if not steady:
        _check_times(time, subject.quantities.end, shown)
    values = {key: m.values for key, m in kept.items()}
    headers = {**({} if steady else {"time_s": picked.clock}), **{key: m.header for key, m in kept.items()}}
    how = {key: note for key, note in (("time_s", picked.how), *((key, m.note) for key, m in kept.items())) if note}
    # Columns that are no quantities, in SI units; of temperatures differences.
    others = {
        c.name: in_si(c.values[~gaps], unit) - (273.15 if unit.celsius else 0.0)
        for c in picked.columns if c.name not in headers.values() and (unit := unit_of(c.unit)) is not None
    }  # fmt: skip
    data = Data(
        path.name, table.kind, time, values, headers, how, (*table.notes, *notes), omitted, picked.run, others=others,
        words=subject.quantities.words,
    )  # fmt: skip
    data = replace(data, u=data_uncertainty(scene, data, uncertainty))
    if steady:
        return data
    return replace(data, warnings=(*_spans(time, subject.quantities.end), *_starts(data, subject, shown)))


def _list(path: Path) -> Table:
    """Values of the steady state, as columns of one row each."""
    pairs = _pairs(path, tables.read_bytes(path))
    if not pairs:
        raise SceneError(
            f"--against {quoted(path)} is no list of values of the steady state, which is what is solved: give rows "
            '"probe, value", or for traces over time --end-time'
        )
    columns = []
    for name, text in pairs.items():
        try:
            value, unit = parse_quantity(text)
        except UnitError as error:
            raise SceneError(f"--against {path.name}: {printable(name)} = {quoted(text)} {error}") from None
        # The value is in SI units already.
        said = tables.split(name)[1] if unit is None else unit_text(unit.powers)
        columns.append(Column(name, said, np.array([value])))
    return Table("list of values", tuple(columns))


def _pairs(path: Path, data: bytes) -> dict[str, str]:
    """The rows "probe, value" of a file, if it is such a list, which is short."""
    return tables.pairs(path.name, data.decode("utf-8-sig", "replace")) if len(data) < _LONGEST_LIST else {}


def _is_quantity(text: str) -> bool:
    try:
        parse_quantity(text)
    except UnitError:
        return False
    return True


def _table(path: Path) -> Table:
    """The columns of a file; those called alike are numbered. The time may stand before every vector."""
    data = tables.read_bytes(path)
    if any(_is_quantity(text) for text in _pairs(path, data).values()):
        raise SceneError(
            f"--against {quoted(path)} is a list of values of the steady state, and the scene is solved over time: "
            "give traces, or --steady"
        )
    table = raw.read(path, data) if raw.is_one(data) else tables.read(path, data)
    seen: dict[object, int] = {}
    made = []
    for column in table.columns:
        n = seen[column.name, column.at] = seen.get((column.name, column.at), 0) + 1
        made.append(replace(column, name=f"{column.name} #{n}") if n > 1 and not is_time(column) else column)
    return replace(table, columns=tuple(made))


def _gaps(empty: Mapping[str, np.ndarray], shown: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """The rows in which some column is empty, and what to say of them; SceneError where that is every row."""
    gaps: np.ndarray = np.any(list(empty.values()), axis=0)
    names = [name for name, where in empty.items() if where.any()]
    if gaps.all():
        raise SceneError(
            f"--against {shown}: every row is empty in one of {', '.join(map(quoted, names))}: leave one of them out, "
            f'--column "ignore={printable(names[0])}"'
        )
    said = f"{gaps.sum()} of {len(gaps)} rows are left out, for {', '.join(map(quoted, names))} is empty there"
    return gaps, (said,) if names else ()


def _check_times(time: np.ndarray, end: float, shown: str) -> None:
    """Three rows within the run are the least; a file in another unit of time than it says has fewer."""
    inside = int((time <= end * (1 + 1e-9)).sum())
    if len(time) < 3 or inside < 3:
        covered = " to ".join(quantity(float(t), "s", 3) for t in (time[0], time[-1]))
        raise SceneError(
            f"--against {shown} covers {covered} with {inside} {'time' if inside == 1 else 'times'} up to the run's "
            f"end, {quantity(end, 's')}: three are the least to compare curves by (times in another unit: "
            '--column "time (ms)=NAME"; a longer run: --set end_time=T)'
        )


def _spans(time: np.ndarray, end: float) -> tuple[str, ...]:
    """What to say of traces that cover much more or less than the run."""
    last = float(time[-1])
    if 0.5 * end <= last <= 10 * end:
        return ()
    which = (
        "only that is compared" if last < end else "is its time in another unit? only what the run covers is compared"
    )
    return (f"it ends at {quantity(last, 's', 3)}, the run at {quantity(end, 's', 3)}: {which}",)


def _starts(data: Data, subject: Subject, shown: str) -> tuple[str, ...]:
    """What to say of traces that don't start at the scene's initial temperature, as far as the file has its start, by
    more than they are known to."""
    catalogue = subject.quantities
    if data.time[0] > _at_the_start(catalogue):
        return ()
    said, initial = [], "room" if subject.initial == "room_temperature" else "initial"
    for key, values in data.values.items():
        if catalogue.units[key] != "K":
            continue
        off, change = float(values[0]) - catalogue.initial, float(np.abs(values - values[0]).max())
        surely = abs(off) - COVERS * float(data.u[key][0]) if key in data.u else abs(off)
        if surely <= quantities.NOTICED * change:
            continue
        header = data.headers[key]
        where = f"starts {abs(off):.4g} K {'above' if off > 0 else 'below'} the scene's {initial} temperature"
        other = f"--set {subject.initial}={catalogue.initial + off:.6g}"
        if surely > quantities.STARTS * change:
            noisy = "" if key in data.u else "; where it is noise, say how much of it there is, --data-uncertainty U"
            raise SceneError(
                f"--against {shown}: {quoted(header)} {where}, {catalogue.initial:g} K: give {other}, "
                f'or where it is a rise --column "{catalogue.word(key)} rise={printable(header)}"{noisy}'
            )
        said.append(f"{quoted(header)} {where}, which goes into the difference: {other} would meet it")
    return tuple(said)
