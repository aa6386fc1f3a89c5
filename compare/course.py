"""Two courses of a quantity over time: their largest distance, and that distance in size, time and shape.

With y the 3D course and m the model's, a y((t - shift)/stretch) is fitted to m by least squares: first with a size a
alone, then with a stretch or a shift as well, whichever is nearer. A stretch c < 1 is a time constant that is short by
1 - c.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compare.verdict import Comparison, share
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
NO_CHANGE = "its shape is another: no change of size or of time brings it nearer"
JUMP = 2e-9
"""Rows closer in time than this part of the run are the values just before and just after a jump."""


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

    def comparison(
        self, title: str, unit: str, error: float, scale: Estimate, relative_to: str, note: Callable[[], str]
    ) -> Comparison:
        """Compare at the largest distance, relative to a scale; ``error`` bounds that of both courses."""
        i = self.worst
        p, m, off, time = (float(each[i]) for each in (self.model, self.fem3d, self.off, self.time))
        part = share(Estimate(off, error + float(self.beyond[i])), scale)

        def reason() -> str:
            values = f"{quantity(p, unit)} against {quantity(m, unit)} in 3D"
            return f"{values} at {quantity(time, 's', 3)}, {signed(off, unit)}; {note()}".removesuffix("; ")

        return Comparison(title, p, m, unit, part.value, part.error, reason, time, relative_to=relative_to)

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


def overshoot(time: np.ndarray, off: np.ndarray, i: int) -> float:
    """Return how far a curve may rise above its largest point ``i`` between that and a neighbour.

    The parabolas through both points and a third one enclose a curve whose third derivative keeps its sign.
    """
    most = 0.0
    for a in (i - 1, i):
        for n in (a - 1, a + 2):
            if not (0 <= a < len(off) - 1 and 0 <= n < len(off)):
                continue
            wide, slope = time[a + 1] - time[a], (off[a + 1] - off[a]) / (time[a + 1] - time[a])
            rises = [(off[n] - off[m]) / (time[n] - time[m]) for m in (a, a + 1)]
            curvature = (rises[1] - rises[0]) / wide
            # The parabola's top, if it has one within the gap, measured from the gap's start.
            top = 0.0 if curvature >= 0 else min(max((wide - slope / curvature) / 2, 0.0), wide)
            most = max(most, float(off[a] + slope * top + curvature * top * (top - wide) - off[i]))
    return most


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
