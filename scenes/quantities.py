"""What is asked of a sink, by a user's word for it: the names of the steady value and of the trace, the unit, and
what a reader calls it."""

from __future__ import annotations

from typing import NamedTuple


class Asked(NamedTuple):
    """A quantity: the key of its ``steady`` value in summary.json, that of its ``trace`` in traces.csv (where it has
    one), its SI unit, and what it is ``called``."""

    steady: str
    trace: str
    unit: str
    called: str


OF_A_SINK = {
    "peak": Asked("peak_rise_K", "peak_K", "K", "peak rise"),
    "end": Asked("end_rise_K", "end_K", "K", "end rise"),
    "mean": Asked("mean_rise_K", "mean_K", "K", "mean rise"),
    "current": Asked("current_A", "current_A", "A", "current"),
    "power": Asked("power_W", "power_W", "W", "power"),
    "heat_out": Asked("heat_out_W", "", "W", "heat to the substrate"),
    "anchor_resistance": Asked("anchor_resistance_K_per_W", "", "K/W", "anchor resistance"),
}
