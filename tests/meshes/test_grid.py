"""The box that owns each cell, the volume of the cells, which scenes are reduced to which parts, and layers towards
faces whose temperature jumps."""

from dataclasses import replace
from math import erfc

import numpy as np
import pytest

from fem3d.runs import scene as scene_run
from fem3d.spaces import edge_exponents
from meshes import grading, symmetry
from meshes.grid import VOID, Grid, statistics
from scenes.model import Boundary, Box, Material, Probe, Scene
from scenes.sink import OXIDE, SILICON, Sink

SINKS = [
    Sink(),
    Sink(width=300e-6, oxide_offset=0.0),
    Sink(length=50e-6, width=5e-6, thickness=20e-6, pad_width=30e-6, pad_length=40e-6, oxide_width=10e-6,
         oxide_length=10e-6),
]  # fmt: skip


def first(scene, accuracy=1e-3):
    return grading.first_grid(scene, accuracy, edge_exponents.features(scene))


def exact_volume(sink):
    pads = 2 * sink.pad_length * sink.pad_width * sink.thickness
    oxides = 2 * sink.oxide_length * sink.oxide_width * sink.oxide_thickness
    return sink.length * sink.width * sink.thickness + pads + oxides


@pytest.mark.parametrize("sink", SINKS)
@pytest.mark.parametrize("reduced", [True, False])
def test_the_volume_is_exact(sink, reduced):
    part = symmetry.reduce(sink.scene())
    grid = first(part.scene if reduced else sink.scene())
    found = statistics(grid)
    assert abs((part.copies if reduced else 1) * found["volume_m3"] / exact_volume(sink) - 1) < 1e-12
    assert found["cells"] == (grid.owner != VOID).sum()


def test_later_boxes_win():
    lower, upper = (0.0, 0.0, 0.0), (2.0, 1.0, 1.0)
    boxes = (Box("all", SILICON, lower, upper), Box("half", OXIDE, (1.0, 0.0, 0.0), upper))
    breaks = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0]), np.array([0.0, 1.0])
    degrees = tuple(np.ones(len(b) - 1, int) for b in breaks)
    assert Grid(breaks, degrees, boxes).owner.ravel().tolist() == [0, 1]
    assert Grid(breaks, degrees, boxes[::-1]).owner.ravel().tolist() == [1, 1]


SCENE = Sink(convection_coefficient=10.0).scene()


def axes(scene):
    return tuple((axis, parity) for axis, _, parity in symmetry.reduce(scene).planes)


def changed(table, name, **changes):
    items = tuple(replace(item, **changes) if item.name == name else item for item in getattr(SCENE, table))
    return replace(SCENE, **{table: items})


def moved(item, by):
    lower, upper = np.add(item.lower, by), np.add(item.upper, by)
    return replace(item, lower=tuple(lower.tolist()), upper=tuple(upper.tolist()))


def with_moved_oxide(by):
    boxes = tuple(moved(b, by) if b.name == "oxide-0" else b for b in SCENE.boxes)
    return replace(SCENE, boxes=boxes, boundaries=tuple(
        moved(b, by) if b.name == "substrate-0" else b for b in SCENE.boundaries
    ))  # fmt: skip


def test_the_sink_is_reduced_to_a_quarter():
    assert axes(SCENE) == ((0, "even"), (1, "odd"))
    part = symmetry.reduce(SCENE)
    assert part.copies == 4
    assert {b.name for b in part.scene.boxes} == {"beam", "pad-0", "oxide-0"}
    (plane,) = (b for b in part.scene.boundaries if b.name == "symmetry-y")
    assert plane.value == 0.5


def test_of_two_conditions_on_a_face_each_is_the_image_of_its_own_kind():
    flows = symmetry.reduce(Sink(convection_coefficient=10.0, emissivity=0.7).scene()).flows
    assert flows["radiation-pad-1-z1"].boundary == "radiation-pad-0-z1"
    assert flows["air-pad-1"].boundary == "air-pad-0"


@pytest.mark.parametrize(
    ("scene", "left"),
    [
        (with_moved_oxide((5e-6, 0, 0)), ()),
        (with_moved_oxide((0, 5e-6, 0)), ((0, "even"),)),
        (changed("boxes", "pad-1", material=Material("other", 100.0, 2330.0, 712.0, 6e-5, 5e-4)), ((0, "even"),)),
        (changed("boxes", "pad-1", heat_source=1.0), ((0, "even"),)),
        (changed("boundaries", "air-pad-0", value=11.0), ((0, "even"),)),
        (changed("boundaries", "air-pad-0", ambient=300.0), ((0, "even"),)),
        (changed("boundaries", "electrode-0", contact_resistance=1e-9), ((0, "even"),)),
        # The same condition once more on one side.
        (replace(SCENE, boundaries=(*SCENE.boundaries, *(
            replace(b, name="more") for b in SCENE.boundaries if b.name == "air-pad-0"
        ))), ((0, "even"),)),
    ],
)  # fmt: skip
def test_a_scene_that_is_not_symmetric_is_not_reduced(scene, left):
    assert axes(scene) == left


def test_a_third_electrode_of_another_voltage_stops_the_odd_plane():
    def tap(value):
        return Boundary("tap", "voltage", (-5e-5, 5e-4, 0.0), (5e-5, 5e-4, 2e-6), value)

    assert axes(replace(SCENE, boundaries=(*SCENE.boundaries, tap(0.3)))) == ((0, "even"),)


GLASS = Material("oxide", 1.4, 2200.0, 703.0)
THICK, TIME = 4e-6, 1e-8
DIFFUSIVITY = 1.4 / (2200.0 * 703.0)


@pytest.mark.long
def test_slab_soon_after_temperature_step_is_half_space():
    """Half a space: erfc, and the heat that has entered (Carslaw and Jaeger, 2nd ed., section 2.4). One interval of low
    degree stays along x and y, on which nothing depends."""
    box = Box("slab", GLASS, (0.0, 0.0, 0.0), (8e-6, 8e-6, THICK))
    base = Boundary("base", "temperature", (0.0, 0.0, 0.0), (8e-6, 8e-6, 0.0), 400.0)
    probes = (Probe("near", (0.0, 0.0, 2e-7), (0.0, 0.0, 2e-7)), Probe("mean", box.lower, box.upper))
    found = scene_run.solve(Scene("slab", (box,), (base,), probes, 300.0, 1e-6, 1e-3, False, (TIME,)))
    row = int(np.argmin(np.abs(found.traces.time - TIME)))
    near, mean = (found.traces.values[name][row] - 300.0 for name in ("near", "mean"))
    assert abs(near - 100 * erfc(2e-7 / np.sqrt(4 * DIFFUSIVITY * TIME))) <= found.traces.errors["near"] <= 0.1
    assert abs(mean - 200 * np.sqrt(DIFFUSIVITY * TIME / np.pi) / THICK) <= found.traces.errors["mean"] <= 0.1
    assert found.details["unknowns"] < 1000
