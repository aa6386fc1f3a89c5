"""Traces against traces: the largest distance over time, with what it is known to. Of the 1D model's from the 3D
model's, and of a user's own (`validate.against` reads them from files of other programs).

The largest distance of the two models is sought at the times of the 3D traces from 10 us on (and at 10 us itself). Its
error has four parts, added: that of the 3D trace, that of the 1D trace (rounding), that of the final change that it is
relative to, and what a maximum between two times may exceed the one found by.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from compare import windows
from compare.verdict import COVERS, Check, Comparison, Models, judged, spread, unit_of
from scenes.checks import FIRST_TIME
from scenes.errors import SceneError, quoted
from scenes.formats import cut, quantity, signed, span
from scenes.result import Estimate, Result, Traces
from scenes.sink import OF_A_SINK, Sink

QUANTITIES = {name: asked.trace for name, asked in OF_A_SINK.items() if asked.trace}
"""What a user calls the quantities of traces.csv."""
_NAMES = {key: name for name, key in QUANTITIES.items()}
_OF = {"current_A": "final change", "power_W": "final value"}
"""What a difference of a trace is relative to, where that is no final rise."""


@dataclass(frozen=True)
class Largest:
    """The largest distance |1D - 3D| of two traces, with its sign, both values, its time (s) and the bound of what a
    maximum between the times may be larger by."""

    distance: float
    predicted: float
    measured: float
    time: float
    beyond: float


def from_first(time: np.ndarray) -> np.ndarray:
    """The times (s) from 10 us on, that one among them."""
    return np.concatenate([[FIRST_TIME], time[time > FIRST_TIME]])


def largest_distance(predicted: Traces, measured: Traces, key: str) -> Largest:
    """The largest distance of a quantity from 10 us on, at the times of ``measured``, which ``predicted`` shares.

    ValueError where the times differ.
    """
    if not np.array_equal(predicted.time, measured.time):
        raise ValueError("the two models' traces must be at the same times")
    late = from_first(measured.time)
    p, m = (np.interp(late, measured.time, traces.values[key]) for traces in (predicted, measured))
    off = p - m
    i = int(np.argmax(np.abs(off)))
    return Largest(float(off[i]), float(p[i]), float(m[i]), float(late[i]), _beyond(late, np.abs(off), i))


def _beyond(time: np.ndarray, off: np.ndarray, i: int) -> float:
    """How far a curve through points may rise above the largest of them between it and its neighbours: as far as the
    parabolas through the gap's two points and one beside them, between which the curve runs where its third derivative
    keeps its sign."""
    beyond = 0.0
    for a in (i - 1, i):
        for n in (a - 1, a + 2):
            if not (0 <= a < len(off) - 1 and 0 <= n < len(off)):
                continue
            wide, slope = time[a + 1] - time[a], (off[a + 1] - off[a]) / (time[a + 1] - time[a])
            rises = [(off[n] - off[m]) / (time[n] - time[m]) for m in (a, a + 1)]
            curvature = (rises[1] - rises[0]) / wide
            # The parabola's top, if it has one within the gap, measured from the gap's start.
            top = 0.0 if curvature >= 0 else min(max((wide - slope / curvature) / 2, 0.0), wide)
            beyond = max(beyond, float(off[a] + slope * top + curvature * top * (top - wide) - off[i]))
    return beyond


def over_time(
    models: Models, key: str, final: Estimate, title: str, relative_to: str,
    because: Callable[[Models, str, Largest, float], str],
) -> Comparison:  # fmt: skip
    """The largest distance of the traces of a quantity over a ``final`` value (with its error), which ``relative_to``
    names; ``because`` is asked why, given the quantity, the distance and the final value."""
    reduction, solution = models.traces()
    at = largest_distance(reduction, solution, key)
    distance = Estimate(at.distance, solution.errors[key] + reduction.errors[key] + at.beyond)
    room = 0.0 if key == "current_A" else models.sink.room_temperature
    return Comparison(
        title, at.predicted - room, at.measured - room, unit_of(key), part(at.distance, final.value),
        spread(part, {"distance": distance, "final": final}), lambda: because(models, key, at, final.value), at.time,
        relative_to=relative_to,
    )  # fmt: skip


def part(distance: float, final: float) -> float:
    return distance / abs(final) if final else float("inf")


@dataclass(frozen=True)
class Data:
    """Traces from a file: ``time`` (s, ascending) and ``values`` by the keys of traces.csv, in SI units.

    ``headers`` are the columns' own names, the time's among them, and ``how`` they were read where that is not plain,
    ``left_out`` says why the others are none, ``run`` which of several runs it is, ``notes`` what else was done,
    ``warnings`` what may be another scene's; ``others`` are the values (SI) of columns that were left out, ``u`` the
    standard uncertainties (times,) of the values, by the same keys, where they are known.
    """

    name: str
    kind: str
    time: np.ndarray
    values: dict[str, np.ndarray]
    headers: dict[str, str]
    how: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)
    run: str = ""
    warnings: tuple[str, ...] = ()
    others: Mapping[str, np.ndarray] = field(default_factory=dict)
    u: Mapping[str, np.ndarray] = field(default_factory=dict)

    def document(self) -> dict[str, Any]:
        return {
            "file": self.name, "kind": self.kind, "rows": len(self.time),
            "from_s": float(self.time[0]), "to_s": float(self.time[-1]), "run": self.run or None,
            "columns": self.headers, "read_as": dict(self.how), "left_out": dict(self.left_out),
            "notes": list(self.notes),
        }  # fmt: skip

    def said(self) -> str:
        """One sentence: which column is which quantity, of which run, and which are left out, and why."""
        names = {"time_s": "time", **_NAMES}
        how = {key: f" ({text})" for key, text in self.how.items()}
        parts = [", ".join(f"{names[k]} is {quoted(header)}{how.get(k, '')}" for k, header in self.headers.items())]
        parts += [self.run] if self.run else []
        parts += list(self.notes)
        left = [f"{quoted(name)}, it {why}" for name, why in list(self.left_out.items())[:6]]
        left += [f"{len(self.left_out) - 6} more"] if len(self.left_out) > 6 else []
        parts += [f"left out: {'; '.join(left)}"] if left else []
        first, last = (quantity(float(t), "s", 3) for t in (self.time[0], self.time[-1]))
        covered = f"{len(self.time)} rows, {first} to {last}"
        return f"{self.name} ({self.kind}, {covered}): {'; '.join(parts)}."


def definitions(data: Data, fem3d: Result) -> dict[str, Callable[[Models], Comparison]]:
    """What the checks of a file are made of, by their ids: one for every quantity of the data. The windows of noisy
    data are cut by the traces of ``fem3d``, and stay where they are for models that are moved."""

    def of(key: str) -> Callable[[Models], Comparison]:
        return lambda models: compare(models.sink, data, models.fem3d, key, fem3d)

    return {f"against_{key.rpartition('_')[0]}": of(key) for key in _NAMES if key in data.values}


def evaluate(sink: Sink, data: Data, fem3d: Result) -> tuple[Check, ...]:
    """A check for every quantity of the data, in the order of the declared tolerances."""
    models = Models(sink, fem3d, None)
    return tuple(judged(name, made(models), sink, always=True) for name, made in definitions(data, fem3d).items())


def compare(sink: Sink, data: Data, fem3d: Result, key: str, cutting: Result | None = None) -> Comparison:
    """The largest distance data - 3D from 10 us on, relative to the quantity's final rise, change or value.

    It is sought at the file's own times, where the 3D trace is known to its error; nothing is read into the data
    between them. By how much the distance may be larger between two rows is what the rows around them tell of it
    (`_beyond`). Of data with an uncertainty it is the largest mean over a window (`compare.windows`), cut by the traces
    of ``cutting``, if that is another result, and u_data says how far the largest may be from that.
    """
    traces, unit = fem3d.over_time, unit_of(key)
    both = (data.time >= traces.time[0]) & (data.time <= traces.time[-1] * (1 + 1e-9))
    late = data.time[both] >= FIRST_TIME
    if not late.any():
        covered = f"{quantity(float(data.time[0]), 's')} to {quantity(float(data.time[-1]), 's')}"
        raise SceneError(
            f"--against {quoted(data.name)} covers {covered}, the run 10 us to {quantity(sink.end_time, 's')}: there "
            "is no time to compare at"
        )
    time, theirs = data.time[both], data.values[key][both]
    ours = np.interp(time, traces.time, traces.values[key])
    error, u_data = traces.errors[key], None
    if key in data.u:
        time, theirs, ours, u = time[late], theirs[late], ours[late], data.u[key][both][late]
        by = (cutting or fem3d).over_time
        cuts = windows.cut(np.interp(time, by.time, by.values[key]))
        means = windows.windows(time, theirs - ours, u, cuts)
        i, k = windows.worst(means, [0.0] * len(means))
        u_data = (max(abs(w.distance) + k * w.u_data for w in means) - abs(means[i].distance)) / COVERS
        rows = cuts[i]
    else:
        off = np.abs(theirs - ours)
        i = int(np.argmax(np.where(late, off, -1.0)))
        error += _beyond(time, off, i)
        rows = slice(i, i + 1)
    (scale, of), room = _scale(fem3d, key), sink.room_temperature if unit == "K" else 0.0
    p, m, off_by = (float(v[rows].mean()) for v in (theirs - room, ours - room, theirs - ours))
    start, end = float(time[rows][0]), float(time[rows][-1])

    def because() -> str:
        when = f"at {quantity(end, 's', 3)}" if start == end else f"in the mean over {span(start, end)}"
        return (
            f"{data.name} is furthest from 3D {when}: {quantity(p, unit)} against {quantity(m, unit)}, "
            f"{signed(off_by, unit)} of a {of} of {quantity(scale, unit)}"
        )

    title, size = f"{_NAMES[key]}, {cut(data.name, 16, '...')}", abs(scale)
    known = None if u_data is None else u_data / size
    return Comparison(title, p, m, unit, off_by / size, error / size, because, (start + end) / 2, u_data=known)


def _scale(fem3d: Result, key: str) -> tuple[float, str]:
    of, value = _OF.get(key, "final rise"), fem3d.steady[OF_A_SINK[_NAMES[key]].steady].value
    if key == "current_A":
        change = value - float(fem3d.over_time.values[key][0])
        return (change, of) if change else (value, "final value")
    return value, of
