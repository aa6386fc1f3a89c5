"""Krylov fields with exponential steps against full-order implicit stepping on the same mesh."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from fem3d.results import outputs
from fem3d.solution.reduced import orthonormal
from meshes import grading, symmetry
from scenes.sink import SILICON, Sink
from tests.fem3d import krylov, march, plain_grid, silicon, state_on, steady_on
from tests.fem3d.second_path import quantities
from validate.verify import reference

OCTAVES = 9
QUANTITIES = ("peak", "end", "mean")
SINKS = [
    Sink(),
    Sink(voltage=2.0, electrodes="pad-edge", convection_coefficient=300.0, silicon=silicon(-5e-4)),
    Sink(voltage=8.0, silicon=silicon(0.0), substrate_thickness=2e-5, substrate_length=1.4e-3, substrate_width=2e-4),
]


def times(pieces):
    """Intervals that double in length from 10 us on, in equal steps."""
    edges = np.concatenate([[0.0], 1e-5 * 2.0 ** np.arange(OCTAVES)])
    steps = np.arange(1, pieces + 1) / pieces
    return np.concatenate([[0.0], *(a + (b - a) * steps for a, b in pairwise(edges))])


def grid_of(sink):
    return plain_grid(symmetry.reduce(sink.scene()).scene, degree=1)


@cache
def stepped(sink, pieces):
    """(OCTAVES, 4): peak, end and mean rise and current at the ends of the intervals."""
    part = symmetry.reduce(sink.scene())
    full = reference.assemble(part.scene, grid_of(sink))
    marched = reference.transient(full, times(pieces))[pieces::pieces]
    found = [quantities(sink, part, full, *state) for state in marched]
    return np.array([[*(q[f"{name}_rise_K"] for name in QUANTITIES), q["current_A"]] for q in found], dtype=float)


def read(answer, part):
    out = outputs.of_transient(answer, part, times(1)[1:])
    return np.stack([*(out[f"probe:{name}"] for name in QUANTITIES), out["current:electrode-0"]], axis=1)


def exponential(sink, grid, fields=20):
    """(OCTAVES, 4) the same in the reduced space, and (4,) the steady values."""
    part = symmetry.reduce(sink.scene())
    state, values = state_on(sink, grid, part)
    space = krylov(state, fields)
    answer = march(state, space, times(1)[-1], 1e-9)
    scale = [*(values[f"{name}_rise_K"] for name in QUANTITIES), values["current_A"]]
    return read(answer, part), np.abs(np.array(scale, dtype=float))


@pytest.mark.long
@pytest.mark.parametrize(("sink", "pieces"), list(zip(SINKS, (1, 2, 1), strict=True)))
def test_agrees_within_the_error_of_the_stepping_which_falls_at_its_order(sink, pieces):
    ours, scale = exponential(sink, grid_of(sink))
    coarse, fine = (np.abs((stepped(sink, n) - ours) / scale).max() for n in (pieces, 2 * pieces))
    assert fine < 2e-4 * (2 / pieces) ** 3
    assert 2.6 < np.log2(coarse / fine) < 3.4  # the method's order is 3


@pytest.mark.long
def test_a_heat_capacity_off_by_a_part_in_a_hundred_is_seen():
    sink = SINKS[1]
    twin = replace(sink, silicon=replace(sink.silicon, specific_heat=1.01 * SILICON.specific_heat))
    ours, scale = exponential(twin, grid_of(twin))
    assert np.abs((stepped(sink, 4) - ours) / scale).max() > 1e-3


def first_grid(scene, accuracy):
    return grading.first_grid(scene, accuracy, grading.features(scene))


def marched(state, fields):
    return march(state, fields, 0.02, 1e-8)


@pytest.mark.parametrize("electrodes", ["beam-end", "pad-edge"])
def test_two_current_patterns_are_enough_on_the_way_from_cold_to_hot(electrodes):
    sink = Sink(voltage=10.0, electrodes=electrodes)
    part = symmetry.reduce(sink.scene())
    state = steady_on(part.scene, first_grid(part.scene, 1e-3), sink.voltage, 1e-12)
    fields = krylov(state, 12)
    two = marched(state, fields)
    conductor = state.conductor
    extra = conductor.pattern(conductor.solve(two.rises(np.array([2e-4]))[0], conductor.voltages[0]))

    def product(a, b):
        return conductor.product(a.density, b.density)

    for _ in range(2):
        for known in state.patterns:
            extra = extra.plus(-product(known, extra) / product(known, known), known, 1.0)
    extra = extra.plus(0.0, extra, np.sqrt(product(state.patterns[0], state.patterns[0]) / product(extra, extra)))
    three, one = (marched(replace(state, patterns=p), fields) for p in ([*state.patterns, extra], state.patterns[:1]))
    final = np.abs(read(two, part)[-1])
    change = np.abs((read(three, part) - read(two, part)) / final).max()
    assert change < 5e-6
    one_less = np.abs((read(one, part) - read(two, part)) / final).max()
    assert one_less > 2 * change or electrodes == "beam-end"


def test_the_reduced_space_is_orthonormal_to_rounding_and_loses_no_field():
    sink = Sink(voltage=10.0)
    part = symmetry.reduce(sink.scene())
    state = steady_on(part.scene, first_grid(part.scene, 1e-2), sink.voltage, 1e-12)
    fields = krylov(state, 24)
    basis = orthonormal(state.heat, fields)
    gram = basis.T @ (state.heat.inner_mass @ basis)
    assert np.abs(gram - np.eye(len(gram))).max() < 1e-13
    assert basis.shape[1] >= 24
    doubled = orthonormal(state.heat, np.column_stack([fields, fields[:, :5], 0 * fields[:, :1]]))
    assert doubled.shape == basis.shape
