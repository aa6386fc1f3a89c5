"""The stored points as columns, of which figures, page and sentence are made; points.csv and map.csv."""

from __future__ import annotations

import csv
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from scenes.checks import DEFAULT_TOLERANCES, ISLAND_TOLERANCES
from scenes.formats import percent, quantity
from validate.sweep.base import VOLTAGE
from validate.sweep.job import Job
from validate.sweep.store import Store

if TYPE_CHECKING:
    from validate.sweep.mapping import Map

_STATUS = ("status", "because", "seconds")
Series = tuple[np.ndarray, np.ndarray]
"""Values and their numerical errors, each (points,)."""


@dataclass(frozen=True, eq=False)
class Table:
    """The points that are stored, in order: the varied ``keys`` (name: (n,) numbers, or words), and of every other
    column what is a number (NaN where there is none) or a word ("" where there is none). Of a map also the ``cells``.
    """

    job: Job
    keys: dict[str, np.ndarray]
    columns: dict[str, np.ndarray]
    cells: Map | None = None

    def __len__(self) -> int:
        return len(self.columns["status"])

    @property
    def relative(self) -> bool:
        """Whether there is a 1D model to compare with: series are relative differences, else values of probes."""
        return self.job.base.kind == "sink"

    @cached_property
    def counts(self) -> Counter[str]:
        """How many points have each status."""
        return Counter(self.columns["status"].tolist())

    @cached_property
    def units(self) -> dict[str, str]:
        """The SI unit of each key."""
        return {key: self.job.base.unit(key) for key in self.keys}

    @cached_property
    def tolerances(self) -> dict[str, float]:
        """The tolerance of every check that was made."""
        scene: Any = self.job.base.at(())
        return {check: scene.tolerance(check) for check in self.series()} if self.relative else {}

    @property
    def ok(self) -> np.ndarray:
        """(n,): which have an answer."""
        found: np.ndarray = self.columns["status"] == "ok"
        return found

    def series(self, reduction: str = "") -> dict[str, Series]:
        """The differences of a reduction (the first, if none is given) by check, or the probes; first the one that the
        sweep is of. Checks that a single one of several designs has are left out: the others are of another kind."""
        scope = self.job.scope
        if self.relative:
            own = "" if reduction in ("", scope.reductions[0]) else f"{reduction}_"
            checks = (*DEFAULT_TOLERANCES, *ISLAND_TOLERANCES)
            names = {check: (f"{own}{check}_difference", f"{own}{check}_u_num") for check in checks}
        else:
            probes = (name.removesuffix("_error") for name in self.columns if name.endswith("_error"))
            names = {probe.removeprefix("fem3d_"): (probe, f"{probe}_error") for probe in probes}
        order = sorted(names, key=lambda name: name != scope.check)
        return {
            name: (self.columns[names[name][0]], self.columns[names[name][1]])
            for name in order
            if name == scope.check or self._known(names[name][0]) > min(1, len(self) - 1)
        }

    def _known(self, column: str) -> int:
        """How many designs have a number there."""
        return int(np.isfinite(self.columns[column].astype(float)).sum()) if column in self.columns else 0

    def at(self, number: int) -> str:
        """A point in words."""

        def shown(key: str) -> str:
            value = self.keys[key][number]
            if isinstance(value, str):
                return value
            return quantity(float(value), self.units[key], 3) if self.units[key] else f"{float(value):g}"

        return ", ".join(f"{key} {shown(key)}" for key in self.keys)


def read(job: Job, store: Store, cells: Map | None) -> Table:
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
    return Table(job, keys, {name: _array(column) for name, column in found.items()}, cells)


def _array(column: Sequence[Any]) -> np.ndarray:
    """Numbers as such with NaN for none; words with "" for none."""
    if any(isinstance(value, str) for value in column):
        return np.array(["" if value is None else value for value in column], object)
    return np.array([np.nan if value is None else value for value in column], float)


