"""A row of spans in 3D, against the second path on one mesh, and its balance of heat."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.runs import sink as sink_run
from meshes import symmetry
from scenes.sink import Sink
from tests.fem3d import plain_grid, state_on
from validate.verify import newton, second_path

PAIR = Sink(spans=2, convection_coefficient=100.0)


def difference(sink: Sink, other: Sink) -> float:
    """Return the largest relative difference of the rises of a row and those of another one by the second path."""
    part = symmetry.reduce(other.scene())
    grid = plain_grid(part.scene, 1)
    scene = replace(part.scene, probes=tuple(p for p in part.scene.probes if p.reduce == "mean"))
    basis, *owner_order = second_path.base(scene, grid)
    problem = second_path.problem(scene, basis, *owner_order)
    means = second_path.readings(scene, basis, newton.steady(problem))
    row = symmetry.reduce(sink.scene())
    _, found = state_on(sink, plain_grid(row.scene, 1), row)
    off = [found[f"{name}_rise_K"] / (value - problem.start) - 1 for name, value in means.items()]
    return float(np.abs(off).max())


@pytest.mark.parametrize("sink", [PAIR, Sink(spans=3, length=400e-6, convection_coefficient=10.0)])
def test_row_agrees_with_second_path(sink):
    assert difference(sink, sink) < 1e-9
    assert difference(replace(sink, island_length=45e-6), sink) > 1e-3


@pytest.mark.long
def test_spans_and_islands_carry_all_heat():
    """Every watt leaves through an anchor or an island."""
    for spans in (2, 3, 20):
        found = sink_run.solve(Sink(spans=spans, accuracy=1e-2), False)
        value = {name: e.value for name, e in found.steady.items()}
        islands = [value[f"island{min(k, spans - k)}_heat_W"] for k in range(1, spans)]
        assert 2 * value["anchor_heat_W"] + sum(islands) == pytest.approx(value["heat_out_W"], rel=1e-12)
        assert value["heat_out_W"] == pytest.approx(value["power_W"], rel=1e-3)
        assert found.details["energy_imbalance"] < 1e-9


def test_ends_of_row_are_like_those_of_one_span():
    """An anchor resistance is the anchor's own, whatever heat passes."""
    one, row_of_three = (sink_run.solve(Sink(spans=n, accuracy=1e-2), False).steady for n in (1, 3))
    name = "anchor_resistance_K_per_W"
    assert row_of_three[name].value == pytest.approx(one[name].value, rel=1e-3)
