"""The stored points as columns: the source of points.csv, map.csv, the figures, the page and the sentence."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from scenes.checks import DEFAULT_TOLERANCES, ISLAND_TOLERANCES
from scenes.formats import percent, quantity
from validate.sweep.design import array
from validate.sweep.mapping import VERDICTS, Map
from validate.sweep.point import Job
from validate.sweep.store import Store

TITLES = {"fig4": "the steady peak", "fig6_peak": "the peak over time", "fig6_end": "the end over time",
       "fig7_current": "the current over time", "fig5": "the shape of the profile"}  # fmt: skip

Series = tuple[np.ndarray, np.ndarray]
"""Values and their numerical errors, each (points,)."""


@dataclass(frozen=True, eq=False)
class Table:
    """The stored points in order: the varied ``keys`` and all other ``columns``, each (n,) numbers with NaN for none,
    or words with "" for none; of a map also the ``cells``."""

    job: Job
    keys: dict[str, np.ndarray]
    columns: dict[str, np.ndarray]
    cells: Map | None = None

    def __len__(self) -> int:
        return len(self.columns["status"])

    def __getitem__(self, name: str) -> np.ndarray:
        """(n,): a column, or the values of a varied key."""
        return self.keys[name] if name in self.keys else self.columns[name]

    @property
    def relative(self) -> bool:
        """Whether there is a 1D model: series are relative differences, else values of probes."""
        return self.job.base.kind == "sink" or bool(self.job.scope.model)

    @property
    def ok(self) -> np.ndarray:
        """(n,): which have an answer."""
        return self.columns["status"] == "ok"

    @cached_property
    def map(self) -> dict[str, np.ndarray]:
        """The columns of map.csv, with a row for each cell; none where this is no map."""
        if self.cells is None:
            return {}
        design, cells = self.job.design, self.cells
        how = np.full(design.count, "interpolated", object)
        for number, row in cells.solved.items():
            how[number] = "refused" if row.status == "refused" else "solved"
        value = cells.value.ravel()
        return design.columns(range(design.count)) | {
            "difference": value,
            "error": np.where(np.isfinite(value), cells.error.ravel(), np.nan),
            "verdict": cells.verdicts.ravel(),
            "how": how,
            "blame": cells.blames.ravel(),
            "too_hot": cells.too_hot.ravel(),
        }

    @property
    def sentence(self) -> str:
        """The result in one sentence."""
        words = self.map["verdict"] if self.map else self.columns["status"]
        said = [*(_of_models(self) if self.relative else _of_probes(self)), *_of_heat(self)]
        unanswered = Counter(word for word in sorted(words.tolist()) if word not in ("ok", *VERDICTS))
        if unanswered:
            listed = ", ".join(f"{number} {word}" for word, number in unanswered.items())
            said.append(f"{unanswered.total()} without an answer ({listed})")
        return "; ".join(said)

    @cached_property
    def units(self) -> dict[str, str]:
        return {key: self.job.base.unit(key) for key in self.keys}

    @cached_property
    def tolerances(self) -> dict[str, float]:
        scene: Any = self.job.base.at(())
        return {check: scene.tolerance(check) for check in self.series()} if self.relative else {}

    def series(self, reduction: str = "") -> dict[str, Series]:
        """Return the differences of a reduction (default: the first) by check, or the probes, the sweep's own first.

        A check that one of several designs has alone is left out: the others are of another kind.
        """
        scope = self.job.scope
        if self.relative:
            prefix = "" if reduction in ("", scope.reductions[0]) else f"{reduction}_"
            ends = (name.removesuffix("_difference") for name in self.columns if name.endswith("_difference"))
            checks = tuple(ends) if scope.model else (*DEFAULT_TOLERANCES, *ISLAND_TOLERANCES)
            names = {check: (f"{prefix}{check}_difference", f"{prefix}{check}_u_num") for check in checks}
        else:
            probes = (name.removesuffix("_error") for name in self.columns if name.endswith("_error"))
            names = {probe.removeprefix("fem3d_"): (probe, f"{probe}_error") for probe in probes}
        series = {}
        for name in sorted(names, key=lambda name: name != scope.check):
            values, errors = (self.columns.get(column) for column in names[name])
            if values is None or errors is None:
                continue
            if name == scope.check or np.isfinite(values).sum() > min(1, len(self) - 1):
                series[name] = values, errors
        return series

    def at(self, number: int) -> str:
        said = []
        for key, values in self.keys.items():
            value, unit = values[number], self.units[key]
            if not isinstance(value, str):
                value = quantity(float(value), unit, 3) if unit else f"{float(value):g}"
            said.append(f"{key} {value}")
        return ", ".join(said)


def read(job: Job, store: Store, cells: Map | None) -> Table:
    """Return the columns of all stored rows in the order of points.csv."""
    rows = store.rows()
    values = [{"status": row.status, "because": row.because, "seconds": row.seconds, **row.values} for row in rows]
    last = ("too_hot", "past_valid_to_K", "blame", "blame_share", "accuracy")
    names = sorted(dict.fromkeys(name for each in values for name in each), key=lambda name: name in last)
    columns = {name: array([each.get(name) for each in values]) for name in names}
    return Table(job, job.design.columns(row.point for row in rows), columns, cells)


def _of_heat(table: Table) -> list[str]:
    """The number of designs or cells hotter than a material's valid_to, and the largest excess."""
    materials = (table.map or table.columns).get("too_hot", np.empty(0))
    names = Counter(filter(None, materials.tolist()))
    if not names:
        return []
    excess = table.columns["past_valid_to_K"]
    n = int(np.nanargmax(excess))
    most = f"{table.columns['too_hot'][n]} by up to {excess[n]:,.0f} K" if excess[n] > 0 else " and ".join(names)
    return [
        f"too hot in {names.total()} of {len(materials)} {'cells' if table.map else 'designs'}: {most}, past its "
        "valid_to, where it softens, melts or decomposes, and nothing here is true of a real part"
    ]