def write_points(job: Job, store: Store) -> None:
    """points.csv, a row per point in their order, with the columns of DESIGN 4.4."""
    names = list(dict.fromkeys(name for row in store.rows() for name in row.values))
    names.sort(key=lambda name: name in ("blame", "blame_share", "accuracy"))
    rows = (
        [*job.design.point(row.point), *(getattr(row, name) for name in _STATUS), *(row.values.get(n) for n in names)]
        for row in store.rows()
    )
    _write(store, "points.csv", [*job.design.keys, *_STATUS, *names], rows)


def write_map(job: Job, store: Store, cells: Map) -> None:
    """map.csv, a row per cell."""
    from validate.sweep.mapping import VERDICTS

    verdicts, blamed = cells.verdicts.ravel(), cells.blames.ravel()
    values, errors = cells.surface.value.ravel(), cells.surface.error.ravel()

    def row(n: int) -> list[Any]:
        solved = cells.solved.get(n)
        known = np.isfinite(values[n]) and (solved is None or solved.status == "ok") and verdicts[n] in VERDICTS
        numbers = [values[n], errors[n]] if known else [None, None]
        return [*job.design.point(n), *numbers, verdicts[n], "solved" if solved else "interpolated", blamed[n]]

    heads = [*job.design.keys, "difference", "error", "verdict", "how", "blame"]
    _write(store, "map.csv", heads, map(row, range(values.size)))


def _write(store: Store, name: str, heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table of numbers to the last digit; what there is none of is empty."""
    with store.writing(name) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heads)
        for row in rows:
            writer.writerow([repr(float(cell)) if isinstance(cell, float) else cell for cell in row])


TITLES = {"fig4": "the steady peak", "fig6_peak": "the peak over time", "fig6_end": "the end over time",
       "fig7_current": "the current over time", "fig5": "the shape of the profile"}  # fmt: skip


COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#999999", "#f0e442")
"""Okabe and Ito's, which stay apart for colour-blind readers."""


def sentence(table: Table) -> str:
    """What the whole says, in one sentence."""
    lost = {word: number for word, number in table.counts.items() if word != "ok"}
    words = ", ".join(f"{number} {word}" for word, number in sorted(lost.items()))
    return _answer(table) + (f"; {sum(lost.values())} without an answer ({words})" if lost else "")


def _answer(table: Table) -> str:
    if not table.relative:
        return _of_probes(table)
    check, name = table.job.scope.check, table.job.scope.reductions[0]
    if table.cells is None:
        verdicts, blamed = table.columns.get(f"{check}_verdict"), table.columns["blame"]
        total, what = len(table), "designs"
    else:
        verdicts, blamed = table.cells.verdicts.ravel(), table.cells.blames.ravel()
        total, what = verdicts.size, "cells"
    if verdicts is None or check not in table.series():
        return f"none of {total} {what} has an answer"
    subject = "the paper's reduction" if name == "paper" else name
    of = f" of 3D in {TITLES[check]}" if check in TITLES else f" of 3D as {check} has it"
    within, beyond = (verdicts == "agrees").sum(), verdicts == "differs"
    said = f"{subject} is within {100 * table.tolerances[check]:g} %{of} in {within} of {total} {what}"
    if len(table) < total:
        said += f", {len(table)} of them solved"
    differences = table.series()[check][0]
    if np.isfinite(differences).any():
        worst = int(np.nanargmax(np.abs(differences)))
        largest = f"largest {percent(differences[worst], 3, sign=True)} at {table.at(worst)}"
        where = _first(table, np.abs(differences)) if beyond.any() else ""
        said += f"; it fails first where {where} ({largest})" if where else f" ({largest})"
    if beyond.any() and (blamed[beyond] != "").any():
        most, times = Counter(word for word in blamed[beyond] if word).most_common(1)[0]
        said += f"; to blame: {most} in {times} of {beyond.sum()}"
    unresolved = int((verdicts == "unresolved").sum())
    return said + (f"; {unresolved} unresolved" if unresolved else "")


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
    """What the probe that the sweep is of does."""
    done = int(table.ok.sum())
    said = f"{done} of {len(table)} designs solved"
    for name, (values, _) in list(table.series().items())[:1]:
        low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
        ends = (f"{values[n]:.5g} (at {table.at(n)})" for n in (low, high))
        said += f"; {name} is from {' to '.join(ends)}"
    return said
