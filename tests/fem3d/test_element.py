"""The trunk hexahedron: the number of its functions, the polynomials that it holds, and its gradients."""

from itertools import product

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from skfem import Basis, MeshHex

from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.element import ElementHexTrunk, modes
from meshes.grid import Grid
from scenes.model import Box
from scenes.sink import SILICON

CUBE = MeshHex.init_tensor(*3 * [np.array([0.0, 1.0])])


def trunk(p):
    """How many polynomials x^i y^j z^k the trunk space has: superlinear degree at most p (Arnold and Awanou)."""
    degrees = [[k if k > 1 else 0 for k in one] for one in product(range(p + 1), repeat=3)]
    return sum(sum(one) <= p for one in degrees)


@pytest.mark.parametrize("p", range(1, 9))
def test_element_has_functions_of_trunk_space(p):
    assert len(modes(p)) == len(np.unique(modes(p), axis=0)) == trunk(p)
    assert trunk(p) == Basis(CUBE, ElementHexTrunk(p), intorder=1).N


@pytest.mark.parametrize("p", range(1, 9))
def test_patch_holds_polynomials_of_its_degree_only(p):
    """Odd functions of neighbours must match: a projection that is wrong on one brick shows on both."""
    breaks = np.array([0.0, 0.4, 1.0]), np.array([0.0, 0.7, 1.0]), np.array([0.0, 0.3, 1.0])
    box = Box("box", SILICON, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    space = BrickSpace(Grid(breaks, tuple(np.full(2, p) for _ in "xyz"), (box,)))
    cells = space.on(np.arange(8), more=1)
    x, y, z = cells.points
    mass = space.matrices(np.ones(8), np.ones(8))[1]

    def missed(q):
        exact = (x - 0.3 * y + 0.6 * z + 0.2) ** q
        return float(np.abs(cells.value(spsolve(mass, cells.load(exact))) - exact).max())

    assert missed(p) < 1e-10
    assert missed(p + 1) > 1e-6


@pytest.mark.parametrize("p", [1, 3, 6])
def test_slopes_are_those_of_the_values(p):
    element, x, step = ElementHexTrunk(p), np.random.default_rng(1).random((3, 5)), 1e-6
    for i in range(len(modes(p))):
        _, slope = element.lbasis(x, i)
        for d in range(3):
            move = step * np.eye(3)[:, [d]]
            difference = (element.lbasis(x + move, i)[0] - element.lbasis(x - move, i)[0]) / (2 * step)
            assert np.abs(difference - slope[d]).max() < 1e-7
