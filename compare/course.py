"""Courses of a quantity over time: the distance of two, in size, time and shape, and means of noisy data.

With y the 3D course and m the model's, a y((t - shift)/stretch) is fitted to m by least squares: first with a size a
alone, then with a stretch or a shift as well, whichever is nearer. A stretch c < 1 is a time constant that is short by
1 - c.

Of n independent noisy distances the largest is near u sqrt(2 ln n) by chance. A noisy trace is therefore cut into a few
windows, and the mean over each is stated. The part of u that scatters from row to row falls with the root of the number
of rows; the part that all rows share, such as an offset of a thermometer, does not fall. The scatter is estimated from
second differences of the data at distances of 1, 2, 4 ... rows (von Neumann, Ann. Math. Stat. 12, 1941); the remainder
of u is shared.

The interval of one window is its mean -+ 2 u (95 %). The worst of several windows needs intervals that hold at once:
the factor is 2 where they share all of u, and grows to Sidak's (J. Am. Stat. Assoc. 62, 1967) where they share nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.verdict import COVERS, Check, share
from scenes.formats import percent, quantity, signed
from scenes.result import Estimate, Traces

MOST = 10.0
"""The largest factor that stretches time."""
POINTS = 400
"""Number of times at which two courses are fitted to each other; more cost time and change nothing."""
NOTABLE = 0.5
"""A change of size or time is stated only where it leaves less than this part of the distance."""
LEAST = 0.005
"""Changes of size and of time smaller than this are none."""
JUMP = 2e-9
"""Rows closer in time than this part of the run are the values just before and just after a jump."""
MOST_WINDOWS = 16
"""The most windows of a trace: each stays a small part of the rise, and the worst one's factor below 3."""
_LESS, _MORE = 0.2, 0.05
"""A scatter from row to row that is as small, or as large, in so many cases by chance is not taken for that of u. Small
ones are doubted sooner: to take what rows share for scatter makes an interval too narrow, the reverse too wide. With
0.1 intervals of 60 rows that share a quarter of the variance hold in 87 %, with 0.2 in 90 %, with 0.3 in 92 %, those
of noise that only scatters in 96.7, 96.9 and 97.1 % (`pytest -m long tests/compare/data/test_against.py`)."""
_ROWS = 1.25
"""Rows per independent value of noise that is independent at a distance of h rows but not yet of h/2: 1.25 h. Where
correlations fall exponentially, the sum over all distances is then within 5 % of the variance of a mean."""
_PER_DEGREE = 35 / 18
"""Second differences that tell as much of the scatter as one independent number, as they share rows: the sum of the
squares of their correlations, 1 + 2 (2/3)^2 + 2 (1/6)^2."""
_SHARED = np.linspace(0, 6, 121)
"""Values (standard deviations) of the shared error at which an integral over it, of an even function, is summed."""
_LEAST = 0.05
"""The smallest scatter, as a part of u, in the integral: below it nothing changes, and the sum would not resolve it."""


@dataclass(frozen=True)
class Course:
    """Both courses (times,) above the base of their scale, and the interpolation error of their distance."""

    time: np.ndarray
    fem3d: np.ndarray
    model: np.ndarray
    beyond: np.ndarray

    @property
    def off(self) -> np.ndarray:
        """The model less 3D (times,)."""
        return self.model - self.fem3d

    @property
    def worst(self) -> int:
        """The row of the largest distance."""
        return int(np.argmax(np.abs(self.off)))

    def comparison(self, title: str, unit: str, error: float, scale: Estimate, relative_to: str, note: str) -> Check:
        """Compare at the largest distance, relative to a scale; ``error`` bounds that of both courses."""
        i = self.worst
        p, m, off, time = (float(each[i]) for each in (self.model, self.fem3d, self.off, self.time))
        part = share(Estimate(off, error + float(self.beyond[i])), scale)
        reason = f"{quantity(p, unit)} against {quantity(m, unit)} in 3D at {quantity(time, 's', 3)}, "
        reason += signed(off, unit) + f"; {note}" * bool(note)
        return Check(title, p, m, unit, part.value, part.error, reason, time, relative_to=relative_to)

    def change(self, scale: float) -> str:
        """Return "its time constant is 22 % short; stretched by that it is within 1.5 %"; empty where no change helps.

        Distances are relative to a ``scale``.
        """
        time, y, m = self.time, self.fem3d, self.model
        if len(time) < 5 or not scale or np.ptp(y) < LEAST * scale or np.ptp(m) < LEAST * scale:
            return ""
        size, stretch, shift = _fit(time, y, m)
        alone = float(y @ m / max(y @ y, 1e-300))
        distances = (m - y, m - alone * y, m - size * np.interp((time - shift) / stretch, time, y))
        whole, sized, shape = (float(np.abs(each).max()) / scale for each in distances)
        by_size = f"{percent(abs(size - 1))} {'high' if size > 1 else 'low'} throughout" * (abs(size - 1) > LEAST)
        if shape <= NOTABLE * sized and (abs(stretch - 1) >= LEAST or shift):
            said = f"its time constant is {percent(abs(stretch - 1))} {'short' if stretch < 1 else 'long'}"
            if shift:
                said = f"it is {quantity(abs(shift), 's', 2)} {'late' if shift > 0 else 'early'}"
            undone = "shifted" if shift else "stretched"
            return f"{said}{f' and it is {by_size}' * bool(by_size)}; {undone} by that it is within {percent(shape)}"
        if by_size and sized < NOTABLE * whole:
            return f"it is {by_size}, and apart from that within {percent(sized)}"
        return ""


