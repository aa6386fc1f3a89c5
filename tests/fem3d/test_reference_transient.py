"""Krylov fields of a transient, and the current patterns on its way."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.results import outputs
from fem3d.solution.reduced import orthonormal
from meshes import grading, symmetry
from scenes.sink import Sink
from tests.fem3d import krylov, march, steady_on

TIMES = 1e-5 * 2.0 ** np.arange(9)


def read(answer, part):
    out = outputs.of_transient(answer, part, TIMES)
    return np.stack([*(out[f"probe:{name}"] for name in ("peak", "end", "mean")), out["current:electrode-0"]], axis=1)


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
