"""The quarter of a sink against the whole on the mirrored mesh."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.results import outputs
from meshes import symmetry
from scenes.sink import Sink
from tests.fem3d import krylov, march, off, plain_grid, silicon, state_on, steady_on, whole

SINKS = [
    Sink(voltage=8.0, convection_coefficient=200.0),
    Sink(voltage=-5.0, electrodes="pad-edge", room_temperature=280.0),
    Sink(voltage=4.0, silicon=silicon(-5e-4), oxide_offset=20e-6),
]


@pytest.mark.parametrize("sink", SINKS)
def test_every_output_of_the_quarter_is_that_of_the_whole(sink):
    scene = sink.scene()
    part = symmetry.reduce(scene)
    assert part.copies == 4
    middles = ((0, 0.0), (1, sink.length / 2))
    # Both halves of a mirrored interval, cut alike.
    quarter = plain_grid(part.scene)
    both = plain_grid(scene, also=middles)
    assert both.solid.sum() == 4 * quarter.solid.sum()
    few, ours = state_on(sink, quarter, part)
    all_of_it, theirs = state_on(sink, both, whole(scene))
    assert max(off(ours[q], theirs[q]) for q in ours) < 1e-9
    first, second = outputs.of_steady(few, part), outputs.of_steady(all_of_it, whole(scene))
    # Boxes on the other side of a plane have no heat of their own in the part.
    assert {name for name in second if name not in first} <= {"joule:pad-1"}
    assert max(off(first[name], second[name]) for name in first if name not in ("generated", "time")) < 1e-8
    assert first["generated"] == second["generated"] == 0


def test_every_trace_of_the_quarter_is_that_of_the_whole():
    sink, times = SINKS[0], np.geomspace(1e-5, 0.02, 20)
    found = []
    for part in (symmetry.reduce(sink.scene()), whole(sink.scene())):
        grid = plain_grid(part.scene, also=((0, 0.0), (1, sink.length / 2)) if part.copies == 1 else ())
        state = steady_on(part.scene, grid, sink.voltage)
        # Enough fields for their space to be the same, although fields of the coupled iteration hardly differ.
        space = krylov(state, 20, 2e-4)
        answer = march(state, space, 0.02, 1e-8)
        out = outputs.of_transient(answer, part, times)
        stored = outputs.stored_heat(answer, part, times)
        found.append({**out, "stored": stored})
    quarter, all_of_it = found
    assert set(quarter) == set(all_of_it)
    assert max(off(quarter[name], all_of_it[name]) for name in quarter if name != "generated") < 1e-7
    assert not quarter["generated"].any()
    assert not all_of_it["generated"].any()


def test_a_wrong_count_of_copies_is_seen():
    sink = SINKS[0]
    part = symmetry.reduce(sink.scene())
    _, right = state_on(sink, plain_grid(part.scene), part)
    _, wrong = state_on(sink, plain_grid(part.scene), replace(part, copies=2))
    assert off(wrong["power_W"], right["power_W"]) > 0.4


def test_unequal_voltages_are_reduced_too_and_keep_their_current():
    scene = Sink(voltage=3.0).scene()
    moved = replace(scene, boundaries=tuple(
        replace(b, value=b.value + 2.0) if b.kind == "voltage" else b for b in scene.boundaries
    ))  # fmt: skip
    currents = []
    for s in (scene, moved):
        part = symmetry.reduce(s)
        state = steady_on(part.scene, plain_grid(part.scene), 3.0)
        currents.append(outputs.of_steady(state, part))
    assert off(currents[1]["current:electrode-0"], currents[0]["current:electrode-0"]) < 1e-10
    assert off(currents[1]["power"], currents[0]["power"]) < 1e-10
