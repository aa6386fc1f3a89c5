"""Boundaries of one value that meet: each has its part of the flow at shared nodes."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.problems.reactions import SharedReactions
from fem3d.runs import scene as scene_run
from scenes.free import from_dict
from scenes.model import Boundary, Box, Material, Probe, Scene
from tests.fem3d import grid_of, problem

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
def test_a_side_of_a_duct_has_a_quarter_of_its_heat(accuracy):
    """At its inner edges, re-entrant for the wall, the flux has no bound."""
    found = scene_run.solve(replace(duct(), accuracy=accuracy)).steady
    for name, sign in (("il", 1.0), ("ol", -1.0)):
        each, true = found[name], sign * 10.0 * QUARTER
        assert abs(each.value - true) <= each.error <= accuracy * abs(true)
        assert abs(each.value - 1.03 * true) > each.error


BOX = Box("box", Material("k", 2.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
BREAKS = [0.0, 0.3, 1.0], [0.0, 1.0], [0.0, 1.0]


def split(right=300.0, also=()):
    """A slab whose cold face is two boundaries, hot at the other one."""
    boundaries = (
        Boundary("left", "temperature", (0.0, 0.0, 0.0), (0.3, 1.0, 0.0), 300.0),
        Boundary("right", "temperature", (0.3, 0.0, 0.0), (1.0, 1.0, 0.0), right),
        Boundary("hot", "temperature", (0.0, 0.0, 1.0), (1.0, 1.0, 1.0), 310.0),
    )
    return Scene("halves", (BOX,), (*boundaries, *also), (Probe("p", BOX.lower, BOX.upper),), 300.0)


def flows(heat, rise):
    reaction = heat.reaction(rise, np.zeros(heat.size), np.zeros(heat.size))
    return {name: float(part @ reaction) for name, part in heat.held.items()}, reaction


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 6])
def test_two_halves_of_one_face_share_a_uniform_flow_by_their_areas(degree):
    """Whatever the intervals and the degree: the parts are exact where the flux is uniform, and nothing is disputed in
    one plane."""
    scene = split()
    heat = problem(scene, grid_of(scene, BREAKS, degree))
    found, _ = flows(heat, heat.lifts[0])
    assert found == pytest.approx({"left": -6.0, "right": -14.0, "hot": 20.0}, rel=1e-11)
    assert not heat.disputed(["left"]).any()
    moved = problem(scene, grid_of(scene, ([0.0, 0.31, 1.0], *BREAKS[1:]), degree))
    assert flows(moved, moved.lifts[0])[0]["left"] != pytest.approx(-6.0, rel=1e-3)


def test_parts_add_up_to_the_whole_and_the_later_of_two_values_takes_all():
    scene = split()
    heat = problem(scene, grid_of(scene, BREAKS, 4))
    # Of any reaction, not of a uniform one alone.
    rise = np.random.default_rng(0).random(heat.size)
    found, _ = flows(heat, rise)
    cold = np.flatnonzero(heat.held["left"] + heat.held["right"] > 1e-12)
    face = replace(scene.boundaries[0], upper=(1.0, 1.0, 0.0))
    alone = problem(replace(scene, boundaries=(face, scene.boundaries[2])), grid_of(scene, BREAKS, 4))
    whole, _ = flows(alone, rise)
    assert found["left"] + found["right"] == pytest.approx(whole["left"], rel=1e-9)
    assert found["hot"] == pytest.approx(whole["hot"], rel=1e-12)
    assert abs(found["left"] - 0.3 * whole["left"]) > 1e-3 * abs(whole["left"])
    assert len(cold) > 4
    other = split(305.0)
    heat = problem(other, grid_of(other, BREAKS, 1))
    at_edge = np.flatnonzero((heat.held["left"] > 0) | (heat.held["right"] > 0))
    left, right = heat.held["left"][at_edge], heat.held["right"][at_edge]
    # Two corners of the left one, and the edge with corners of the right one.
    assert sorted(left.tolist()) == [0, 0, 0, 0, 1, 1]
    assert (left + right).tolist() == [1] * 6
    assert sorted(heat.given[0][at_edge].tolist()) == [0, 0, 5, 5, 5, 5]


def test_boundaries_that_meet_at_an_angle_are_in_doubt_and_still_add_up():
    side = Boundary("side", "temperature", (0.0, 0.0, 0.0), (0.0, 1.0, 1.0), 300.0)
    scene = split(also=(side,))
    scene = replace(scene, boundaries=tuple(b for b in scene.boundaries if b.name != "hot"))
    heat = problem(scene, grid_of(scene, BREAKS, 3))
    assert (heat.disputed(["side"]) > 0).any()
    assert (heat.disputed(["left"]) > 0).any()
    assert not heat.disputed(["right"]).any()
    assert not heat.disputed(["left", "right", "side"]).any()
    together = sum(heat.held.values())
    unit = heat.unit[heat.free :]
    assert np.abs(together[unit == 1] - 1).max() < 1e-12


def test_a_boundary_that_touches_no_other_takes_the_whole():
    space = problem(split(), grid_of(split(), BREAKS, 2)).domain
    hot = [b for b in space.scene.boundaries if b.name == "hot"]
    reactions = SharedReactions.of(["hot"], [310.0], [space.faces(hot[0])], space.space.unit)
    parts, edges = reactions.shares, reactions.edges
    assert set(parts["hot"].tolist()) == {0.0, 1.0}
    assert not edges.nnz