def _fit(time: np.ndarray, y: np.ndarray, m: np.ndarray) -> tuple[float, float, float]:
    """The size, with the stretch or the shift (s) that leaves the smaller distance."""
    from scipy.optimize import brute

    # Evenly over the model's progress, in time and in value, so that neither a long rest nor a short rise decides.
    progress = np.cumsum(np.abs(np.diff(m, prepend=m[0]))) / max(float(np.abs(np.diff(m)).sum()), 1e-300)
    progress = progress + (time - time[0]) / (time[-1] - time[0])
    places = np.interp(np.linspace(0, progress[-1], POINTS), progress, time)
    sampled = np.interp(places, time, m)

    def size_and_misfit(stretch: float, shift: float) -> tuple[float, float]:
        changed = np.interp((places - shift) / stretch, time, y)
        size = float(changed @ sampled / max(float(changed @ changed), 1e-300))
        return size, float(np.mean((sampled - size * changed) ** 2))

    fits, half = [], float(np.ptp(time)) / 2
    for change, most in ((lambda x: (float(np.exp(x)), 0.0), np.log(MOST)), (lambda x: (1.0, float(x) * half), 1.0)):
        best = brute(lambda x, change=change: size_and_misfit(*change(x.item()))[1], [(-most, most)], Ns=41)
        stretch, shift = change(best.item())
        size, _ = size_and_misfit(stretch, shift)
        left = float(np.abs(m - size * np.interp((time - shift) / stretch, time, y)).max())
        fits.append((left, size, stretch, shift))
    return min(fits)[1:]


