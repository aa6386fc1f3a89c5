"""Boundaries of one value that meet: each has its part of the flow at shared nodes."""

from dataclasses import replace

import pytest

from fem3d.runs import scene as scene_run
from scenes.free import from_dict
from scenes.model import Boundary, Box, Material, Probe, Scene

QUARTER = 10.234092569 / 4  # of a square duct's shape factor per unit length, walls as thick as half its opening


def duct():
    """A square duct, a body around a hole: inside at 400 K, outside at 300 K, k = 1 W/(m K), 0.1 m long."""
    walls = {"l": (-1, -1, -0.5, 1), "r": (0.5, -1, 1, 1), "b": (-0.5, -1, 0.5, -0.5), "t": (-0.5, 0.5, 0.5, 1)}
    sides = {}
    for name, half, temperature in (("i", 0.5, 400.0), ("o", 1.0, 300.0)):
        for side, at in (("l", -half), ("r", half)):
            sides[name + side] = (at, -half, at, half, temperature)
        for side, at in (("b", -half), ("t", half)):
            sides[name + side] = (-half, at, half, at, temperature)
    return from_dict({
        "scene": {"name": "duct", "initial_temperature": 300.0},
        "run": {"steady": True, "accuracy": 1e-3},
        "material": [{"name": "k", "thermal_conductivity": 1.0}],
        "box": [{"name": n, "material": "k", "lower": [*w[:2], 0], "upper": [*w[2:], 0.1]} for n, w in walls.items()],
        "boundary": [
            {"name": n, "lower": [*s[:2], 0], "upper": [*s[2:4], 0.1], "temperature": s[4]} for n, s in sides.items()
        ],
        "probe": [
            {"name": n, "quantity": "heat_flow", "lower": [*sides[n][:2], 0], "upper": [*sides[n][2:4], 0.1]}
            for n in ("il", "ol")
        ],
    })  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("accuracy", [1e-2, 1e-3])
def test_side_of_duct_has_quarter_of_heat(accuracy):
    """At its inner edges, re-entrant for the wall, the flux has no bound."""
    found = scene_run.solve(replace(duct(), accuracy=accuracy)).steady
    for name, sign in (("il", 1.0), ("ol", -1.0)):
        each, true = found[name], sign * 10.0 * QUARTER
        assert abs(each.value - true) <= each.error <= accuracy * abs(true)
        assert abs(each.value - 1.03 * true) > each.error


@pytest.mark.parametrize("mesh", ["bricks", "tetrahedra"])
def test_parts_of_one_face_share_uniform_flow_by_area(mesh):
    """The flux through a slab is uniform; its cold face is two boundaries of one temperature."""
    faces = {"left": ((0.0, 0.0, 0.0), (0.3, 1.0, 0.0), 300.0), "right": ((0.3, 0.0, 0.0), (1.0, 1.0, 0.0), 300.0),
             "hot": ((0.0, 0.0, 1.0), (1.0, 1.0, 1.0), 310.0)}  # fmt: skip
    box = Box("box", Material("k", 2.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    scene = Scene(
        "halves", (box,), tuple(Boundary(n, "temperature", *f) for n, f in faces.items()),
        tuple(Probe(n, *f[:2], "heat_flow") for n, f in faces.items()), 300.0, steady=True, mesh=mesh,
    )  # fmt: skip
    found = {name: e.value for name, e in scene_run.solve(scene).steady.items()}
    assert found == pytest.approx({"left": -6.0, "right": -14.0, "hot": 20.0}, rel=1e-9)
