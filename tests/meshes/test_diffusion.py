"""Layers towards faces whose temperature jumps."""

from math import erfc

import numpy as np
import pytest

from fem3d.runs import scene as scene_run
from scenes.model import Boundary, Box, Material, Probe, Scene

OXIDE = Material("oxide", 1.4, 2200.0, 703.0)
THICK, TIME = 4e-6, 1e-8
DIFFUSIVITY = 1.4 / (2200.0 * 703.0)


@pytest.mark.long
def test_slab_soon_after_temperature_step_is_half_space():
    """Half a space: erfc, and the heat that has entered (Carslaw and Jaeger, 2nd ed., section 2.4). One interval of low
    degree stays along x and y, on which nothing depends."""
    box = Box("slab", OXIDE, (0.0, 0.0, 0.0), (8e-6, 8e-6, THICK))
    base = Boundary("base", "temperature", (0.0, 0.0, 0.0), (8e-6, 8e-6, 0.0), 400.0)
    probes = (Probe("near", (0.0, 0.0, 2e-7), (0.0, 0.0, 2e-7)), Probe("mean", box.lower, box.upper))
    found = scene_run.solve(Scene("slab", (box,), (base,), probes, 300.0, 1e-6, 1e-3, False, (TIME,)))
    row = int(np.argmin(np.abs(found.traces.time - TIME)))
    near, mean = (found.traces.values[name][row] - 300.0 for name in ("near", "mean"))
    assert abs(near - 100 * erfc(2e-7 / np.sqrt(4 * DIFFUSIVITY * TIME))) <= found.traces.errors["near"] <= 0.1
    assert abs(mean - 200 * np.sqrt(DIFFUSIVITY * TIME / np.pi) / THICK) <= found.traces.errors["mean"] <= 0.1
    assert found.details["unknowns"] < 1000