def _of_models(table: Table) -> list[str]:
    """The number of designs or cells within the tolerance, the place of the largest difference, and its cause."""
    scope, what = table.job.scope, "cells" if table.map else "designs"
    check, (name, *others) = scope.check, scope.reductions
    rows = table.map or table.columns
    verdicts, total = rows.get("verdict" if table.map else f"{check}_verdict"), len(next(iter(rows.values())))
    if verdicts is None or check not in table.series():
        return [f"none of {total} {what} has an answer"]
    if scope.model:
        subject, reference = f"the model {name}", f"at {check}"
    else:
        subject = "the paper's reduction" if name == "paper" else name
        reference = f"in {TITLES[check]}" if check in TITLES else f"as {check} has it"
    agreeing, differing = (verdicts == "agrees").sum(), verdicts == "differs"
    tolerance = f"{100 * table.tolerances[check]:g} %"
    said = [f"{subject} is within {tolerance} of 3D {reference} in {agreeing} of {total} {what}"]
    if table.map:
        said[0] += f", {(table.columns['status'] != 'refused').sum()} of them solved"
    differences = table.series()[check][0]
    if differing.any() and (where := _first(table, np.abs(differences))):
        said.append(f"it {'fails first' if agreeing else 'differs most'} where {where}")
    said[-1] += _largest(table, differences)
    if blamed := Counter(word for word in rows["blame"][differing] if word):
        most, times = blamed.most_common(1)[0]
        said.append(f"to blame: {most} in {times} of {differing.sum()}")
    if unresolved := (verdicts == "unresolved").sum():
        said.append(f"{unresolved} unresolved")
    for other in others:
        agreeing = (table.columns[f"{other}_{check}_verdict"] == "agrees").sum()
        largest = _largest(table, table.series(other)[check][0])
        said.append(f"{other} is within it in {agreeing} of {len(table)}{largest}")
    return said


def _largest(table: Table, differences: np.ndarray) -> str:
    """The largest difference and its place, in brackets; "" without any."""
    if not np.isfinite(differences).any():
        return ""
    worst = int(np.nanargmax(np.abs(differences)))
    return f" (largest {percent(differences[worst], 3, sign=True)} at {table.at(worst)})"


def _first(table: Table, size: np.ndarray) -> str:
    """The key that the difference grows with most, and to which side; "" where none stands out."""
    from scipy.stats import spearmanr

    known = np.isfinite(size)
    best, said = 0.3, ""
    for key, values in table.keys.items():
        if values.dtype == object or len(set(np.abs(values[known]))) < 2 or np.ptp(size[known]) == 0:
            continue
        rank = float(spearmanr(np.abs(values[known]), size[known]).statistic)
        if abs(rank) > best:
            best = abs(rank)
            words = ("high", "low") if key == "drive.voltage" else ("large", "small")
            said = f"{key} is {words[rank < 0]}"
    return said


def _of_probes(table: Table) -> list[str]:
    """The range of the first probe."""
    said = [f"{table.ok.sum()} of {len(table)} designs solved"]
    for name, (values, _) in list(table.series().items())[:1]:
        ends = (f"{values[n]:.5g} (at {table.at(n)})" for n in (int(np.nanargmin(values)), int(np.nanargmax(values))))
        said.append(f"{name} is from {' to '.join(ends)}")
    return said
