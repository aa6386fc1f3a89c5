"""points.csv and map.csv, written row by row; and the columns of them that figures, page and sentence are made of."""

from __future__ import annotations

import csv
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from scenes.formats import percent, quantity
from validate.sweep.base import VOLTAGE, Base, Value
from validate.sweep.point import Asked, blame
from validate.sweep.store import Store

if TYPE_CHECKING:
    from validate.sweep.job import Job
    from validate.sweep.mapping import Map

_STATUS = ("status", "because", "seconds")


@dataclass(frozen=True, eq=False)
class Table:
    """The points that are stored, in order: the varied ``keys`` (name: (n,) numbers, or words), and of every other
    column what is a number (NaN where there is none) or a word ("" where there is none)."""

    keys: dict[str, np.ndarray]
    columns: dict[str, np.ndarray]
    units: dict[str, str]
    counts: Counter[str] = field(default_factory=Counter)

    def __len__(self) -> int:
        return len(self.columns["status"])

    @property
    def ok(self) -> np.ndarray:
        """(n,): which have an answer."""
        found: np.ndarray = self.columns["status"] == "ok"
        return found

    def at(self, number: int) -> str:
        """A point in words."""
        return ", ".join(f"{key} {shown(values[number], self.units[key])}" for key, values in self.keys.items())


def read(job: Job, store: Store) -> Table:
    """The columns of all rows that are stored, in the order in which points.csv has them."""
    numbers: list[int] = []
    found: dict[str, list[Any]] = {}
    for n, row in enumerate(store.rows()):
        numbers.append(row.point)
        values = {**{name: getattr(row, name) for name in _STATUS}, "blame": "", **row.values}
        for name in values:
            found.setdefault(name, [None] * n)
        for name, column in found.items():
            value = values.get(name)
            column.append(sys.intern(value) if isinstance(value, str) else value)
    points = [job.design.point(number) for number in numbers]
    keys = {key: _array([point[i] for point in points]) for i, key in enumerate(job.design.keys)}
    columns = {name: _array(column) for name, column in found.items()}
    units = {key: job.base.unit(key) for key in job.design.keys}
    return Table(keys, columns, units, Counter(columns["status"].tolist()))


def _array(column: Sequence[Any]) -> np.ndarray:
    """Numbers as such with NaN for none; words with "" for none."""
    if any(isinstance(value, str) for value in column):
        return np.array(["" if value is None else value for value in column], object)
    return np.array([np.nan if value is None else value for value in column], float)


def write_points(job: Job, store: Store) -> None:
    """points.csv, a row per point in their order, with the columns of DESIGN 4.4."""
    names = list(dict.fromkeys(name for row in store.rows() for name in row.values))
    last = [name for name in names if name in ("blame", "blame_share", "accuracy")]
    names = [name for name in names if name not in last] + last
    rows = (
        [*job.design.point(row.point), *(getattr(row, name) for name in _STATUS), *(row.values.get(n) for n in names)]
        for row in store.rows()
    )
    _write(store, "points.csv", [*job.design.keys, *_STATUS, *names], rows)


def write_map(job: Job, store: Store, found: Map) -> None:
    """map.csv, a row per cell."""
    verdicts, blamed = found.verdicts.ravel(), blames(found).ravel()
    values, errors = found.surface.value.ravel(), found.surface.error.ravel()

    def row(n: int) -> list[Any]:
        solved = found.solved.get(n)
        known = np.isfinite(values[n]) and (solved is None or solved.status == "ok") and verdicts[n] in _VERDICTS
        numbers = [values[n], errors[n]] if known else [None, None]
        return [*job.design.point(n), *numbers, verdicts[n], "solved" if solved else "interpolated", blamed[n]]

    heads = [*job.design.keys, "difference", "error", "verdict", "how", "blame"]
    _write(store, "map.csv", heads, map(row, range(values.size)))


_VERDICTS = ("agrees", "differs", "unresolved")


def blames(found: Map) -> np.ndarray:
    """(n, m): the assumption with the largest part, the parts being interpolated between the cells that have them; ""
    where there is no answer."""
    from scipy.interpolate import NearestNDInterpolator, RBFInterpolator

    shape = found.surface.value.shape
    rows = [row for row in found.solved.values() if row.parts]
    if not rows:
        return np.full(shape, "", object)
    names = list(rows[0].parts or {})
    at = np.column_stack(np.unravel_index([row.point for row in rows], shape)).astype(float)
    parts = np.array([[(row.parts or {}).get(name, 0.0) for name in names] for row in rows])
    everywhere = np.indices(shape).reshape(2, -1).T.astype(float)
    through = RBFInterpolator(at, parts, kernel="linear") if len(rows) > 2 else NearestNDInterpolator(at, parts)
    values = through(everywhere)
    words = np.array([blame(dict(zip(names, row, strict=True)))["blame"] for row in values], object).reshape(shape)
    words[~np.isin(found.verdicts, _VERDICTS)] = ""
    return words


