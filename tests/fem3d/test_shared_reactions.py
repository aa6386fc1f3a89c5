"""Boundaries of one value that meet: each has its part of what enters at the nodes they share."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d import solve_scene
from fem3d.heat import parts_of_reactions
from fem3d.operators import assemble
from meshes.axis import Axis
from meshes.bricks import BrickMesh
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


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3])
def test_a_side_of_a_duct_has_a_quarter_of_its_heat(accuracy):
    """At its inner edges, re-entrant for the wall, the flux has no bound."""
    found = solve_scene.solve(replace(duct(), accuracy=accuracy)).steady
    for name, sign in (("il", 1.0), ("ol", -1.0)):
        each, true = found[name], sign * 10.0 * QUARTER
        assert abs(each.value - true) <= each.error <= accuracy * abs(true)
        assert abs(each.value - 1.03 * true) > each.error


def test_parts_add_up_and_the_later_of_two_values_takes_all():
    areas = [np.array([1.0, 2.0, 0.0, 0.0]), np.array([0.0, 1.0, 1.0, 0.0]), np.array([0.0, 0.0, 3.0, 0.0])]
    flat = np.ones(4, dtype=bool)
    one, two, three = parts_of_reactions(areas, [300.0, 300.0, 300.0], flat)
    assert np.allclose(one + two + three, [1, 1, 1, 0])
    assert np.allclose(one, [1, 2 / 3, 0, 0])
    assert np.allclose(three, [0, 0, 0.75, 0])
    bent, _, _ = parts_of_reactions(areas, [300.0, 300.0, 300.0], ~flat)
    assert bent[1] == pytest.approx(2 ** (2 / 3) / (2 ** (2 / 3) + 1))
    first, second, _ = parts_of_reactions(areas, [300.0, 310.0, 300.0], flat)
    assert first[1] == 0.0
    assert second[1] == 1.0


def test_two_halves_of_one_face_share_a_uniform_flow_by_their_areas():
    """Whatever the intervals: the parts are exact where the flux is uniform, and nothing is disputed in one plane."""
    boundaries = (
        Boundary("left", "temperature", (0.0, 0.0, 0.0), (0.3, 1.0, 0.0), 300.0),
        Boundary("right", "temperature", (0.3, 0.0, 0.0), (1.0, 1.0, 0.0), 300.0),
        Boundary("hot", "temperature", (0.0, 0.0, 1.0), (1.0, 1.0, 1.0), 310.0),
    )
    box = Box("box", Material("k", 2.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    scene = Scene("halves", (box,), boundaries, (Probe("p", box.lower, box.upper),), 300.0)
    axes = Axis(np.array([0.0, 0.3, 1.0]), np.array([2, 4])), *(Axis(np.array([0.0, 1.0]), np.array([2])) for _ in "yz")
    heat = assemble(scene, BrickMesh(axes, scene.boxes))
    reaction = heat.reaction(heat.lifts[0], np.zeros(heat.size), np.zeros(heat.size))
    flows = {name: float(part @ reaction) for name, part in heat.held.items()}
    assert flows == pytest.approx({"left": -6.0, "right": -14.0, "hot": 20.0}, rel=1e-12)
    assert not heat.disputed(["left"]).any()
