"""Which scenes are reduced, and their parts."""

from dataclasses import replace

import numpy as np
import pytest

from meshes import symmetry
from scenes.model import Boundary, Material
from scenes.sink import Sink

SCENE = Sink(convection_coefficient=10.0).scene()


def axes(scene):
    return tuple((axis, parity) for axis, _, parity in symmetry.reduce(scene).planes)


def with_box(name, **changes):
    return replace(SCENE, boxes=tuple(replace(b, **changes) if b.name == name else b for b in SCENE.boxes))


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
        (with_box("pad-1", material=Material("other", 100.0, 2330.0, 712.0, 6e-5, 5e-4)), ((0, "even"),)),
        (with_box("pad-1", heat_source=1.0), ((0, "even"),)),
        (replace(SCENE, boundaries=tuple(
            replace(b, value=11.0) if b.name == "air-pad-0" else b for b in SCENE.boundaries
        )), ((0, "even"),)),
        (replace(SCENE, boundaries=tuple(
            replace(b, ambient=300.0) if b.name == "air-pad-0" else b for b in SCENE.boundaries
        )), ((0, "even"),)),
        (replace(SCENE, boundaries=tuple(
            replace(b, contact_resistance=1e-9) if b.name == "electrode-0" else b for b in SCENE.boundaries
        )), ((0, "even"),)),
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
