"""A model that is a table of computed values: rows "probe, value", or one row with probes in columns, in the steady
state; over time a column of times and one for each probe, with headers as in data to compare with."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from compare.course import bends
from compare.data import text
from compare.data.columns import Column, find_times
from compare.models.model import Model, Question, find_file, match_outputs
from compare.quantities import AT_REST, of
from scenes.errors import SceneError
from scenes.formats import quantity
from scenes.result import Traces


def _answer(columns: Sequence[Column], rows: np.ndarray, question: Question) -> Traces:
    """The values of columns at ``rows`` (s), over time with the error of straight lines between these."""
    times = question.times
    if np.isfinite(rows[-1]) != (times is not None):
        return Traces(AT_REST, {}, {})
    if times is not None and rows[-1] < times[-1] * (1 - 1e-9):
        last, end = (quantity(float(each[-1]), "s") for each in (rows, times))
        raise SceneError(f'it ends at {last}, the run at {end}: give rows up to there, or --end-time "{last}"')
    outputs = {name: own.lower() for name, own in question.outputs.items()}
    # By their headers in small letters, also without the unit and the word "rise".
    plain = {c.plain.lower(): c for c in columns}
    named = {name.removesuffix(" rise"): c for name, c in plain.items()} | plain | {c.name.lower(): c for c in columns}
    values, initial = {}, of(question.scene).initial
    for name, own in match_outputs("column", outputs, question.units, named).items():
        is_rise = named[own].plain.lower().endswith(" rise")
        values[name] = named[own].differences + initial if is_rise else named[own].si
    if times is None:
        return Traces(rows, values, {})
    late = max(rows[0] - times[0], 0.0) / (rows[1] - rows[0])  # before the first row its value holds
    errors = {n: float((bends(rows, v) + _steps(rows, v)).max() + late * np.ptp(v[:2])) for n, v in values.items()}
    return Traces(rows, values, errors)


def _steps(rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return (n - 1,): the change between two rows that neither neighbouring slope explains, as of a step in time; a
    straight line may be off by as much at either end."""
    h = np.diff(rows)
    slopes = np.pad(np.diff(values) / h, 1, mode="edge")
    before, after = slopes[1:-1] - slopes[:-2], slopes[1:-1] - slopes[2:]
    return np.where(before * after > 0, np.minimum(np.abs(before), np.abs(after)) * h, 0.0)


def open_model(given: str, folder: str) -> Model:
    """Return the values of a file. Raises SceneError for a file without any."""
    path = find_file(given, folder, 'a CSV of values, with rows "probe, value" or a column of times')
    kind, columns = text.read(text.read_bytes(path, "the table"))
    clock = next(iter(find_times(columns)), None)
    if kind == text.LIST or (clock is None and len(columns[0].values) == 1):
        return Model(path.name, partial(_answer, columns, AT_REST))
    if clock is None:
        raise SceneError('it has no column of times, such as "time (s)", and is no list of rows "probe, value"')
    rows = clock.si
    if len(rows) < 3 or not (np.diff(rows) > 0).all():
        raise SceneError("its times don't ascend, or are fewer than three: give one run")
    return Model(path.name, partial(_answer, [c for c in columns if c is not clock], rows))
