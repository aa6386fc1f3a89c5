"""A model that is a table of values which somebody computed: rows "probe, value" in the steady state; over time a
column of times and one for each probe, with headers as data to compare with have them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from compare.data import text
from compare.data.columns import Column, is_time, scale_of, split_unit
from compare.probes import bends
from scenes.errors import SceneError, printable, quoted
from scenes.formats import quantity
from scenes.units import parse_unit
from validate.models import Answer, Asked, readable


@dataclass
class Values:
    """Steady values by probe, or the ``columns`` of a table over ``time`` (s) by their names without units."""

    name: str
    given: dict[str, Column] = field(default_factory=dict)
    time: np.ndarray = field(default_factory=lambda: np.empty(0))
    columns: dict[str, Column] = field(default_factory=dict)

    def rows(self, question: Asked) -> np.ndarray:
        return self.time

    def steady(self, question: Asked) -> Answer:
        units = question.steady
        return {n: float(self._column(n, c, units.get(n, ""))[0]) for n, c in self.given.items()}, {}

    def over_time(self, question: Asked, times: np.ndarray) -> Answer:
        """Linear between the rows, with the error of that; before the first row as there."""
        courses, errors = {}, {}
        if len(self.time) and self.time[-1] < times[-1] * (1 - 1e-9):
            last = quantity(float(self.time[-1]), "s")
            raise SceneError(
                f"--model {self.name} ends at {last}, the run at {quantity(float(times[-1]), 's')}: give rows up to "
                f'there, or --end-time "{last}"'
            )
        for name, unit in question.over_time.items():
            column = self.columns.get(question.outputs.get(name, name).lower())
            if column is None:
                continue
            values = self._column(name, column, unit)
            courses[name] = np.interp(times, self.time, values)
            errors[name] = float(bends(self.time, values).max(initial=0.0))
        if self.columns and not courses:
            raise SceneError(
                f"--model {self.name} has no column of a probe ({', '.join(question.over_time)}): it has "
                f"{', '.join(c.name for c in self.columns.values())}"
            )
        return courses, errors

    def _column(self, name: str, column: Column, unit: str) -> np.ndarray:
        if not np.isfinite(column.values).all():
            gap = quantity(float(self.time[~np.isfinite(column.values)][0]), "s")
            raise SceneError(
                f"--model {self.name}: {quoted(column.name)} has no number at {gap}: give one, or leave that row out"
            )
        scale = scale_of(column.unit)
        if scale is not None and unit and scale.powers != parse_unit(unit).powers:
            raise SceneError(f"--model {self.name}: {quoted(column.name)} is not in {unit}, as {printable(name)} is")
        return column.values if scale is None else scale.to_si(column.values)


def opened(given: str, folder: str) -> Values:
    """The values of a file. Raises SceneError for one that has none."""
    path = readable(given, folder, 'a CSV of values, with rows "probe, value" or a column of times')
    try:
        content = text.read_bytes(path)
        pairs = text.read_pairs(path, content)
        if pairs:
            return Values(path.name, {column.name: column for column in pairs})
        table = text.read(path, content)
    except SceneError as error:
        raise SceneError(str(error).replace("--against", "--model", 1)) from None
    times = [c for c in table.columns if is_time(c) or c.name.lower() in ("time", "t", "time_s")]
    if not times:
        raise SceneError(
            f'--model {quoted(path)} has no column of times, such as "time (s)", and is no list of rows "probe, value"'
        )
    scale = scale_of(times[0].unit)
    clock = times[0].values if scale is None else scale.to_si(times[0].values)
    if len(clock) < 3 or not (np.diff(clock) > 0).all():
        raise SceneError(f"--model {quoted(path)}: its times don't ascend, or are fewer than three: give one run")
    columns = {split_unit(c.name)[0].lower(): c for c in table.columns if c is not times[0]}
    columns |= {c.name.lower(): c for c in table.columns if c is not times[0]}
    return Values(path.name, {}, clock, columns)
