"""A user's own data against 3D: steady values, or traces at their largest distance (`compare.data` reads files)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from compare import course as courses
from compare import quantities
from compare.verdict import COVERS, Check, part
from scenes.errors import SceneError, quoted
from scenes.formats import cut, quantity, signed, span
from scenes.result import Result


@dataclass(frozen=True)
class Data:
    """Traces from a file, or values of the steady state.

    Attributes
    ----------
    name : of the file
    time : (n,) s, ascending; `quantities.AT_REST` for the steady state
    values, u : (n,) by quantity, SI units, and their standard uncertainties where they are given
    report, said : how the file was read, as summary.json has it, and in a sentence
    warnings : signs of another scene
    others : columns of the file that are no quantity, by name
    curve : of a curve of steady states the value in words and the scene of each row
    """

    name: str
    time: np.ndarray
    values: Mapping[str, np.ndarray]
    report: Mapping[str, Any] = field(default_factory=dict)
    said: str = ""
    warnings: tuple[str, ...] = ()
    others: Mapping[str, Any] = field(default_factory=dict)
    u: Mapping[str, np.ndarray] = field(default_factory=dict)
    curve: Sequence[tuple[str, Any]] = ()

    @property
    def at_rest(self) -> bool:
        """Whether the data are of the steady state."""
        return bool(np.isinf(self.time[-1]))


def comparisons(scene: Any, data: Data, fem3d: Result, like: Result | None = None) -> dict[str, Check]:
    """Compare every quantity of the data, by the ids of checks, as `compare` does; each row of a curve has its own 3D
    solution."""
    from fem3d.runs import scene as scene_run

    results = [scene_run.solve(row) for _, row in data.curve] or [fem3d]
    names = quantities.of(scene).names.items()
    return {f"against_{word}": compare(scene, data, results, name, like) for word, name in names if name in data.values}


def simulated(results: Sequence[Result], name: str, times: np.ndarray) -> tuple[np.ndarray, float]:
    """Return (times,) values of a model at times (s), and their error bound; at rest one of each result."""
    if np.isinf(times[-1]):
        found = [result.steady[name] for result in results]
        return np.array([each.value for each in found]), max(each.error for each in found)
    traces = results[0].over_time
    return np.interp(times, traces.time, traces.values[name]), traces.errors[name]


def compare(scene: Any, data: Data, results: Sequence[Result], key: str, like: Result | None = None) -> Check:
    """Compare a quantity with 3D at times at which 3D's errors hold, where the data are furthest from it, or from a
    result ``like`` it.

    Exact data are compared at their row with the largest distance; the error adds how far the distance may be larger
    between rows (`compare.course.overshoot`). Data with an uncertainty are compared over the window with the largest
    mean distance; u_data covers how far the largest distance may exceed that mean. The scale is the quantity's final
    rise, change or value, or its largest one.
    """
    fem3d, u = results[0], None
    catalogue = quantities.of(scene, fem3d)
    sure = np.flatnonzero(catalogue.sure(data.time))
    if not len(sure):
        covered = f"{quantity(float(data.time[0]), 's')} to {quantity(float(data.time[-1]), 's')}"
        raise SceneError(
            f"--against {quoted(data.name)} covers {covered}, the run {quantity(catalogue.first, 's')} to "
            f"{quantity(catalogue.end, 's')}: there is no time to compare at"
        )
    ours, error = simulated(results, key, data.time)
    distance = data.values[key] - (ours if like is None else simulated([like], key, data.time)[0])
    rows = sure[[np.abs(distance[sure]).argmax()]]
    if key in data.u:
        means = courses.windows(data.time[sure], distance[sure], data.u[key][sure], ours[sure])
        i, k = courses.worst(means, [0.0] * len(means))
        most = max(abs(w.distance) + k * w.u_data for w in means)
        rows, u = sure[means[i].rows], (most - abs(means[i].distance)) / COVERS
    elif not data.at_rest:
        inside = data.time <= catalogue.end * (1 + 1e-9)
        error += float(courses.overshoot(data.time[inside], np.abs(distance[inside]))[rows[0]])
    unit, base, start, end = catalogue.units[key], catalogue.base(key), data.time[rows[0]], data.time[rows[-1]]
    p, off = float(data.values[key][rows].mean()) - base, float((data.values[key] - ours)[rows].mean())
    when = f"at {quantity(float(end), 's', 3)}"
    if data.at_rest:
        when = f"at {data.curve[rows[0]][0]}" if data.curve else "in the steady state"
    elif start < end:
        when = f"in the mean over {span(float(start), float(end))}"
    called = f"{'steady' if data.at_rest else 'largest'} {catalogue.whole(key)}"
    if key in catalogue.final and not data.at_rest:
        scale, called = fem3d.steady[catalogue.final[key]].value, f"final {catalogue.whole(key)}"
        first = float(fem3d.over_time.values[key][0])
        if key == "current_A" and scale != first:
            scale, called = scale - first, "final change"
    else:
        scale = float(max(ours - base, key=abs)) if data.at_rest else catalogue.largest(key)
    said = (
        f"{data.name} is furthest from 3D {when}: {quantity(p, unit)} against {quantity(p - off, unit)}, "
        f"{signed(off, unit)} of a {called} of {quantity(scale, unit)}"
    )
    size, title = abs(scale), f"{cut(catalogue.word(key), 24)}, {cut(data.name, 16, '...')}"
    return Check(
        title, p, p - off, unit, part(off, size), part(error, size), said,
        None if data.at_rest else float(start + end) / 2, u_data=None if u is None else part(u, size),
    )  # fmt: skip
