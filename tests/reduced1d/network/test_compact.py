"""A network as a compact model: its values, its stated errors, and its refusals."""

from dataclasses import replace

import numpy as np
import pytest

from reduced1d.network import solve
from reduced1d.network.compact import compact
from scenes.errors import SceneError
from scenes.loading import load
from statespace.runtime import CompactModel
from tests.reduced1d.network.test_closed_forms import cooled_wire


@pytest.mark.long
def test_the_bridge_in_a_few_states():
    """Steady, with resistance feedback, a potential and a heat flow among the outputs."""
    bridge = load("bridge")
    document = compact(bridge, None, 1e-4)
    assert document["states"] < 10
    exact, model = solve(bridge).steady, CompactModel(document)
    errors = document["error"]["the scene"]["steady"]
    for name, value in model.steady().items():
        assert abs(value - exact[name].value) <= errors[name]["error"] * (1 + 1e-6) + 1e-12 * abs(value)
        assert errors[name]["relative"] < 1e-4
    # A voltage that was not used in the reduction, against the network at that voltage.
    other = replace(bridge, boundaries=tuple(replace(b, value=0.6 * b.value) if b.kind == "voltage" else b
                                             for b in bridge.boundaries))  # fmt: skip
    there = solve(other).steady
    found = model.steady({"left electrode.voltage": 0.6})
    assert found["middle"] - 293 == pytest.approx(there["middle"].value - 293, rel=1e-4)
    assert found["quarter"] == pytest.approx(there["quarter"].value, rel=1e-4)
    assert found["current"] == pytest.approx(there["current"].value, rel=1e-4)
    assert found["middle"] - 293 != pytest.approx(1.001 * (there["middle"].value - 293), rel=1e-4)


@pytest.mark.long
def test_a_wire_over_time():
    """A current that is switched on, in a wire whose resistance follows its temperature."""
    wire = cooled_wire(3e-3, 1e-4, voltage=0.5)
    document = compact(wire, None, 1e-4)
    times = np.array([2e-6, 1e-5, 5e-5, 1e-4])
    traces, found = solve(wire, times, steady_too=False).over_time, CompactModel(document).simulate(times)
    errors = document["error"]["the scene"]["over time"]
    for name, values in ((name, traces.values[name]) for name in errors):
        # Between the instants that were compared it is as good, to a factor.
        assert np.abs(found[name] - values).max() <= 3 * errors[name]["error"] + 1e-9 * np.abs(values).max()
        assert errors[name]["relative"] <= 1e-4
    assert found["middle"][-1] - found["middle"][0] > 1.0


def test_extremes_are_refused():
    bridge = load("bridge")
    hottest = replace(bridge, probes=tuple(replace(p, reduce="max") for p in bridge.probes[1:2]))
    with pytest.raises(SceneError, match="has no extremes"):
        compact(hottest, None, 1e-3)
