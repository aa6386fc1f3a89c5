"""The stored points as columns: the source of points.csv, map.csv, the figures, the page and the sentence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scenes.formats import percent, quantity
from scenes.model import UNITS
from validate.sweep.design import Job, Row, array, unit
from validate.sweep.mapping import VERDICTS, Map

TITLES = {"fig4": "the steady peak", "fig6_peak": "the peak over time", "fig6_end": "the end over time",
       "fig7_current": "the current over time", "fig5": "the shape of the profile"}  # fmt: skip


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
        return self.job.scope.scene.kind == "sink" or bool(self.job.scope.model)

    @property
    def ok(self) -> np.ndarray:
        """(n,): which have an answer."""
        return self.columns["status"] == "ok"

    @cached_property
    def map(self) -> dict[str, np.ndarray]:
        """The columns of map.csv, with a row for each cell; none where this is no map."""
        if self.cells is None:
            return {}
        return self.job.design.columns(range(self.job.design.count)) | self.cells.columns()

    def series(self, reduction: str = "") -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Return the differences of a reduction (default: the first) by check, or the probes, with their errors.

        The sweep's own check is the first.
        """
        others = self.job.scope.reductions[1:]
        prefix = f"{reduction}_" if reduction in others else "" if self.relative else "fem3d_"
        value, error = ("_difference", "_u_num") if self.relative else ("", "_error")
        theirs = tuple(f"{name}_" for name in others if name != reduction)
        columns = [name for name in self.columns if name.endswith(error) and not name.startswith(theirs)]
        names = [name.removeprefix(prefix).removesuffix(error) for name in columns if name.startswith(prefix)]
        return {
            name: (self.columns[f"{prefix}{name}{value}"], self.columns[f"{prefix}{name}{error}"])
            for name in sorted(names, key=lambda name: name != self.job.scope.check)
        }

    @property
    def sentence(self) -> str:
        """The result in one sentence."""
        rows, what = (self.map, "cells") if self.map else (self.columns, "designs")
        words: list[str] = rows["verdict" if self.map else "status"].tolist()
        said = self._of_models(what, len(words)) if self.relative else []
        said = said or [f"{self.ok.sum()} of {len(self)} solved"]
        if not self.relative and (series := self.series()):
            name, (values, _) = next(iter(series.items()))
            probes = {probe.name: UNITS[probe.quantity] for probe in getattr(self.job.scope.scene, "probes", ())}
            largest, place = self._largest(values)
            said.append(f"{name} is up to {quantity(largest, probes.get(name, ''), 5)} (at {place})")
        if hot := set(filter(None, self.columns.get("too_hot", np.empty(0)).tolist())):
            excess = self.columns["past_valid_to_K"]
            most = f"{' and '.join(sorted(hot))} by up to {np.nanmax(excess):,.0f} K past its valid_to"
            said.append(f"too hot in {(excess > 0).sum()} of {len(self)} designs: {most}")
        unanswered = Counter(word for word in sorted(words) if word not in ("ok", *VERDICTS))
        if unanswered:
            listed = ", ".join(f"{number} {word}" for word, number in unanswered.items())
            said.append(f"{unanswered.total()} without an answer ({listed})")
        sentence = "; ".join(said)
        return sentence[0].upper() + sentence[1:]

    def _of_models(self, what: str, total: int) -> list[str]:
        """Of each model the number of designs or cells within the tolerance, the largest difference, and its cause."""
        scope, said = self.job.scope, list[str]()
        check, first = scope.check, scope.reductions[0]
        for name in [first] if self.map else scope.reductions:
            if (series := self.series(name).get(check)) is None:
                continue
            column = check if name == first else f"{name}_{check}"
            verdicts = self.map["verdict"] if self.map else self.columns[f"{column}_verdict"]
            subject = "the paper's reduction" if name == "paper" else f"the model {name}"
            tolerance, title = f"{100 * scope.scene.tolerance(check):g} %", TITLES.get(check, check)
            within = f"{(verdicts == 'agrees').sum()} of {total} {what}"
            difference, place = self._largest(series[0])
            largest = f"largest {percent(difference, 3, sign=True)} at {place}"
            said.append(f"{subject} is within {tolerance} of 3D for {title} in {within} ({largest})")
            if unresolved := (verdicts == "unresolved").sum():
                said.append(f"{unresolved} unresolved")
            differing = verdicts == "differs"
            blames = (self.map or self.columns)["blame"][differing] if name == first else []
            if blamed := Counter(word for word in blames if word):
                most, times = blamed.most_common(1)[0]
                said.append(f"to blame: {most} in {times} of {differing.sum()}")
        return said

    def _largest(self, values: np.ndarray) -> tuple[float, str]:
        """The largest value, and the values of the keys there."""
        worst, said = int(np.argmax(np.nan_to_num(np.abs(values)))), []
        for key, each in self.keys.items():
            value, of = each[worst], unit(self.job.scope.scene, key)
            number = of and not isinstance(value, str)
            said.append(f"{key} {quantity(float(value), of, 3) if number else str(value).removesuffix('.0')}")
        return float(values[worst]), ", ".join(said)


def read(job: Job, stored: Mapping[int, Row], cells: Map | None) -> Table:
    """Return the columns of all rows, by point, in the order of points.csv."""
    rows = [stored[point] for point in sorted(stored)]
    last = ("too_hot", "past_valid_to_K", "blame", "blame_share", "accuracy")
    names = sorted({name: 0 for row in rows for name in row}, key=lambda name: name in last)
    columns = {name: array([row.get(name) for row in rows]) for name in names if name not in ("point", "parts")}
    return Table(job, job.design.columns(sorted(stored)), columns, cells)
