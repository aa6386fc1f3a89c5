"""The space on bricks: polynomials of the trunk hexahedron, weak forms of scikit-fem entry by entry, extremes of its
functions against a dense sampling."""

from itertools import pairwise, product

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from skfem import Basis, BilinearForm, FacetBasis, LinearForm, MeshHex
from skfem.helpers import dot, grad

from fem3d.results.extremes import Extreme, read_extremes
from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.domain import box_domain
from fem3d.spaces.element import ElementHexTrunk, multi_indices
from fem3d.spaces.integrals import FaceIntegrals
from meshes.grid import Grid
from scenes.model import Box, Material, Probe, Scene
from scenes.sink import SILICON
from tests.fem3d import grid_of

conduction = BilinearForm(lambda u, v, w: w.conductivity * dot(grad(u), grad(v)))
capacity = BilinearForm(lambda u, v, w: w.heat_capacity * u * v)
CUBE = MeshHex.init_tensor(*3 * [np.array([0.0, 1.0])])


def trunk(p):
    """How many polynomials x^i y^j z^k the trunk space has: superlinear degree at most p (Arnold and Awanou)."""
    degrees = [[k if k > 1 else 0 for k in one] for one in product(range(p + 1), repeat=3)]
    return sum(sum(one) <= p for one in degrees)


@pytest.mark.parametrize("p", range(1, 9))
def test_element_has_functions_of_trunk_space(p):
    assert len(multi_indices(p)) == len(np.unique(multi_indices(p), axis=0)) == trunk(p)
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


STUFF = Material("stuff", 1.0, 1.0, 1.0)
BOXES = (Box("a", STUFF, (0, 0, 0), (3, 2.5, 0.8)), Box("b", STUFF, (3, 0, 0), (4, 2, 0.8)))
BREAKS = np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 2.0, 2.5]), np.array([0.0, 0.8])


@LinearForm
def integral(v, w):
    return w.density * v


@LinearForm
def flux(v, w):
    return -w.conductivity * sum(g * n for g, n in zip(v.grad, w.n, strict=True))


def space(p):
    """A step of bricks of one degree, and scikit-fem's basis on the same mesh."""
    found = BrickSpace(Grid(BREAKS, tuple(np.full(len(b) - 1, p) for b in BREAKS), BOXES))
    return found, Basis(found.mesh, ElementHexTrunk(p), intorder=2 * p + 1)


def far(ours, theirs):
    return float(abs(ours - theirs).max() / abs(theirs).max())


def differences(p, wrong=1.0):
    """Relative differences of both matrices, of a load, of integrals over some cells and of all that faces give."""
    ours, theirs = space(p)
    rng = np.random.default_rng(p)
    k, c, u = rng.random(ours.ijk.shape[1]), rng.random(ours.ijk.shape[1]), rng.random(ours.size)
    ones = np.ones(theirs.dx.shape)
    stiffness, mass = ours.matrices(wrong * k, c)
    found = {
        "stiffness": far(stiffness, conduction.assemble(theirs, conductivity=k[:, None] * ones)),
        "mass": far(mass, capacity.assemble(theirs, heat_capacity=c[:, None] * ones)),
    }
    some = np.arange(1, 4)
    part, cells = theirs.with_elements(some), ours.on(some)
    inner = np.ones(part.dx.shape)
    of_part = conduction.assemble(part, conductivity=k[some][:, None] * inner)
    found["some cells"] = far(ours.stiffness(wrong * k[some], some), of_part)
    found["flow"] = far(cells.flow(wrong * k[some][:, None] * cells.gradient(u)), of_part @ u)
    found["load"] = far(cells.load(wrong * np.ones_like(cells.weights)), integral.assemble(part, density=1.0))
    facets = ours.mesh.boundary_facets()
    faces = FaceIntegrals(ours, facets, ours.mesh.f2t[0, facets])
    there = FacetBasis(ours.mesh, theirs.elem, facets=facets, intorder=2 * p + 1)
    h = rng.random(len(facets))[:, None]
    found["face load"] = far(faces.load(wrong * h), integral.assemble(there, density=h * np.ones(there.dx.shape)))
    found["face mass"] = far(wrong * faces.mass_of(), capacity.assemble(there, heat_capacity=1.0))
    found["flux"] = far(faces.flux(wrong * h), flux.assemble(there, conductivity=h * np.ones(there.dx.shape)))
    return found


