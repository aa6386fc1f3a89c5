"""Traces against traces: the largest distance over time, with what it is known to. Of the 1D model's from the 3D
model's, and of a user's own (`compare.data` reads them from files of other programs).

The largest distance of the two models is sought at the times of the 3D traces from 10 us on (and at 10 us itself). Its
error has four parts, added: that of the 3D trace, that of the 1D trace (rounding), that of the final change that it is
relative to, and what a maximum between two times may exceed the one found by.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from compare import quantities, windows
from compare.quantities import Quantities
from compare.verdict import COVERS, Check, Comparison, Models, judged, spread, unit_of
from scenes.checks import FIRST_TIME
from scenes.errors import SceneError, quoted
from scenes.formats import cut, quantity, signed, span
from scenes.result import Estimate, Result, Traces

_OF = {"current_A": "final change", "power_W": "final value"}
"""Differences of these traces are relative to what is named here; differences of temperatures to a rise."""


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
    return Largest(float(off[i]), float(p[i]), float(m[i]), float(late[i]), _overshoot(late, np.abs(off), i))


def _overshoot(time: np.ndarray, off: np.ndarray, i: int) -> float:
    """How far a curve may rise above the largest of its points between that and a neighbour: as the parabolas through
    the two and a third point, which enclose a curve whose third derivative keeps its sign."""
    overshoot = 0.0
    for a in (i - 1, i):
        for n in (a - 1, a + 2):
            if not (0 <= a < len(off) - 1 and 0 <= n < len(off)):
                continue
            wide, slope = time[a + 1] - time[a], (off[a + 1] - off[a]) / (time[a + 1] - time[a])
            rises = [(off[n] - off[m]) / (time[n] - time[m]) for m in (a, a + 1)]
            curvature = (rises[1] - rises[0]) / wide
            # The parabola's top, if it has one within the gap, measured from the gap's start.
            top = 0.0 if curvature >= 0 else min(max((wide - slope / curvature) / 2, 0.0), wide)
            overshoot = max(overshoot, float(off[a] + slope * top + curvature * top * (top - wide) - off[i]))
    return overshoot


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
    """Traces from a file: ``time`` (s, ascending) and ``values`` by their names, in SI units; or values of the steady
    state, at the one time `quantities.AT_REST`.

    ``headers`` are the columns' own names, the time's among them, and ``how`` they were read where that is not plain,
    ``left_out`` says why the others are none, ``run`` which of several runs it is, ``notes`` what else was done,
    ``warnings`` what may be another scene's; ``others`` are the values (SI) of columns that were left out, ``u`` the
    standard uncertainties (times,) of the values, by the same names, where they are known; ``words`` what a user calls
    a quantity, where that is not its name. Of a ``curve`` the rows are steady states at values (SI) of a key.
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
    words: Mapping[str, str] = field(default_factory=dict)
    curve: tuple[str, np.ndarray] | None = None

    @property
    def at_rest(self) -> bool:
        """Whether the data are of the steady state."""
        return bool(np.isinf(self.time[-1]))

    def document(self) -> dict[str, Any]:
        return {
            "file": self.name, "kind": self.kind, "rows": len(self.time),
            "from_s": float(self.time[0]), "to_s": float(self.time[-1]), "run": self.run or None,
            "columns": self.headers, "read_as": dict(self.how), "left_out": dict(self.left_out),
            "notes": list(self.notes),
        }  # fmt: skip

    def said(self) -> str:
        """One sentence: which column is which quantity, of which run, and which are left out, and why."""
        names = {"time_s": "time", **self.words}
        how = {key: f" ({text})" for key, text in self.how.items()}
        headers = {k: quoted(header) for k, header in self.headers.items()}
        text = (
            f"{names.get(k, k)}{'' if quoted(k) == headers[k] else f' is {headers[k]}'}{how.get(k, '')}"
            for k in headers
        )
        parts = [", ".join(text)]
        parts += [self.run] if self.run else []
        parts += list(self.notes)
        omitted = [f"{quoted(name)}, it {why}" for name, why in list(self.left_out.items())[:6]]
        omitted += [f"{len(self.left_out) - 6} more"] if len(self.left_out) > 6 else []
        parts += [f"left out: {'; '.join(omitted)}"] if omitted else []
        covered = "the steady state" if self.curve is None else f"{len(self.time)} steady states"
        if not self.at_rest:
            first, last = (quantity(float(t), "s", 3) for t in (self.time[0], self.time[-1]))
            covered = f"{len(self.time)} rows, {first} to {last}"
        return f"{self.name} ({self.kind}, {covered}): {'; '.join(parts)}."