def _write(store: Store, name: str, heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table of numbers to the last digit; what there is none of is empty."""
    with store.writing(name) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heads)
        for row in rows:
            writer.writerow([repr(float(cell)) if isinstance(cell, float) else cell for cell in row])


def shown(value: Value, unit: str) -> str:
    """A varied key's value for a person."""
    return str(value) if isinstance(value, str) else quantity(float(value), unit, 3)


TITLES = {"fig4": "the steady peak", "fig6_peak": "the peak over time", "fig6_end": "the end over time",
       "fig7_current": "the current over time", "fig5": "the shape of the profile"}  # fmt: skip


def sentence(base: Base, asked: Asked, table: Table, tolerance: float, found: Map | None = None) -> str:
    """What the whole says, in one sentence."""
    if base.kind == "free":
        return _of_probes(table)
    check, name = asked.check, asked.reductions[0]
    if found is None:
        verdicts, blamed = table.columns.get(f"{check}_verdict"), table.columns["blame"]
        total, what = len(table), "designs"
    else:
        verdicts, blamed = found.verdicts.ravel(), blames(found).ravel()
        total, what = verdicts.size, "cells"
    if verdicts is None:
        return f"none of {total} {what} has an answer{_lost(table.counts)}"
    subject = "the paper's reduction" if name == "paper" else name
    of = f" of 3D in {TITLES[check]}" if check in TITLES else f" of 3D as {check} has it"
    within, beyond = (verdicts == "agrees").sum(), verdicts == "differs"
    said = f"{subject} is within {100 * tolerance:g} %{of} in {within} of {total} {what}"
    if len(table) < total:
        said += f", {len(table)} of them solved"
    differences = table.columns[f"{check}_difference"]
    if np.isfinite(differences).any():
        worst = int(np.nanargmax(np.abs(differences)))
        largest = f"largest {percent(differences[worst], 3, sign=True)} at {table.at(worst)}"
        where = _first(table, np.abs(differences)) if beyond.any() else ""
        said += f"; it fails first where {where} ({largest})" if where else f" ({largest})"
    if beyond.any() and (blamed[beyond] != "").any():
        most, times = Counter(word for word in blamed[beyond] if word).most_common(1)[0]
        said += f"; to blame: {most} in {times} of {beyond.sum()}"
    unresolved = int((verdicts == "unresolved").sum())
    return said + (f"; {unresolved} unresolved" if unresolved else "") + _lost(table.counts)


def _lost(counts: Counter[str]) -> str:
    lost = {word: number for word, number in counts.items() if word != "ok"}
    words = ", ".join(f"{number} {word}" for word, number in sorted(lost.items()))
    return f"; {sum(lost.values())} without an answer ({words})" if lost else ""


def _first(table: Table, size: np.ndarray) -> str:
    """The key that the difference grows with most, and to which side; "" where none stands out."""
    known = np.isfinite(size)
    best, said = 0.3, ""
    for key, values in table.keys.items():
        if values.dtype == object or len(set(values[known])) < 2 or np.ptp(size[known]) == 0:
            continue
        # Spearman's correlation, but for ties.
        ranks = [np.argsort(np.argsort(given, kind="stable")) for given in (np.abs(values[known]), size[known])]
        rank = float(np.corrcoef(ranks[0], ranks[1])[0, 1])
        if abs(rank) > best:
            best = abs(rank)
            words = ("high", "low") if key == VOLTAGE else ("large", "small")
            said = f"{key} is {words[rank < 0]}"
    return said


def _of_probes(table: Table) -> str:
    """What the first probe of a free scene does."""
    done = int(table.ok.sum())
    said = f"{done} of {len(table)} designs solved"
    name = next((n for n in table.columns if n.startswith("fem3d_") and not n.endswith("_error")), None)
    if name is not None:
        values = table.columns[name]
        low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
        ends = (f"{values[n]:.5g} (at {table.at(n)})" for n in (low, high))
        said += f"; {name.removeprefix('fem3d_')} is from {' to '.join(ends)}"
    return said + _lost(table.counts)
