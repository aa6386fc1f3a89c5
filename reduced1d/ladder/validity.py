"""Where the plate, and all that is built on it, stops being a good picture of the sink."""

from __future__ import annotations

import math

from reduced1d.ladder.moments import FIRST_TIME
from scenes.sink import Sink

THIN = 1e-3
"""The part of the anchor resistance that a plate's neglected terms may be: where more, it is not thin."""


def oxide_time(sink: Sink) -> float:
    """The oxide's slowest time constant (s), its top held: (2 t_o / pi)^2 over its diffusivity."""
    return (2 * sink.oxide_thickness / math.pi) ** 2 * sink.oxide.heat_capacity / sink.oxide.thermal_conductivity


def warnings(sink: Sink, remainder: float) -> list[str]:
    """A sentence for each assumption of the plate that a sink does not meet; ``remainder`` is the plate's own estimate
    of what it neglects."""
    found = []
    if remainder > THIN:
        found.append(
            f"the thin-plate assumption ends here: with silicon of {sink.thickness * 1e6:.3g} um on oxide of "
            f"{sink.oxide_thickness * 1e6:.3g} um, what the plate neglects may be {100 * remainder:.2g} % of the "
            "anchor resistance"
        )
    if oxide_time(sink) > FIRST_TIME:
        found.append(
            f"the oxide takes {oxide_time(sink) * 1e6:.3g} us to warm through, more than the "
            f"{FIRST_TIME * 1e6:.0f} us from which on traces are compared: the plate's third of its capacity is right "
            "only for slower changes"
        )
    return found
