"""Degrees edge by edge on a small structure on a large block: fewer unknowns, and error bounds that hold."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem3d.adaptivity import brick_mesh
from fem3d.runs import scene as scene_run
from fem3d.runs import sink as sink_run
from fem3d.spaces.size import size_of_grid
from scenes.model import Boundary, Box, Material, Probe, Scene
from scenes.sink import Sink

UM = 1e-6
GLASS, SILICON = Material("glass", 1.38, 2200.0, 703.0), Material("silicon", 130.0, 2330.0, 712.0)


def bridge(accuracy):
    """A heated plate of 80 x 20 x 2 um on a post of glass, on a block of 400 x 400 x 150 um."""
    low, high = (-200 * UM, -200 * UM, -150 * UM), (200 * UM, 200 * UM, 0.0)
    boxes = (
        Box("block", SILICON, low, high), Box("post", GLASS, (-5 * UM, -5 * UM, 0.0), (5 * UM, 5 * UM, 2 * UM)),
        Box("plate", SILICON, (-30 * UM, -10 * UM, 2 * UM), (50 * UM, 10 * UM, 4 * UM), 1e13),
    )  # fmt: skip
    cold = Boundary("cold", "temperature", low, (*high[:2], low[2]), 293.0)
    probes = Probe("plate", boxes[2].lower, boxes[2].upper), Probe("foot", boxes[1].lower, (5 * UM, 5 * UM, 0.0))
    return Scene("bridge", boxes, (cold,), probes, accuracy=accuracy, steady=True)


@cache
def uniform(accuracy):
    """A solution whose degrees are uniform in its intervals."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(brick_mesh, "MANY", np.inf)
        return scene_run.solve(bridge(accuracy))


@pytest.mark.long
def test_block_under_small_structure_takes_few_unknowns():
    """Beyond degree 4: grids of lower degrees are too small for a rough grid to save anything."""
    found = scene_run.solve(bridge(3e-4))
    assert found.details["unknowns"] < 0.7 * uniform(3e-4).details["unknowns"]
    for name, truth in uniform(1e-4).steady.items():
        value = found.steady[name]
        assert abs(value.value - truth.value) < value.error + truth.error < 1.2e-3 * (truth.value - 293.0)
        assert abs(value.value + 3 * value.error - truth.value) > value.error + truth.error


@pytest.mark.long
def test_bricks_beyond_memory_are_kept_as_they_are():
    first = size_of_grid(bridge(1e-4), scene_run.start(bridge(1e-4))[1].grid)
    found = scene_run.solve(replace(bridge(1e-4), memory=1.02 * first.memory))
    assert "cell_type" not in found.details["mesh"]
    assert any("as many bricks as the memory has room for" in warning for warning in found.details["warnings"])
    for name, truth in uniform(1e-4).steady.items():
        value = found.steady[name]
        assert abs(value.value - truth.value) < value.error + truth.error


@pytest.mark.long
def test_sink_on_substrate_takes_few_unknowns():
    """Intervals alone took 44,775 unknowns for 1e-4, and two meshes of which the first had 26,554."""
    sink = Sink(substrate_thickness=0.5e-3, accuracy=1e-4)
    found = sink_run.solve(sink, transient=False)
    assert found.details["unknowns"] < 22_000
    finer = sink_run.solve(replace(sink, accuracy=1e-5), transient=False).steady
    for name, truth in finer.items():
        value = found.steady[name]
        assert abs(value.value - truth.value) < value.error + truth.error
        assert abs(value.value + 3 * value.error - truth.value) > value.error + truth.error
