"""Where the plate, and all that is built on it, stops being a good picture of the sink."""

from __future__ import annotations

import math

from reduced1d.ladder.moments import FIRST_TIME
from scenes.sink import Sink

THIN = 1e-3
"""The part of the anchor resistance that a plate's neglected terms may be: where more, it is not thin."""


ONE_NODE = 0.05
"""The same for the ends of a fin whose anchors are one node each."""

SLENDER = 2.0
"""The length over the width below which a beam has more than one rise across."""


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


def fin_warnings(sink: Sink, one_node: float) -> list[str]:
    """A sentence for each assumption of the fin alone that a sink does not meet; ``one_node`` is the estimate of what
    its anchors neglect."""
    found = []
    if one_node > ONE_NODE:
        found.append(
            f"the anchors are too slow for one node each: on the way to the steady state the fin's ends may be off by "
            f"{100 * one_node:.2g} % (plate and moments are not)"
        )
    if sink.length < SLENDER * sink.width:
        found.append(
            f"a beam {sink.width * 1e6:.3g} um wide and {sink.length * 1e6:.3g} um long is not slender: its rise is "
            "not uniform across (plate and moments know that)"
        )
    return found
