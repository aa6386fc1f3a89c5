"""A user's traces, ready to be compared: read from whichever file it is, sorted by what the columns mean."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compare.against import comsol, ngspice, plain, quantities
from compare.against.columns import Table, read_bytes, read_text, unit_of
from scenes.errors import SceneError, quoted
from scenes.sink import Sink


@dataclass(frozen=True)
class Data:
    """Traces from a file: ``time`` (s, ascending) and ``values`` by the keys of traces.csv, in SI units.

    ``headers`` are the columns' own names, ``notes`` how a column was read where that is not plain.
    """

    name: str
    kind: str
    time: np.ndarray
    values: dict[str, np.ndarray]
    headers: dict[str, str]
    notes: tuple[str, ...] = ()

    def document(self) -> dict[str, Any]:
        """What the summary says of it."""
        return {
            "file": self.name, "kind": self.kind, "rows": len(self.time),
            "from_s": float(self.time[0]), "to_s": float(self.time[-1]),
            "columns": self.headers, "notes": list(self.notes),
        }  # fmt: skip


def read(path: Path, sink: Sink) -> Data:
    """The traces in a file; SceneError where there are none that the sink has, saying what was found."""
    table = _table(path)
    shown = quoted(path)
    times = [column for column in table.columns if quantities.is_time(column)]
    if len(times) != 1:
        names = ", ".join(quoted(c.name) for c in table.columns[:8])
        found = "no column is the time" if not times else "several columns are the time"
        raise SceneError(f'--against {shown}: {found} with its unit, such as "Time (s)"; its columns are {names}')
    kept: dict[str, quantities.Match] = {}
    missed: dict[str, str] = {}
    for column in table.columns:
        if column is times[0]:
            continue
        found_one = quantities.match(column, sink, table.kind.startswith("ngspice"))
        if isinstance(found_one, str):
            missed[column.name] = found_one
        elif found_one.key in kept:
            raise SceneError(
                f"--against {shown}: both {quoted(kept[found_one.key].header)} and {quoted(column.name)} are the "
                f"sink's {found_one.key}: leave one out, or name its place"
            )
        else:
            kept[found_one.key] = found_one
    if not kept:
        raise SceneError(f"--against {shown}: {quantities.refusal(table, missed)}")
    unit = unit_of(times[0].unit)
    assert unit is not None
    time, order = _ascending(times[0].values * 10.0**unit.exponent, shown)
    values = {key: m.values[order] for key, m in kept.items()}
    for key, value in values.items():
        if not np.isfinite(value).all():
            raise SceneError(f"--against {shown}: {quoted(kept[key].header)} has values that are not finite numbers")
    notes = tuple(f"{m.header}: {m.note}" for m in kept.values() if m.note)
    notes += tuple(f"{header}: left out, it {why}" for header, why in missed.items())
    return Data(path.name, table.kind, time, values, {key: m.header for key, m in kept.items()}, notes)


def _table(path: Path) -> Table:
    data = read_bytes(path)
    if ngspice.is_raw(data):
        return ngspice.read_raw(path, data)
    if b"\0" in data[:4000]:
        raise SceneError(f"--against {quoted(path)} is binary, but no ngspice raw file: export a table as text")
    text = read_text(path)
    if comsol.is_one(text):
        return comsol.read(path, text)
    if ngspice.is_printed(text):
        return ngspice.read_printed(path, text)
    return plain.read(path, text)


def _ascending(time: np.ndarray, shown: str) -> tuple[np.ndarray, np.ndarray]:
    """Times in order, each once, and where they were; SceneError for fewer than three, or times that are none."""
    if not np.isfinite(time).all():
        raise SceneError(f"--against {shown}: its times are not all finite numbers")
    found, order = np.unique(time, return_index=True)
    if len(found) < 3:
        raise SceneError(f"--against {shown} has {len(found)} times: three are the least to compare curves by")
    return found, order
