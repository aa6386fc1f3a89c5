"""Courses of a quantity over time: the distance of two, in size, time and shape, and means of noisy data.

With y the 3D course and m the model's, the size a and the shift s of a y(t - s) are fitted to m by least squares.

Of n independent noisy distances the largest is near u sqrt(2 ln n) by chance. A noisy trace is therefore cut into a few
windows, and the mean over each is stated. The part of u^2 that scatters from row to row falls with the number of rows;
second differences of neighbouring rows estimate it (von Neumann, Ann. Math. Stat. 12, 1941). The remainder, such as an
offset of a thermometer, may be shared by all rows and does not fall.

The interval of one window is its mean -+ 2 u (95 %). The intervals of several windows must hold at once: the factor is
then k by Sidak (J. Am. Stat. Assoc. 62, 1967) in place of 2.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from compare.verdict import COVERS, Check, share
from scenes.formats import percent, quantity, signed
from scenes.result import Estimate, Traces


def compare_courses(
    title: str, unit: str, one: tuple[Traces, str], three: tuple[Traces, str], times: np.ndarray, scale: Estimate,
    relative_to: str, base: float = 0.0, sure: np.ndarray | slice = slice(None), error: float = 0.0,
    own: bool = False, note: str = "",
) -> Check:  # fmt: skip
    """Compare a trace of a model with a trace of 3D, each with its name, where they are furthest apart.

    Values count from a ``base``. The distance is that at the ``sure`` ones of some times (s), relative to a scale. To
    the errors of both traces an ``error`` is added, and how far the distance may be larger between times. The user's
    ``own`` model may have kinks, where 3D is straight; it is described by size, shift and shape.
    """
    y, m = (np.interp(times, ascending(traces.time), traces.values[name]) - base for traces, name in (three, one))
    beyond = overshoot(times, m if own else np.abs(m - y), own)
    time, y, m, beyond = (each[sure] for each in (times, y, m, beyond))
    i = int(np.argmax(np.abs(m - y)))
    p, found, off, when = (float(each[i]) for each in (m, y, m - y, time))
    error += sum(traces.errors[name] for traces, name in (one, three))
    error += float((np.abs(m - y) + beyond).max()) - abs(off)  # at this row, or where another may exceed it
    note = _describe(time, y, m, abs(scale.value)) if own else note
    part = share(Estimate(off, error), scale)
    reason = f"{quantity(p, unit)} against {quantity(found, unit)} in 3D at {quantity(when, 's', 3)}, "
    reason += signed(off, unit) + f"; {note}" * bool(note)
    return Check(title, p, found, unit, part.value, part.error, reason, when, relative_to=relative_to)


def _describe(time: np.ndarray, y: np.ndarray, m: np.ndarray, scale: float) -> str:
    """Return "it is 38 us late; shifted by that it is within 1.5 %" of a model m; empty where no change helps.

    Distances are relative to a ``scale``. A change is stated where it leaves less than half of the distance.
    """
    least = 0.005  # Smaller changes of size are none.
    if len(time) < 5 or not scale or min(np.ptp(y), np.ptp(m)) < least * scale:
        return ""
    size, shift = _fit(time, y, m)
    distances = m - y, m - _size(y, m) * y, m - size * np.interp(time - shift, time, y)
    whole, sized, shape = (float(np.abs(each).max()) / scale for each in distances)
    by_size = f"it is {percent(abs(size - 1))} {'high' if size > 1 else 'low'} throughout" * (abs(size - 1) > least)
    if shift and shape <= sized / 2:
        by_time = f"it is {quantity(abs(shift), 's', 2)} {'late' if shift > 0 else 'early'}"
        return f"{' and '.join(filter(None, (by_time, by_size)))}; shifted by that it is within {percent(shape)}"
    return f"{by_size}, and apart from that within {percent(sized)}" if by_size and sized < whole / 2 else ""


def _size(y: np.ndarray, m: np.ndarray) -> float:
    """The size of a course by which it is nearest to another."""
    return float(y @ m / max(y @ y, 1e-300))


def _fit(time: np.ndarray, y: np.ndarray, m: np.ndarray) -> tuple[float, float]:
    """The size and the shift (s) with the smallest distance."""
    from scipy.optimize import brute

    # Evenly over the model's progress, in time and in value, so that neither a long rest nor a short rise decides.
    progress = np.cumsum(np.abs(np.diff(m, prepend=m[0]))) / np.abs(np.diff(m)).sum()
    progress += (time - time[0]) / (time[-1] - time[0])
    places = np.interp(np.linspace(0, progress[-1], 400), progress, time)
    sampled, half = np.interp(places, time, m), float(np.ptp(time)) / 2

    def off(part: np.ndarray) -> float:
        changed = np.interp(places - part.item() * half, time, y)
        return float(np.mean((sampled - _size(changed, sampled) * changed) ** 2))

    shift = half * brute(off, [(-1.0, 1.0)], Ns=41).item()
    return _size(np.interp(places - shift, time, y), sampled), shift


def overshoot(time: np.ndarray, values: np.ndarray, kinks: bool = False) -> np.ndarray:
    """Return (n,): how far a curve may exceed each of its 3 or more points before the next one."""
    error = np.pad(bends(time, values, kinks), 1)
    return np.maximum(error[:-1], error[1:])


def ascending(time: np.ndarray) -> np.ndarray:
    """Return times of which the first of two equal ones, between which something jumps, is a hair earlier."""
    return np.where(np.append(np.diff(time) <= 0, False), np.nextafter(time, -np.inf), time)


def bends(time: np.ndarray, values: np.ndarray, kinks: bool = False) -> np.ndarray:
    """Return (n - 1,): the error of straight lines between rows, h^2/8 |y''|; zero where a trace jumps.

    The larger second difference of both ends of the interval counts. With a kink in an interval the error is at most
    h/2 times the larger change of the slope.
    """
    h, jump = np.diff(time), 2e-9 * (time[-1] - time[0])  # the values just before and just after a jump
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.where(h > jump, np.diff(values) / h, np.nan)
        second = np.abs(np.diff(slopes) / (1 if kinks else (h[1:] + h[:-1]) / 2))
    second = np.nan_to_num(second, nan=0.0, posinf=0.0)
    larger = np.maximum(np.append(second, second[-1]), np.append(second[0], second))
    return (h / 2 if kinks else h**2 / 8) * larger


class Window(NamedTuple):
    """Rows of a trace, their mean distance from the data, and its standard uncertainty due to the data."""

    rows: slice
    distance: float
    u_data: float


def windows(time: np.ndarray, distance: np.ndarray, u: np.ndarray, course: np.ndarray) -> list[Window]:
    """Return at most 16 windows of a trace: each has an equal part of the rows and of the change of a course.

    Parameters
    ----------
    time : (n,) s
    distance : (n,) distance from the data
    u : (n,) standard uncertainties of the data, zero for exact data
    course : (n,) whose changes set the bounds of windows
    """
    most = 16  # Each window stays a small part of the rise, and the worst one's factor near 3.
    change = np.cumsum(np.abs(np.diff(course, prepend=course[0])))
    part = np.arange(len(course)) / len(course)
    if change[-1] > 0:
        part = (part + change / change[-1]) / 2
    starts = np.unique(np.floor(part * most).clip(max=most - 1), return_index=True)[1].tolist()
    scatter, means = _scatter(time, distance, u), []
    for rows in map(slice, starts, [*starts[1:], len(course)]):
        u_mean = np.sqrt((scatter / len(u[rows]) + max(1 - scatter, 0.0)) * (u[rows] ** 2).mean())
        means.append(Window(rows, float(distance[rows].mean()), float(u_mean)))
    return means


def worst(means: Sequence[Window], u: Sequence[float]) -> tuple[int, float]:
    """Return the window that is surely furthest from zero, and the number of standard uncertainties of its interval.

    ``u`` are uncertainties of other causes, one for each window.
    """
    from scipy.special import ndtr, ndtri

    factor = float(ndtri((1 + (2 * ndtr(COVERS) - 1) ** (1 / len(means))) / 2))
    half = factor * np.hypot([w.u_data for w in means], np.nan_to_num(u))
    return int(np.argmax(np.abs([w.distance for w in means]) - half)), factor


def _scatter(time: np.ndarray, distance: np.ndarray, u: np.ndarray) -> float:
    """The part of u^2 that scatters from row to row, over 1 where distances do so more; 1 of few rows."""
    if len(time) < 3 or not (u > 0).all():
        return 1.0
    r, before = distance / u, (time[2:] - time[1:-1]) / (time[2:] - time[:-2])
    off = r[1:-1] - before * r[:-2] - (1 - before) * r[2:]
    return float(np.mean(off**2 / (1 + before**2 + (1 - before) ** 2)))
