"""Separate the difference of two courses over time into size, time and shape.

With y the 3D course and m the model's, a y((t - shift)/stretch) is fitted to m by least squares: first with a size a
alone, then with a stretch or a shift as well, whichever is nearer. A stretch c < 1 is a time constant that is short by
1 - c.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenes.formats import percent, quantity

MOST = 10.0
"""By what factor time is stretched at most."""
POINTS = 400
"""Number of times at which two courses are fitted to each other; more cost time and change nothing."""
ROUND, ROUNDS = 20, 4
"""The best change of the time is looked for on so many points to either side, in so many rounds, each between the
neighbours of the best point of the one before: it is known to 20^-4, 6e-6 of the largest change."""
NOTABLE = 0.5
"""A change of the time is spoken of only where it leaves less than this part of the distance without it."""
LEAST = 0.005
"""Changes of size and of time smaller than this are none."""


@dataclass(frozen=True)
class Course:
    """Both courses (times,) above the base of their scale, and the interpolation error of 3D between its rows."""

    time: np.ndarray
    fem3d: np.ndarray
    model: np.ndarray
    beyond: np.ndarray


@dataclass(frozen=True)
class Apart:
    """The model's course relative to 3D's.

    ``size``, ``stretch`` and ``shift`` (s) are fitted. The largest distances, relative to the scale, are ``whole`` as
    it stands, ``sized`` with the size alone, and ``shape`` with the time, too.
    """

    size: float
    stretch: float
    shift: float
    shape: float
    sized: float
    whole: float

    @property
    def told(self) -> bool:
        """Whether a change of size or of time removes most of the distance."""
        by_time = self.shape <= NOTABLE * self.sized and (abs(self.stretch - 1) >= LEAST or bool(self.shift))
        return by_time or (abs(self.size - 1) > LEAST and self.sized < NOTABLE * self.whole)

    def said(self) -> str:
        """Put it in words: "its time constant is 22 % short; stretched by that it is within 1.5 %"."""
        high = f"{percent(abs(self.size - 1))} {'high' if self.size > 1 else 'low'} throughout"
        larger = abs(self.size - 1) > LEAST
        if not self.told:
            return "its shape is another: no change of size or of time brings it nearer"
        if self.shape > NOTABLE * self.sized or (abs(self.stretch - 1) < LEAST and not self.shift):
            return f"it is {high}, and apart from that within {percent(self.sized)}"
        if self.shift:
            late = "late" if self.shift > 0 else "early"
            said, undone = f"it is {quantity(abs(self.shift), 's', 2)} {late}", "shifted by that"
        else:
            short = "short" if self.stretch < 1 else "long"
            said, undone = f"its time constant is {percent(abs(self.stretch - 1))} {short}", "stretched by that"
        return f"{said}{f' and it is {high}' if larger else ''}; {undone} it is within {percent(self.shape)}"


def told_apart(course: Course, scale: float) -> Apart | None:
    """Fit size, stretch and shift; None where a course does not change over time."""
    time, y, m = course.time, course.fem3d, course.model
    if len(time) < 5 or not scale or np.ptp(y) < LEAST * scale or np.ptp(m) < LEAST * scale:
        return None
    # Evenly over the model's own progress, in time and in value, so that neither a long rest nor a short rise decides.
    progress = np.cumsum(np.abs(np.diff(m, prepend=m[0]))) / max(float(np.abs(np.diff(m)).sum()), 1e-300)
    progress = progress + (time - time[0]) / (time[-1] - time[0])
    places = np.interp(np.linspace(0, progress[-1], POINTS), progress, time)
    sampled = np.interp(places, time, m)

    def fitted(stretch: float, shift: float) -> tuple[float, float]:
        """The size that fits best, and the mean square of what is left."""
        other = np.interp((places - shift) / stretch, time, y)
        size = float(other @ sampled / max(float(other @ other), 1e-300))
        return size, float(np.mean((sampled - size * other) ** 2))

    def largest(size: float, stretch: float, shift: float) -> float:
        return float(np.abs(m - size * np.interp((time - shift) / stretch, time, y)).max()) / scale

    ways = []
    for way, most in (("stretch", np.log(MOST)), ("shift", (time[-1] - time[0]) / 2)):

        def residual(x: float, way: str = way) -> float:
            return fitted(float(np.exp(x)), 0.0)[1] if way == "stretch" else fitted(1.0, float(x))[1]

        x, spacing = 0.0, most / ROUND
        for _ in range(ROUNDS):
            span = np.clip(x + spacing * np.arange(-ROUND, ROUND + 1), -most, most)
            x, spacing = float(span[np.argmin([residual(float(v)) for v in span])]), spacing / ROUND
        stretch, shift = (float(np.exp(x)), 0.0) if way == "stretch" else (1.0, x)
        size = fitted(stretch, shift)[0]
        ways.append((largest(size, stretch, shift), size, stretch, shift))
    shape, size, stretch, shift = min(ways)
    alone = fitted(1.0, 0.0)[0]
    return Apart(size, stretch, shift, shape, largest(alone, 1.0, 0.0), float(np.abs(m - y).max()) / scale)
