"""Piecewise polynomials on a line: reproduction, integrals and interpolation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshes.axis import Axis

AXIS = Axis(np.array([0.0, 0.1, 0.5, 2.0]), np.array([1, 3, 5]))


def test_nodes_are_shared_between_intervals():
    assert AXIS.size == 10
    assert AXIS.offsets.tolist() == [0, 1, 4, 9]
    assert (np.diff(AXIS.nodes) > 0).all()
    assert np.abs(AXIS.nodes[AXIS.offsets] - AXIS.breaks).max() == 0


def test_interpolation_is_the_identity_at_nodes_and_exact_for_what_the_degrees_hold():
    assert np.abs(AXIS.interpolation(AXIS.nodes) - np.eye(AXIS.size)).max() < 1e-13
    x = np.linspace(0, 2, 41)
    assert np.abs(AXIS.interpolation(x) @ (3 * AXIS.nodes + 1) - (3 * x + 1)).max() < 1e-13
    late = x[x >= 0.5]
    assert np.abs(AXIS.interpolation(late) @ AXIS.nodes**5 - late**5).max() < 1e-12
    assert np.abs(AXIS.interpolation(late) @ AXIS.nodes**6 - late**6).max() > 1e-3


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(st.floats(0.01, 10.0), st.integers(1, 8)), min_size=1, max_size=5))
def test_mass_and_stiffness_integrate_what_the_degrees_hold(intervals):
    axis = Axis(np.cumsum([0.0] + [h for h, _ in intervals]), np.array([p for _, p in intervals]))
    part, length = axis.part(0, len(intervals)), axis.breaks[-1]
    mass, stiffness = np.zeros((2, axis.size, axis.size))
    mass[part.rows, part.columns], stiffness[part.rows, part.columns] = part.mass, part.stiffness
    x = axis.nodes
    assert abs(x @ mass @ x / (length**3 / 3) - 1) < 1e-11
    assert abs(x @ stiffness @ x / length - 1) < 1e-10
    assert np.abs(stiffness @ np.ones(axis.size)).max() < 1e-10 * np.abs(stiffness).max()
    assert abs(part.integral @ x / (length**2 / 2) - 1) < 1e-12


def test_an_empty_part_is_its_breakpoint():
    part = AXIS.part(2, 2)
    assert part.node_slice == slice(4, 5)
    assert part.shape == (1, 1)
    assert part.mass.tolist() == [1.0]
    assert part.stiffness.tolist() == [0.0]


def test_a_coordinate_between_breakpoints_is_refused():
    assert AXIS.at(0.5 + 1e-6) == 2
    with pytest.raises(ValueError, match=r"no breakpoint at 0\.3"):
        AXIS.at(0.3)
