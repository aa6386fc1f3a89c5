"""traces.csv: the quantities of every model against time."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenes.result import Result


def write_traces(path: Path, *results: Result | None) -> str:
    """Writes the traces of the models that have any, which share their times; returns the file's name. ValueError where
    the times differ."""
    return write_columns(path, columns_of(*results))


def columns_of(*results: Result | None) -> dict[str, np.ndarray]:
    """The columns of the traces of the models that have any.

    time_s, then <model>_<quantity>_<unit> with temperatures in kelvin, where every 1D model is "reduced1d": a
    reader of the columns need not know which it was. ValueError where the times differ.
    """
    models = [r for r in results if r is not None and r.traces is not None]
    columns: dict[str, np.ndarray] = {}
    for result in models:
        traces = result.traces
        assert traces is not None
        time = columns.setdefault("time_s", traces.time)
        if not np.array_equal(time, traces.time):
            raise ValueError("the models' traces must be at the same times")
        model = "fem3d" if result.model == "fem3d" else "reduced1d"
        columns |= {f"{model}_{key}": value for key, value in traces.values.items()}
    return columns


def write_columns(path: Path, columns: dict[str, np.ndarray]) -> str:
    """Writes columns of equal length under their names, to full precision; returns the file's name."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path.name
