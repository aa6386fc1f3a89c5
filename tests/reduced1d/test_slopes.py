"""Derivatives of the reductions, against their formulas."""

import numpy as np
import pytest

from reduced1d import slopes
from reduced1d.equations import anchor_series_resistance
from scenes.sink import Sink
from scenes.varied import numbers


def test_anchor_resistance_by_its_formula():
    """Eq 14: R = u_o / (k w t) + t_o / (k_o l_o w_o), and u_o half of the pad's length beyond the oxide."""
    sink = Sink()
    steady, _ = slopes.of_sink(sink, "paper", numbers(sink))
    found = {key: of["anchor_resistance_K_per_W"] for key, of in steady.items()}
    whole = anchor_series_resistance(sink)
    pad = sink.anchor_distance / (130 * sink.pad_width * sink.thickness) / whole
    expected = {
        "sink.thickness": -pad,
        "anchor.pad_width": -pad,
        "anchor.pad_length": pad * sink.pad_length / (sink.pad_length - sink.oxide_length),
        "anchor.oxide_length": -pad * sink.oxide_length / (sink.pad_length - sink.oxide_length) - (1 - pad),
        "anchor.oxide_width": -(1 - pad),
        "anchor.oxide_thickness": 1 - pad,
        "materials.silicon.thermal_conductivity": -pad,
        "materials.oxide.thermal_conductivity": -(1 - pad),
        "drive.voltage": 0.0,
    }
    assert {key: found[key] for key in expected} == pytest.approx(expected, abs=1e-6)


def test_current_by_its_formula():
    """I = V / (R (1 + a dT)) and the power V I; dT is proportional to the power: d ln dT / d ln V = 2 / (1 + f)
    with f = a dT / (1 + a dT), a fixed point."""
    sink = Sink(voltage=5.0)
    steady, _ = slopes.of_sink(sink, "paper", ["drive.voltage"])
    a = 5e-4
    from reduced1d.ladder import solve

    warm = a * solve(sink, steady_only=True).steady["mean_rise_K"].value
    f = warm / (1 + warm)
    assert steady["drive.voltage"]["mean_rise_K"] == pytest.approx(2 / (1 + f), abs=1e-6)
    assert steady["drive.voltage"]["current_A"] == pytest.approx(1 - 2 * f / (1 + f), abs=1e-6)


def test_over_time_it_goes_to_the_steady_state():
    sink = Sink()
    steady, course = slopes.of_sink(sink, "paper", ["sink.width"], np.array([1e-5, 0.2]))
    found = course["sink.width"]
    assert found["end_K"][-1] == pytest.approx(steady["sink.width"]["end_rise_K"], abs=1e-6)
    # Early on the rise is the energy over the heat capacity, and neither depends on the width.
    assert found["mean_K"][0] == pytest.approx(0, abs=1e-2)
