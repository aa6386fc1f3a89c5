"""A model that is a table of computed values: rows "probe, value" in the steady state; over time a column of times and
one for each probe, with headers as in data to compare with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from compare.course import bends
from compare.data import text
from compare.data.columns import Column, refusing
from compare.models.model import Answer, Model, Question, find_file, match_outputs
from scenes.errors import SceneError, printable, quoted
from scenes.formats import quantity
from scenes.units import parse_unit


class Table(Model):
    """Columns by their names without units: of one ``steady`` value each, or over ``rows`` (s)."""

    def __init__(
        self, name: str, steady: Mapping[str, Column], rows: np.ndarray, columns: Mapping[str, Column]
    ) -> None:
        self.name, self.rows, self._steady, self._columns = name, rows, steady, columns

    def answer(self, question: Question, times: np.ndarray | None) -> Answer:
        """Return the values, linear between the rows, with the error of that."""
        if times is None:
            return Answer({n: self._si(n, c, question.steady.get(n, ""))[0] for n, c in self._steady.items()})
        if len(self.rows) and self.rows[-1] < times[-1] * (1 - 1e-9):
            last = quantity(float(self.rows[-1]), "s")
            raise SceneError(
                f"--model {self.name} ends at {last}, the run at {quantity(float(times[-1]), 's')}: give rows up to "
                f'there, or --end-time "{last}"'
            )
        values: dict[str, np.ndarray] = {}
        errors: dict[str, float] = {}
        if not self._columns:
            return Answer(values)
        outputs = {name: own.lower() for name, own in question.outputs.items()}
        question = replace(question, outputs=outputs)
        for name, column in match_outputs(self.name, "column", question, question.over_time, self._columns).items():
            course = self._si(name, self._columns[column], question.over_time[name])
            values[name] = np.interp(times, self.rows, course)
            errors[name] = float(bends(self.rows, course).max(initial=0.0))
        return Answer(values, errors)

    def _si(self, name: str, column: Column, unit: str) -> np.ndarray:
        """Return the column of a quantity in SI units."""
        gaps = np.flatnonzero(~np.isfinite(column.values))
        if gaps.size:
            at = f" at {quantity(float(self.rows[gaps[0]]), 's')}" if len(self.rows) else ""
            raise SceneError(
                f"--model {self.name}: {quoted(column.name)} has no number{at}: give one, or leave that row out"
            )
        if column.powers is not None and unit and column.powers != parse_unit(unit).powers:
            raise SceneError(f"--model {self.name}: {quoted(column.name)} is not in {unit}, as {printable(name)} is")
        return column.si


def open_model(given: str, folder: str) -> Table:
    """Return the values of a file. Raises SceneError for a file without any."""
    path = find_file(given, folder, 'a CSV of values, with rows "probe, value" or a column of times')
    content = text.read_bytes(path, "--model")
    with refusing(f"--model {quoted(path)}"):
        if pairs := text.read_pairs(content):
            return Table(path.name, {column.name: column for column in pairs}, np.empty(0), {})
        _, columns = text.read(content)
    clock = next((c for c in columns if c.is_time or c.name.lower() in ("time", "t", "time_s")), None)
    if clock is None:
        raise SceneError(
            f'--model {quoted(path)} has no column of times, such as "time (s)", and is no list of rows "probe, value"'
        )
    rows = clock.si
    if len(rows) < 3 or not (np.diff(rows) > 0).all():
        raise SceneError(f"--model {quoted(path)}: its times don't ascend, or are fewer than three: give one run")
    others = [c for c in columns if c is not clock]
    names = {c.plain.lower(): c for c in others} | {c.name.lower(): c for c in others}
    return Table(path.name, {}, rows, names)
