"""The checks of each type of scene, which it may set a tolerance for, or declare as expected to differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from scenes.errors import SceneError, quoted, unknown
from scenes.kinds import Kind, Numbers, Quantity
from scenes.model import SLOPE_TOLERANCE
from scenes.units import NUMBER

FIRST_TIME = 10e-6
"""The time (s) from which on traces are compared: before it, the step's first instants would decide."""

EQUATIONS = "eq12", "eq13", "eq14", "eq16", "eq18", "eq18_measured"
DEFAULT_TOLERANCES: dict[str, float] = {
    **dict.fromkeys(EQUATIONS, 0.02),
    **dict.fromkeys(("fig4", "fig5", "fig6_peak", "fig6_end", "fig7_current"), 0.05),
    "energy": 1e-8,
}
"""The relative tolerance of every check of the sink, by id, where a scene declares none."""

_OF_THE_ROW = {"islands_peak_inner": 0.05, "islands_peak_outer": 0.05, "islands_mean": 0.05, "islands_current": 0.02}
ISLAND_TOLERANCES: dict[str, float] = {
    f"{check}{when}": tolerance
    for when in ("", "_over_time")
    for check, tolerance in {**_OF_THE_ROW, "islands_equivalent": 0.05}.items()
}
"""Tolerances of a row of spans, beside the energy's. The current's is an equation's: Ohm's law of the row."""

OVER_TIME = tuple(c for c in {**DEFAULT_TOLERANCES, **ISLAND_TOLERANCES} if c[:4] in ("fig6", "fig7") or "_over_" in c)
"""Checks that need the transient."""
OF_THE_REDUCTION = tuple({"fig4": 0, **_OF_THE_ROW} | dict.fromkeys(c for c in OVER_TIME if "equivalent" not in c))
"""Checks of the chosen 1D model."""
OF_THE_PAPER = *EQUATIONS, "fig5"
"""Checks of the paper's equations with 3D numbers put in, whichever 1D model was chosen."""

SLOPE_TOLERANCES: dict[str, float] = {"slope": SLOPE_TOLERANCE}
"""Tolerance of how 1D follows a key of the scene (checks slope_<key>), relative to the largest slope."""

_AGAINST = tuple(f"against_{name}" for name in ("peak", "end", "mean", "current", "power"))  # a user's own traces
SINK_TOLERANCES = DEFAULT_TOLERANCES | ISLAND_TOLERANCES | dict.fromkeys(_AGAINST, 0.05)
SINK_CHECKS = tuple(SINK_TOLERANCES)
"""Ids of every check that a sink may have, except slopes, of which there is one for each key."""

DEVICE_TOLERANCES: dict[str, float] = {
    "fig9_settling": 0.25, "fig9_balance": 1e-6, "fig10_steady": 1e-6, "fig11_slow": 0.05, "fig12_same_time": 0.05,
    "fig13_slope": 1e-6, "fig13_limit": 1e-6, "meter_resistance": 0.1, "meter_power": 0.05,
    "meter_rate": 0.05,
}  # fmt: skip
"""The tolerances of the device: the paper's "about" is taken as a quarter, "ca." as a tenth, two digits as a twentieth,
what it states as exact as 1e-6."""

DEVICE_3D_TOLERANCES: dict[str, float] = {
    **dict.fromkeys(("dev3d_sink_power", "dev3d_sensor_power", "dev3d_sink_voltage", "dev3d_sensor_voltage"), 0.02),
    **dict.fromkeys(("dev3d_sink_peak", "dev3d_sensor_peak"), 0.05),
    **dict.fromkeys(("dev3d_sink_peak_time", "dev3d_sensor_peak_time", "dev3d_settling"), 0.05),
    "dev3d_slope": 0.02,
    **dict.fromkeys(("dev3d_sink_gain", "dev3d_sensor_gain"), 0.05),
    "dev3d_claim_steady": 1e-4,
    "dev3d_claim_over_time": 0.05,
    "dev3d_shielding": 1e-4,
}
"""Tolerances of the device in 3D: steady values as the sink's equations, traces as its figures. The claims are stated
as exact: a ten-thousandth is what 3D is asked to resolve."""

DEVICE_CHECKS = tuple(DEVICE_TOLERANCES | DEVICE_3D_TOLERANCES)
"""Ids of every check that a device may have."""


def tolerances(known: tuple[str, ...] = (*SINK_CHECKS, *SLOPE_TOLERANCES)) -> Numbers:
    """Return the kind of a table of relative tolerances by check id."""
    return Numbers(Quantity(NUMBER, 1e-15, 100.0), known, "check", "a table of tolerances such as {CHECK = 0.02}")


@dataclass(frozen=True)
class Differing(Kind):
    """A list of checks that are expected to differ, each once, or one text with commas; ``word`` declares nothing."""

    known: tuple[str, ...] = SINK_CHECKS
    word: str = "undeclared"
    form = 'a list of checks such as ["CHECK"], or "undeclared"'

    def read(self, path: str, given: object) -> tuple[str, ...] | None:
        if isinstance(given, str) and given == self.word:
            return None
        items = [part.strip() for part in given.split(",")] if isinstance(given, str) else given
        if not isinstance(items, (list, tuple)):
            raise SceneError(f"{path} = {quoted(given)} must be {self.form}")
        for name in items:
            if self.known and name not in self.known:
                raise unknown(f"{path} names an unknown check", name, self.known)
        return tuple(dict.fromkeys(map(str, items)))

    def show(self, value: Any) -> str:
        return self.word if value is None else ", ".join(value)
