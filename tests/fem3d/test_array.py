"""Rows of sinks on one substrate: the plate's own solution against a cosine series, and elements that are coupled by it
against all of them in one mesh."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem3d.runs import array
from fem3d.runs import scene as free
from fem3d.runs.plate import Plate
from scenes.array import SinkArray, whole
from scenes.errors import SceneError
from scenes.loading import load

SMOOTH = 3e-6
"""m: the source of the series is a Gaussian of that width, so that it ends; at a distance r it adds (SMOOTH/r)^2."""


def series(plate: Plate, source: tuple[float, float], target: tuple[float, float], count: int = 1500) -> float:
    """The rise (K/W) of a plate heated at a point of its top, as a double series of cosines."""
    a, b = (np.pi * np.arange(count) / side for side in (plate.x, plate.y))
    g = np.hypot(a[:, None], b[None])
    g[0, 0] = 1e-30
    depth = np.tanh(g * plate.thickness) / (plate.conductivity * g) * np.exp(-((g * SMOOTH) ** 2) / 2)
    twice = np.where(np.arange(count) > 0, 2.0, 1.0)
    along = [np.cos(w * p) * np.cos(w * q) * twice for w, p, q in zip((a, b), source, target, strict=True)]
    return float(along[0] @ depth @ along[1] / (plate.x * plate.y))


@pytest.mark.parametrize(
    ("source", "target"),
    [((1.3e-3, 0.9e-3), (1.7e-3, 0.9e-3)), ((0.3e-3, 0.1e-3), (0.7e-3, 0.2e-3)), ((1.3e-3, 0.9e-3), (1.7e-3, 2.1e-3))],
)
def test_the_plate_is_its_cosine_series(source: tuple[float, float], target: tuple[float, float]) -> None:
    plate = Plate(3e-3, 3e-3, 0.5e-3, 130.0)
    columns, rows = (np.array([[a], [b]]) for a, b in zip(source, target, strict=True))
    found, expected = plate.between(columns, rows)[0, 1, 0, 1], series(plate, source, target)
    assert found == pytest.approx(expected, rel=1.5e-4)
    assert found == pytest.approx(plate.between(columns, rows)[1, 0, 1, 0], rel=1e-9)
    thicker = Plate(3e-3, 3e-3, 0.505e-3, 130.0)
    assert thicker.between(columns, rows)[0, 1, 0, 1] != pytest.approx(expected, rel=1.5e-4)


PAIR = SinkArray(columns=2, driven=(1,), substrate_thickness=0.5e-3)
TOUCHING = replace(PAIR, contact_resistance=1e-7)
COOLED = replace(PAIR, pitch=300e-6, convection_coefficient=1000.0)
GIVEN = replace(PAIR, pitch=300e-6, current=14e-3)
ROW = SinkArray(columns=3, pitch=200e-6, driven=(1, 3), substrate_thickness=0.5e-3)
coupled = cache(array.solve)
in_one_mesh = cache(lambda sink: free.solve(whole(sink)))


@pytest.mark.long
@pytest.mark.parametrize("sink", [TOUCHING, ROW, COOLED, GIVEN])
def test_coupled_elements_are_those_of_one_mesh(sink: SinkArray) -> None:
    driven, found, one = sink.driven, coupled(sink), in_one_mesh(sink)
    for k in range(1, sink.columns + 1):
        for name in ("peak", "mean"):
            own, other = found.steady[f"sink{k}_{name}_rise_K"], one.steady[f"sink{k}_{name}"]
            assert abs(own.value - (other.value - 293.0)) < own.error + other.error
            if k not in driven:
                # By itself an idle one is known to less: its own error is checked against what the two are apart. In
                # air it is 1.5 times too warm where what that takes from it is left out.
                assert own.value == pytest.approx(other.value - 293.0, rel=2e-3)
                assert own.error < 0.02 * own.value


@pytest.mark.long
def test_contacts_are_of_every_element() -> None:
    """Coupled elements whose oxide has contacts are those of one mesh that has them too; without, the peak is 0.7 %
    lower, 20 times what both errors are."""
    assert [c.between[1] for c in whole(TOUCHING).contacts].count("substrate") == 4
    peak, other = coupled(TOUCHING).steady["sink1_peak_rise_K"], in_one_mesh(TOUCHING).steady["sink1_peak"]
    assert abs(peak.value - (other.value - 293.0)) < peak.error + other.error
    perfect = coupled(PAIR).steady["sink1_peak_rise_K"]
    assert peak.value - perfect.value > 5 * (peak.error + other.error)


def test_known_numbers_of_two_columns() -> None:
    """A solution of both in one mesh at 1e-4 has 2.6466 mK in the idle one and 20.4477 K in the driven one."""
    found = coupled(PAIR).steady
    assert found["sink2_mean_rise_K"].value == pytest.approx(2.6466e-3, rel=1e-3)
    assert found["sink1_peak_rise_K"].value == pytest.approx(20.4477, abs=found["sink1_peak_rise_K"].error)


def test_an_idle_element_in_air_is_a_fin() -> None:
    """Between ends that the plate warms alike its mean is sinh(x)/x of its middle, x = l/2 sqrt(h/(k t))."""
    sink = replace(COOLED, accuracy=3e-2)
    steady = array.solve(sink).steady
    x = sink.length / 2 * np.sqrt(1000.0 / (130.0 * sink.thickness))
    mean, middle = (steady[f"sink2_{name}_rise_K"].value for name in ("mean", "peak"))
    assert mean / middle == pytest.approx(np.sinh(x) / x, rel=1e-3)


@pytest.mark.parametrize("settings", [{"current": 14e-3}, {"series_resistance": 100.0}, {}])
def test_a_neighbour_changes_the_power_by_what_drives_it(settings: dict[str, float]) -> None:
    """P follows the resistance by the power s of it, 1 for a given current and (R_s - R)/(R_s + R) for a voltage behind
    R_s; with R in proportion to 1 + a (theta + m P/P_alone) that is s a theta/(1 + a m (1 - s)) to first order."""
    sink = replace(PAIR, accuracy=3e-2, driven=None, **settings)
    found = array.solve(sink)
    one, crosstalk, a = found.details["one"].steady, found.details["crosstalk"], sink.silicon.temperature_coefficient
    mean, power, current = (one[q].value for q in ("mean_rise_K", "power_W", "current_A"))
    theta = (crosstalk[0].sum() - mean / power) * power
    resistance = power / current**2
    s = 1.0 if sink.current else (sink.series_resistance - resistance) / (sink.series_resistance + resistance)
    changed = s * a * theta / (1 + a * mean * (1 - s))
    # The plate's own rise follows the power too; terms of second order are 1e-3 of it.
    own = found.steady["sink1_mean_rise_K"].value - mean - theta * (1 + changed)
    assert own == pytest.approx(mean * changed, rel=1e-2)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (("array.columns=2", "array.pitch=100um"), "lets pads touch"),
        (("array.columns=0",), "must be a whole number from 1 to 100"),
        (("array.columns=20",), "is smaller than the array on it"),
        (("array.columns=5", "array.driven=[7]"), "names element 7, and the array has 5"),
        (("array.columns=2", "substrate.thickness=none"), "stand on one substrate"),
    ],
)
def test_what_is_no_array_is_refused(settings: tuple[str, ...], said: str) -> None:
    with pytest.raises(SceneError, match=said):
        load("sink", ("substrate.thickness=0.5mm", *settings) if "none" not in settings[-1] else settings)
