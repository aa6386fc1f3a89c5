"""The trunk hexahedron: its functions, its matrices against the weak forms, and the spaces of lower degrees in it."""

from itertools import product

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from skfem import Basis, ElementHexS2, MeshHex

from fem3d.spaces import forms
from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.element import ElementHexTrunk, active, heights, line, local, modes
from meshes.grid import Grid
from scenes.model import Box
from scenes.sink import SILICON

CUBE = MeshHex.init_tensor(*3 * [np.array([0.0, 1.0])])
KINDS = [(4, 4, 4), (5, 2, 3), (2, 3, 6), (1, 1, 4), (6, 6, 2)]


def trunk(p):
    """How many polynomials x^i y^j z^k the trunk space has: superlinear degree at most p (Arnold and Awanou)."""
    degrees = [[k if k > 1 else 0 for k in one] for one in product(range(p + 1), repeat=3)]
    return sum(sum(one) <= p for one in degrees)


@pytest.mark.parametrize("p", range(1, 9))
def test_it_has_the_functions_of_the_trunk_space_and_scikit_fem_counts_the_same(p):
    assert len(modes(p)) == len(np.unique(modes(p), axis=0)) == trunk(p)
    assert trunk(p) == Basis(CUBE, ElementHexTrunk(p), intorder=1).N


@pytest.mark.parametrize("p", range(1, 9))
def test_a_patch_of_unequal_bricks_holds_every_polynomial_of_the_degree_and_not_the_next(p):
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


def test_degree_2_spans_what_scikit_fem_s_serendipity_element_spans():
    rng = np.random.default_rng(3)
    points = rng.random((3, 40))
    ours, theirs = ElementHexTrunk(2), ElementHexS2()
    a = np.array([ours.lbasis(points, i)[0] for i in range(20)])
    b = np.array([theirs.lbasis(points, i)[0] for i in range(20)])
    assert np.linalg.matrix_rank(np.concatenate([a, b]), tol=1e-10) == 20
    assert np.linalg.matrix_rank(np.concatenate([a, b[:, ::-1]]), tol=1e-10) > 20


@pytest.mark.parametrize("p", [1, 3, 6])
def test_slopes_are_those_of_the_values(p):
    element, x, step = ElementHexTrunk(p), np.random.default_rng(1).random((3, 5)), 1e-6
    for i in range(len(modes(p))):
        _, slope = element.lbasis(x, i)
        for d in range(3):
            move = step * np.eye(3)[:, [d]]
            difference = (element.lbasis(x + move, i)[0] - element.lbasis(x - move, i)[0]) / (2 * step)
            assert np.abs(difference - slope[d]).max() < 1e-7


def reference(p, degrees):
    """(4, functions, functions): the matrices that `local` stands for."""
    one = local(p, degrees)
    found = np.zeros((4, len(modes(p)), len(modes(p))))
    found[:, one.rows, one.columns] = one.entries
    return found


@pytest.mark.parametrize("p", [1, 2, 4, 6])
def test_reference_matrices_are_those_of_the_forms(p):
    basis = Basis(CUBE, ElementHexTrunk(p), intorder=2 * p + 1)
    to, shape = basis.element_dofs[:, 0], basis.dx.shape
    stiffness = forms.conduction.assemble(basis, conductivity=np.ones(shape)).toarray()[np.ix_(to, to)]
    mass = forms.capacity.assemble(basis, heat_capacity=np.ones(shape)).toarray()[np.ix_(to, to)]
    ours = reference(p, (p, p, p))
    assert np.abs(ours[:3].sum(axis=0) - stiffness).max() < 1e-13 * np.abs(stiffness).max()
    assert np.abs(ours[3] - mass).max() < 1e-13 * np.abs(mass).max()
    assert np.abs(1.0001 * ours[0] + ours[1] + ours[2] - stiffness).max() > 1e-6


@pytest.mark.parametrize("degrees", KINDS)
def test_lower_degrees_leave_functions_out_and_nothing_else(degrees):
    p = max(degrees)
    there = active(p, degrees)
    assert there[:8].all()
    lower = [tuple(max(d - k, 1) for d in degrees) for k in (1, 2)]
    one, two = (active(p, d) for d in lower)
    assert (two <= one).all()
    assert (one <= there).all()
    assert two.sum() < there.sum()
    assert np.abs(reference(p, degrees) - reference(p, (p, p, p)) * np.outer(there, there)).max() < 1e-15
    # Of every degree along an axis all powers of that coordinate alone.
    for d, q in enumerate(degrees):
        alone = np.delete(modes(p), d, axis=1).max(axis=1) < 2
        assert (there[alone] == (modes(p)[alone, d] <= q)).all()


@pytest.mark.parametrize("degrees", KINDS)
def test_functions_that_two_bricks_share_are_there_in_both_or_in_none(degrees):
    """Bricks that meet in a facet have the same intervals along it, whatever their degrees across: the quadrature there
    must not depend on these."""
    p, others = 7, range(1, 8)
    for d in range(3):
        shared = modes(p)[:, d] < 2
        found = [active(p, (*degrees[:d], q, *degrees[d + 1 :]))[shared] for q in others]
        assert (np.array(found) == found[0]).all()


def test_lines_are_hierarchic_and_vanish_at_the_ends():
    values, slopes = line(6, np.array([0.0, 1.0]))
    assert np.abs(values - np.eye(7)[:, :2]).max() < 1e-15
    assert np.abs(slopes[2:]).min() > 0.1
    assert np.abs(line(6, np.array([0.3]))[0][:5] - line(4, np.array([0.3]))[0]).max() == 0.0


@pytest.mark.parametrize("p", [2, 5, 8])
def test_no_field_passes_its_ceiling_and_one_function_touches_it(p):
    x = np.linspace(0, 1, 60)
    tables = line(p, x)[0]
    for height, (i, j, k) in zip(heights(p), modes(p)[8:], strict=True):
        largest = abs(tables[i]).max() * abs(tables[j]).max() * abs(tables[k]).max()
        assert 0.99 * height <= largest <= height * (1 + 1e-12)
    breaks = np.array([0.0, 0.4, 1.0]), np.array([0.0, 0.7, 1.0]), np.array([0.0, 0.3, 1.0])
    box = Box("box", SILICON, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    space = BrickSpace(Grid(breaks, tuple(np.full(2, p) for _ in "xyz"), (box,)))
    grid = [np.linspace(b[0], b[-1], 41) for b in space.grid.breaks]
    for u in np.random.default_rng(p).normal(size=(5, space.size)):
        assert space.sample(u, *grid).max() <= space.ceiling(u)
    assert space.ceiling(space.unit) == pytest.approx(space.sample(space.unit, *grid).max(), abs=1e-12)
