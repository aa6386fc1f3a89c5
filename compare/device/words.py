"""Times, temperatures and bands of the device as a person reads them."""

from __future__ import annotations

import math

from compare.device.runs import Run
from compare.words import percent


def milliseconds(time: float) -> str:
    """A time in s as "50.7 ms", or that there is none."""
    return f"{time * 1e3:.3g} ms" if math.isfinite(time) else "never in this run"


def kelvin(difference: float) -> str:
    """A temperature difference: "17.5 K"."""
    return f"{difference:.3g} K"


def band_text(run: Run, fraction: float) -> str:
    """How long the sensor's power takes into a band: "0.1 % in 72.5 ms"."""
    time, _ = run.settled(fraction)
    return f"{percent(fraction, 1)} {'in ' if math.isfinite(time) else ''}{milliseconds(time)}"