def checked(scene: Any, data: Data) -> dict[str, str]:
    """The quantities of the data by the ids of their checks, in the order of the scene's."""
    return {f"against_{word}": name for word, name in quantities.of(scene).names.items() if name in data.values}


def evaluate(scene: Any, data: Data, fem3d: Result) -> tuple[Check, ...]:
    """A check for every quantity of the data, in the order of the scene's."""
    if data.curve is not None:
        return _evaluate_curve(scene, data)
    return tuple(
        judged(check, compare(scene, data, fem3d, name), scene, always=True)
        for check, name in checked(scene, data).items()
    )


def _evaluate_curve(scene: Any, data: Data) -> tuple[Check, ...]:
    """The checks of a curve: the largest distance of its rows, each solved, over the largest rise or value on it."""
    from fem3d.runs import scene as scene_run
    from scenes.varied import kind_of, numbers, varied

    assert data.curve is not None
    key, abscissas = data.curve
    now, dimension = numbers(scene).get(key), kind_of(scene, key).dimension
    if now is None:
        raise SceneError(f"--against {quoted(data.name)}: {key} is 0 in the scene: give it another value for a curve")
    results = [scene_run.solve(varied(scene, key, float(value) / now)) for value in abscissas]
    catalogue, checks = quantities.of(scene), []
    for check, name in checked(scene, data).items():
        unit, base = catalogue.units[name], catalogue.base(name)
        models = np.array([result.steady[name].value for result in results])
        off = data.values[name] - models
        i, size = int(np.argmax(np.abs(off))), float(np.abs(models - base).max())
        where = f"{key} = {dimension.show(float(f'{abscissas[i]:.6g}'))}"

        title = f"{cut(catalogue.word(name), 24)}, {cut(data.name, 16, '...')}"
        error = part(results[i].steady[name].error, size)
        p, m = float(data.values[name][i]) - base, float(models[i]) - base
        said = f"{data.name} is furthest from 3D at {where}: {quantity(p, unit)} against {quantity(m, unit)}"
        comparison = Comparison(title, p, m, unit, part(p - m, size), error, partial(str, said))
        checks.append(judged(check, comparison, scene, always=True))
    return tuple(checks)


def simulated(result: Result, name: str, times: np.ndarray) -> np.ndarray:
    """(times,): a quantity of a model at the times (s) of data; its steady value where those are at rest."""
    if np.isinf(times[-1]):
        return np.array([result.steady[name].value])
    return np.interp(times, result.over_time.time, result.over_time.values[name])


def known_to(result: Result, name: str, times: np.ndarray) -> float:
    """The error of that."""
    return result.steady[name].error if np.isinf(times[-1]) else result.over_time.errors[name]


@dataclass(frozen=True)
class Place:
    """Where data are furthest from 3D: at which ``rows``, the ``error`` of 3D there and, for data with an uncertainty,
    how far the largest distance may be from the one there (``u_data``), in the quantity's unit."""

    rows: np.ndarray
    error: float
    u_data: float | None