def overshoot(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return (n,): how far a curve may exceed each of its points before the next one; zero of fewer than 3 points."""
    if len(time) < 3:
        return np.zeros(len(time))
    error = np.pad(bends(time, values), 1)
    return np.maximum(error[:-1], error[1:])


def at(traces: Traces, name: str, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a trace at ascending times (s), and its interpolation error there.

    Where a trace jumps it has two values at one time: the first of two equal times gets the first value, a single one
    the later.
    """
    values = traces.values[name]
    n = np.clip(np.searchsorted(traces.time, times, side="right") - 1, 0, len(traces.time) - 2)
    interpolated, on_a_row = np.interp(times, traces.time, values), np.isin(times, traces.time)
    first = np.flatnonzero(np.diff(times) == 0)
    interpolated[first] = values[np.searchsorted(traces.time, times[first])]
    return interpolated, np.where(on_a_row, 0.0, bends(traces.time, values)[n])


def bends(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return (n - 1,): the error of straight lines between rows, h^2/8 |y''|; zero where a trace jumps.

    The larger second difference of both ends of the interval counts.
    """
    h = np.diff(time)
    if len(h) < 2:
        return np.abs(np.diff(values))
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.where(h > JUMP * (time[-1] - time[0]), np.diff(values) / h, np.nan)
        second = np.abs(2 * np.diff(slopes) / (h[1:] + h[:-1]))
    second = np.nan_to_num(second, nan=0.0, posinf=0.0)
    larger = np.maximum(np.append(second, second[-1]), np.append(second[0], second))
    return h**2 / 8 * larger


@dataclass(frozen=True)
class Window:
    """Rows of a trace: their mean ``distance`` from the data, and its standard uncertainties.

    ``share`` is due to errors that all rows share, ``scatter`` to the rest.
    """

    rows: slice
    distance: float
    share: float
    scatter: float

    @property
    def u_data(self) -> float:
        """The standard uncertainty of the mean due to the data."""
        return float(np.hypot(self.share, self.scatter))


def windows(time: np.ndarray, distance: np.ndarray, u: np.ndarray, course: np.ndarray) -> tuple[Window, ...]:
    """Return at most 16 windows of a trace: each has an equal part of the rows and of the change of a course.

    Parameters
    ----------
    time : (n,) s
    distance : (n,) distance from the data
    u : (n,) standard uncertainties of the data, zero for exact data
    course : (n,) whose changes set the bounds of windows
    """
    change = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(course)))])
    share = np.arange(len(course)) / len(course)
    if change[-1] > 0:
        share = (share + change / change[-1]) / 2
    starts = np.unique(np.floor(share * MOST_WINDOWS).clip(max=MOST_WINDOWS - 1), return_index=True)[1].tolist()
    parts, alike = _parts(time, distance, u)
    means = []
    for rows in map(slice, starts, [*starts[1:], len(course)]):
        count, square = len(u[rows]), float((u[rows] ** 2).mean())
        scatter = np.sqrt(square * (parts @ np.minimum(alike / count, 1.0)))
        shared = np.sqrt(max(1 - parts.sum(), 0.0)) * u[rows].mean()
        means.append(Window(rows, float(distance[rows].mean()), float(shared), float(scatter)))
    return tuple(means)


def factor(means: Sequence[Window], u: Sequence[float]) -> float:
    """Return the number of standard uncertainties that make intervals hold at once in 95 % of cases.

    ``u`` are uncertainties of other causes, one for each window, which the windows share.
    """
    from scipy.optimize import brentq
    from scipy.special import ndtr, ndtri

    shared, scatter = np.hypot([w.share for w in means], u), np.array([w.scatter for w in means])
    total = np.hypot(shared, scatter)
    if not (total > 0).any():
        return COVERS
    shared, scatter = (part[total > 0, None] / total[total > 0, None] for part in (shared, scatter))
    scatter, off = scatter.clip(min=_LEAST), shared * _SHARED
    weights = np.exp(-(_SHARED**2) / 2)
    weights[0] /= 2

    def held(k: float) -> float:
        inside = ndtr((k - off) / scatter) - ndtr((-k - off) / scatter)
        return float(inside.prod(axis=0) @ weights / weights.sum())

    wanted = 2 * ndtr(COVERS) - 1
    most = float(ndtri((1 + wanted ** (1 / len(means))) / 2))
    if held(COVERS) >= wanted or held(most) <= wanted:
        return COVERS if held(COVERS) >= wanted else most
    return float(brentq(lambda k: held(k) - wanted, COVERS, most, xtol=1e-3))


def worst(means: Sequence[Window], u: Sequence[float]) -> tuple[int, float]:
    """Return the window that is surely furthest from zero, and the factor of its interval."""
    others = np.nan_to_num(np.array(u))
    k = factor(means, others.tolist())
    near = [abs(w.distance) - k * np.hypot(w.u_data, other) for w, other in zip(means, others, strict=True)]
    return int(np.argmax(near)), k


def _parts(time: np.ndarray, distance: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The parts of u^2 that scatter at distances of 1, 2, 4 ... rows, and the rows per independent value of each."""
    from scipy.optimize import isotonic_regression
    from scipy.special import gammaincinv

    if len(time) < 3 or not (u > 0).all():
        return np.ones(1), np.ones(1)
    steps = 2 ** np.arange(max(int(np.log2(len(time) / 4)), 0) + 1)
    scatter = np.array([_scatter(time, distance / u, int(step)) for step in steps])
    # Quantiles of a mean square of normal numbers, chi-squared over its degrees of freedom.
    half = (len(time) - 2) / _PER_DEGREE / 2
    low, high = (gammaincinv(half, p) / half for p in (_LESS, 1 - _MORE))
    if scatter[0] > high:
        return scatter[:1], np.ones(1)
    if scatter[0] >= low:
        return np.ones(1), np.ones(1)
    known = np.minimum(isotonic_regression(scatter, weights=len(time) - 2 * steps).x, 1.0)
    return np.diff(known, prepend=0.0), np.where(steps > 1, _ROWS * steps, 1.0)


def _scatter(time: np.ndarray, r: np.ndarray, step: int) -> float:
    """The part of the variance of r (times,), at some times (s), that scatters at a distance of so many rows."""
    first, middle, last = (slice(n * step, len(r) - (2 - n) * step) for n in range(3))
    before = (time[last] - time[middle]) / (time[last] - time[first])
    off = r[middle] - before * r[first] - (1 - before) * r[last]
    return float(np.mean(off**2 / (1 + before**2 + (1 - before) ** 2)))
