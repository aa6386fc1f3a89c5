"""What the checks of the device in 3D say beside their numbers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from compare.device_3d_checks import _why_steady
from scenes.device import Device


def test_the_air_cools_the_covered_top_in_1d_alone() -> None:
    """With 100 W/(m2 K) over 1000 um x 100 um at 17.5 K: 175 uW."""
    device = Device()
    windy = replace(device, sink=replace(device.sink, convection_coefficient=100.0))
    still_both, both = (SimpleNamespace(device=d) for d in (device, windy))
    cooled: Any = both
    still: Any = still_both
    assert "1D loses 175 uW to the air from the beam's top" in _why_steady(cooled, "sink_power_W")
    assert "air" not in _why_steady(still, "sink_power_W")
    assert "air" not in _why_steady(cooled, "sensor_power_W")