def furthest(scene: Any, data: Data, fem3d: Result, key: str) -> Place:
    """Where a quantity of the data is furthest from 3D, where 3D's error holds.

    It is sought at the file's own times, where the 3D trace is known to its error; nothing is read into the data
    between them. By how much the distance may be larger between two rows is what the rows around them tell of it
    (`_overshoot`). Of data with an uncertainty it is the largest mean over a window (`compare.windows`).
    """
    catalogue = quantities.of(scene, fem3d)
    sure = np.flatnonzero(catalogue.sure(data.time))
    if not len(sure):
        covered = f"{quantity(float(data.time[0]), 's')} to {quantity(float(data.time[-1]), 's')}"
        raise SceneError(
            f"--against {quoted(data.name)} covers {covered}, the run {quantity(catalogue.since, 's')} to "
            f"{quantity(catalogue.end, 's')}: there is no time to compare at"
        )
    error = known_to(fem3d, key, data.time)
    if key in data.u:
        time, ours = data.time[sure], simulated(fem3d, key, data.time[sure])
        cuts = windows.cut(ours)
        means = windows.windows(time, data.values[key][sure] - ours, data.u[key][sure], cuts)
        i, k = windows.worst(means, [0.0] * len(means))
        u_data = (max(abs(w.distance) + k * w.u_data for w in means) - abs(means[i].distance)) / COVERS
        return Place(sure[cuts[i]], error, u_data)
    if data.at_rest:
        return Place(sure, error, None)
    inside = data.time <= catalogue.end * (1 + 1e-9)
    off = np.abs(data.values[key] - simulated(fem3d, key, data.time))[inside]
    i = int(sure[np.argmax(off[sure])])
    return Place(np.array([i]), error + _overshoot(data.time[inside], off, i), None)


def distance(scene: Any, data: Data, fem3d: Result, key: str, rows: np.ndarray) -> tuple[float, float, str]:
    """The mean of data - 3D over some rows, what it is relative to, and what that is called (`_scale`)."""
    off = data.values[key][rows] - simulated(fem3d, key, data.time[rows])
    return float(off.mean()), *_scale(quantities.of(scene, fem3d), fem3d, key, data.at_rest)


def compare(scene: Any, data: Data, fem3d: Result, key: str) -> Comparison:
    """The largest distance data - 3D (`furthest`) over the quantity's final rise, change or value, or its largest."""
    catalogue, place = quantities.of(scene, fem3d), furthest(scene, data, fem3d, key)
    rows, unit, base = place.rows, catalogue.units[key], catalogue.base(key)
    off_by, scale, relative_to = distance(scene, data, fem3d, key, rows)
    p = float(data.values[key][rows].mean()) - base
    start, end = float(data.time[rows[0]]), float(data.time[rows[-1]])

    def because() -> str:
        when = f"in the mean over {span(start, end)}" if start < end else moment(end)
        return (
            f"{data.name} is furthest from 3D {when}: {quantity(p, unit)} against {quantity(p - off_by, unit)}, "
            f"{signed(off_by, unit)} of a {relative_to} of {quantity(scale, unit)}"
        )

    title, size = f"{cut(catalogue.word(key), 24)}, {cut(data.name, 16, '...')}", abs(scale)
    u_data = None if place.u_data is None else part(place.u_data, size)
    return Comparison(
        title, p, p - off_by, unit, part(off_by, size), part(place.error, size), because,
        None if data.at_rest else (start + end) / 2, u_data=u_data,
    )  # fmt: skip


def moment(time: float) -> str:
    """A time (s) in words; after all time is the steady state."""
    return f"at {quantity(time, 's', 3)}" if np.isfinite(time) else "in the steady state"


def _scale(catalogue: Quantities, fem3d: Result, key: str, at_rest: bool) -> tuple[float, str]:
    """What a difference is relative to, and what that is called."""
    kind = "rise" if catalogue.units[key] == "K" else "value"
    if at_rest:
        return fem3d.steady[key].value - catalogue.base(key), f"steady {kind}"
    traces = fem3d.over_time
    if key not in catalogue.final:
        course = (traces.values[key] - catalogue.base(key))[catalogue.sure(traces.time)]
        return float(course[np.abs(course).argmax()]), f"largest {kind}"
    value, called = fem3d.steady[catalogue.final[key]].value, _OF.get(key, "final rise")
    if key == "current_A":
        change = value - float(traces.values[key][0])
        return (change, called) if change else (value, "final value")
    return value, called