@pytest.mark.long
@pytest.mark.parametrize("p", [2, 6])
def test_matrices_and_loads_equal_weak_forms(p):
    found = differences(p)
    assert max(found.values()) < 1e-12, found


def test_changed_coefficient_is_detected():
    found = differences(3, 1 + 1e-6)
    assert found.pop("mass") < 1e-12
    assert min(found.values()) > 1e-7, found


BOX = Box("box", SILICON, (0.0, 0.0, 0.0), (2.0, 1.0, 1.0))
PROBES = [
    Probe("volume", BOX.lower, BOX.upper),
    Probe("face", (0.0, 0.0, 1.0), (2.0, 1.0, 1.0)),
    Probe("line", (0.0, 1.0, 1.0), (2.0, 1.0, 1.0)),
    Probe("point", (0.37, 0.21, 0.8), (0.37, 0.21, 0.8)),
]
SCENE = Scene("box", (BOX,), (), tuple(PROBES))


def domain(degree):
    return box_domain(SCENE, grid_of(SCENE, ([0.0, 1.0, 2.0], [0.0, 1.0], [0.0, 0.4, 1.0]), degree))


def dense(space, probe, u, count=25):
    """Values on a lattice of a probe, dense in each cell and with its faces."""
    at = []
    for d, (a, b) in enumerate(zip(probe.lower, probe.upper, strict=True)):
        inner = [x for x in space.grid.breaks[d] if a < x < b]
        ends = [a, *inner, b]
        pieces = [np.linspace(x, y, count) for x, y in pairwise(ends)]
        at.append(np.unique(np.concatenate(pieces)))
    return space.sample(u, np.array(np.meshgrid(*at, indexing="ij")))


def functions(space, count, seed, fall=0.25):
    """Random functions whose modes beyond the second fall with their degree, as in solutions."""
    found = np.random.default_rng(seed).normal(size=(count, space.size))
    of_mode = np.where(multi_indices(space.p) > 1, multi_indices(space.p), 0).sum(axis=1)
    scale = np.empty(space.size)
    scale[space.dofs] = fall ** np.maximum(of_mode - 2, 0)[:, None]
    return found * scale


@pytest.mark.long
@pytest.mark.parametrize("degree", [1, 3, 6])
@pytest.mark.parametrize("probe", PROBES, ids=lambda p: p.name)
def test_extremes_equal_dense_sampling_within_error(degree, probe):
    own = domain(degree)
    fields = functions(own.space, 12, degree + 10)
    everywhere = [dense(own.space, probe, u) for u in fields]
    for sign in (1.0, -1.0):
        (values,), (left,) = read_extremes([Extreme(own.space, own.patches(probe), sign)], fields, np.eye(12))
        sampled = np.array([sign * (sign * found).max() for found in everywhere])
        size = np.abs(sampled).max()
        assert (sign * (values - sampled) >= -left - 1e-4 * size).all()
        assert (sign * (values - sampled) <= 2e-3 * size).all()
        assert (left <= 2e-3 * size).all()
        assert (left >= 0).all()


def test_needle_intervals_beside_a_plane_are_not_on_it():
    """Grading toward an edge makes intervals below a rounding error of the scene; a probe has its plane alone."""
    box, probe = Box("bar", SILICON, (0, 0, 0), (1e-4, 1e-4, 1e-4)), Probe("p", (0, 0, 0), (1e-4, 1e-4, 0))
    breaks = np.array([0.0, 5e-14, 1e-12, 1e-4])
    grid = Grid((breaks, breaks, breaks), (np.ones(3, int),) * 3, (box,))
    flat = box_domain(Scene("bar", (box,), (), (probe,)), grid)
    assert len(flat.locate(probe).numbers) == 9
    assert (flat.locate(probe).signs == -1).all()
