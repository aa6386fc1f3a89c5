"""Further probes are read on the mesh of a scene's own probes."""

from dataclasses import replace

import pytest

from fem3d.runs.scene import observe, solve
from scenes.loading import load_free
from scenes.model import Probe


def test_a_vanishing_flow_is_read_with_its_error_and_refines_nothing():
    scene = replace(load_free("bridge", []), accuracy=1e-2)
    middle = Probe("middle flow", (0.0, 100e-6, 2e-6), (10e-6, 100e-6, 4e-6), "heat_flow")
    found, alone = observe(scene, [middle]), solve(scene).steady
    assert abs(found["middle flow"].value) <= found["middle flow"].error
    for name, estimate in alone.items():
        assert found[name].value == pytest.approx(estimate.value, abs=estimate.error + found[name].error)
