"""Layers towards faces whose temperature jumps."""

from math import erfc

import numpy as np
import pytest

from fem3d.runs import scene as scene_run
from meshes import diffusion, grading
from scenes.model import Boundary, Box, Material, Probe, Scene, Schedule

OXIDE = Material("oxide", 1.4, 2200.0, 703.0)
THICK, TIME = 4e-6, 1e-8
DIFFUSIVITY = 1.4 / (2200.0 * 703.0)


def slab(value=400.0, kind="temperature"):
    box = Box("slab", OXIDE, (0.0, 0.0, 0.0), (8e-6, 8e-6, THICK))
    base = Boundary("base", kind, (0.0, 0.0, 0.0), (8e-6, 8e-6, 0.0), value, 400.0)
    near = Probe("near", (0.0, 0.0, 2e-7), (0.0, 0.0, 2e-7))
    return Scene(
        "slab", (box,), (base,), (near, Probe("mean", box.lower, box.upper)), 300.0, 1e-6, 1e-3, False, (TIME,)
    )


def shortest(scene):
    grid = grading.first_grid(scene, 1e-3, grading.features(scene))
    finer = diffusion.graded(grid, scene, TIME)
    assert (finer.breaks[0] == grid.breaks[0]).all()
    assert len(finer.degrees[2]) == len(finer.breaks[2]) - 1
    return float(np.diff(finer.breaks[2])[0])


@pytest.mark.parametrize(
    "scene", [slab(), slab(Schedule((0.0, 5e-7, 5e-7), (300.0, 300.0, 400.0))), slab(1e8, "convection")]
)
def test_jumps_get_layers_as_thin_as_heat_reaches(scene):
    length = np.sqrt(DIFFUSIVITY * TIME)
    assert length < shortest(scene) <= diffusion.REACH * length


@pytest.mark.parametrize("scene", [slab(300.0), slab(Schedule((0.0, 1e-6), (300.0, 400.0))), slab(10.0, "convection")])
def test_nothing_is_graded_where_nothing_jumps(scene):
    assert shortest(scene) == pytest.approx(THICK)


@pytest.mark.long
def test_a_layer_that_heat_has_hardly_entered():
    """Half a space: erfc, and the heat that has entered (Carslaw and Jaeger, 2nd ed., section 2.4). One interval of low
    degree stays along x and y, on which nothing depends."""
    found = scene_run.solve(slab())
    row = int(np.argmin(np.abs(found.traces.time - TIME)))
    near, mean = (found.traces.values[name][row] - 300.0 for name in ("near", "mean"))
    assert abs(near - 100 * erfc(2e-7 / np.sqrt(4 * DIFFUSIVITY * TIME))) <= found.traces.errors["near"] <= 0.1
    assert abs(mean - 200 * np.sqrt(DIFFUSIVITY * TIME / np.pi) / THICK) <= found.traces.errors["mean"] <= 0.1
    assert found.details["unknowns"] < 1000
