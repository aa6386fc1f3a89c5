"""Nested polynomial spaces on the cells of scikit-fem's meshes, straight or curved, and jumps across facets.

Tetrahedra have degree 3, or 2 where memory is short, and hexahedra degree 2; each space contains all lower degrees. The
vertex functions have degree 1. On a tetrahedron with barycentric coordinates l_i an edge from a to b adds
4 l_a l_b of degree 2 and l_a l_b (l_b - l_a) of degree 3, a face 27 l_a l_b l_c of degree 3 (Szabo and Babuska, Finite
Element Analysis, 1991). The odd function needs one direction of each edge in all of its cells, so vertices of cells are
in ascending order. Hexahedra have the products of three functions of degree 2 of one coordinate each.

Where functions jump across a facet, each side has its own. A vertex, edge or facet on a contact has one function of
each kind for every set of its cells that hang together by facets without a contact. So at the rim of a contact that
ends inside the solid both sides share functions: around the rim all cells hang together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import TypeVar

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components
from skfem import ElementHex2, Mesh
from skfem.assembly.dofs import Dofs
from skfem.element import Element
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex, RefTet

from fem3d.spaces.element import Rule, Side, gauss, make_rule, make_side, multi_indices, shape_functions
from fem3d.spaces.integrals import FaceIntegrals, Space, entities
from fem3d.spaces.sparse import Entries, sum_entries

_EDGES, _FACES = np.array(RefTet.edges), np.array(RefTet.facets)
S = TypeVar("S", bound=Space)
Kind = tuple[bool, int]
"""Whether cells are tetrahedra, and their degree."""


class TetDofs(Element):
    """The numbers of functions of a tetrahedron of degree 2 or 3."""

    refdom, nodal_dofs, interior_dofs = RefTet, 1, 0

    def __init__(self, degree: int) -> None:
        self.edge_dofs, self.facet_dofs = degree - 1, degree - 2


class MappedSpace(Space):
    """The space on scikit-fem's ``mesh``; the vertices of tetrahedra are in ascending order."""

    def __init__(self, mesh: Mesh, degree: int = 3) -> None:
        simplex = len(mesh.t) == 4
        self.mesh, self.p = mesh, degree if simplex else 2
        self._kind: Kind = simplex, self.p
        self.numbering = Dofs(mesh, TetDofs(degree) if simplex else ElementHex2())
        self.dofs, self.size = self.numbering.element_dofs, int(self.numbering.N)
        self.entity, self.places = entities(mesh, self.numbering, mesh.doflocs[:, : mesh.nvertices])

    @cached_property
    def depth(self) -> np.ndarray:
        """(functions,): the highest degree less each function's degree; more than any degree for vertices."""
        depth = np.zeros(int(self.numbering.N), int)
        depth[self.numbering.nodal_dofs] = self.p + 1
        if self._kind == (True, 3):
            depth[self.numbering.edge_dofs[0]] = 1
        return depth[self.origin]

    def energies(self, k: np.ndarray, c: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Divide the energy among the axes in proportion to the products of the slopes along them."""
        on = self.on(np.arange(self.dofs.shape[1]))
        flux, stored = np.asarray(k)[..., None] * on.weights * on.gradient(u), c[:, None] * on.weights * on.value(u)
        energies = np.empty((len(v), 3, len(on.weights)))
        for energy, each in zip(energies, v, strict=True):
            along = (flux * on.gradient(each)).sum(axis=2)
            sizes, whole = np.abs(along), along.sum(axis=0) + (stored * on.value(each)).sum(axis=1)
            total = sizes.sum(axis=0)
            energy[:] = whole * np.where(total > 0, sizes / np.maximum(total, 1e-300), 1 / 3)
        return energies

    def _entries(self, cells: np.ndarray, k: np.ndarray, c: np.ndarray) -> list[Entries]:
        k, at = np.broadcast_to(k, (3, len(cells))), self.rule(cells, 0)
        u, v = np.triu_indices(len(self.dofs))
        stiff = np.einsum("p,ipn,jpn->pijn", at.weights, at.slopes[..., u], at.slopes[..., v])
        mass = np.einsum("p,pn,pn->pn", at.weights, at.values[:, u], at.values[:, v])
        points = at.points
        if self.mesh.affine:  # the map's derivative is the same at all points
            stiff, mass, points = stiff.sum(axis=0), mass.sum(axis=0), points[:, :1]
        blocks = np.empty((2, len(cells), len(u)))
        step = 2_000  # cells together, which bounds the memory
        for some in (slice(i, i + step) for i in range(0, len(cells), step)):
            inverse, sizes = self.jacobian(cells[some], points)
            metric = np.einsum("iacp,jacp,ac,cp->cpij", inverse, inverse, k[:, some], sizes)
            blocks[0, some] = metric.reshape(len(sizes), -1) @ stiff.reshape(-1, len(u))
            blocks[1, some] = c[some, None] * (sizes @ mass.reshape(-1, len(u)))
        blocks[..., u == v] /= 2
        dofs = self.dofs[:, cells].T.astype(np.int32)
        return [(blocks.reshape(2, -1), dofs[:, u].ravel(), dofs[:, v].ravel())]

    def rule(self, cells: np.ndarray, more: int) -> Rule:
        """scikit-fem's rule of `_order`, and two orders more for each point."""
        return _rule(self._kind, _order(self._kind) + 2 * more)

    def side(self, number: int, more: int) -> Side:
        return _side(self._kind, number, more)

    def jacobian(self, cells: np.ndarray, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mapping = self.mesh.mapping()
        return mapping.invDF(X, tind=cells), np.abs(mapping.detDF(X, tind=cells))

    def at(self, X: np.ndarray, along: int | None = None) -> np.ndarray:
        return _values(self._kind, X, along)


def _order(kind: Kind) -> int:
    """Return the quadrature order: exact for the mass matrix; on hexahedra one more for a coefficient."""
    return 2 * kind[1] + (not kind[0])


def _values(kind: Kind, X: np.ndarray, along: int | None = None) -> np.ndarray:
    """(points, functions): values at reference points (3, points), or slopes along an axis."""
    if not kind[0]:
        return shape_functions(multi_indices(2, full=True), X, along)
    corner = np.stack([1 - X.sum(axis=0), *X])
    slope = np.zeros(4) if along is None else np.array([-1.0, *np.eye(3)[along]])

    def product(*factors: int) -> np.ndarray:
        if along is None:
            return np.prod(corner[list(factors)], axis=0)
        others = (np.prod(corner[[*factors[:i], *factors[i + 1 :]]], axis=0) for i in range(len(factors)))
        return sum((slope[f] * other for f, other in zip(factors, others, strict=True)), np.zeros(X.shape[1]))

    values = [product(a) for a in range(4)]
    for a, b in _EDGES.tolist():
        values += [4 * product(a, b), product(a, b, b) - product(a, a, b)][: kind[1] - 1]
    faces = _FACES.tolist() if kind[1] == 3 else []
    return np.array([*values, *(27 * product(*face) for face in faces)]).T


@lru_cache
def _rule(kind: Kind, order: int) -> Rule:
    points, weights = _collapsed(order) if kind[0] else get_quadrature(RefHex, order)
    return make_rule(points, weights, partial(_values, kind))


def _collapsed(order: int, axes: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """scikit-fem's rule of the tetrahedron, or triangle; beyond its highest order the rule of a collapsed cube, or
    square (Stroud, Approximate Calculation of Multiple Integrals, 1971, section 2.4). From the fifth on, its rules of
    the tetrahedron are exact to one order less than stated."""
    if order <= (8 if axes == 3 else 19):
        return get_quadrature(RefTet, order + (order >= 5)) if axes == 3 else get_quadrature(RefTet.brefdom, order)
    x, w = gauss(order // 2 + 2)
    points, room = np.empty((axes, len(x) ** axes)), np.ones(len(x) ** axes)
    weights: np.ndarray = np.prod(np.meshgrid(*axes * [w], indexing="ij"), axis=0).ravel()
    for d, along in enumerate(np.meshgrid(*axes * [x], indexing="ij")):
        # Each axis ranges over the length that the previous axes leave.
        points[d], weights = room * along.ravel(), weights * room ** (d > 0)
        room = room * (1 - along.ravel())
    return points, weights


@lru_cache
def _side(kind: Kind, number: int, more: int) -> Side:
    reference, order = RefTet if kind[0] else RefHex, _order(kind) + 2 * more
    points = _collapsed(order, 2) if kind[0] else get_quadrature(reference.brefdom, order)
    return make_side(reference, number, points, partial(_values, kind))


def split(space: S, facets: np.ndarray, beyond: Mapping[str, FaceIntegrals] | None = None) -> S:
    """A space whose functions jump across some facets inside; and with functions ``beyond`` some faces, by name, which
    are no cell's: one for each function of the face. The space itself where there is neither."""
    if not len(facets) and not beyond:
        return space
    torn_space = space.enlarged(*_split(space, facets))
    torn_space.torn = facets
    for name, face in (beyond or {}).items():
        functions = np.flatnonzero(FaceIntegrals(torn_space, face.facets, face.cells).functions)
        former = torn_space
        torn_space = former.enlarged(former.dofs, functions)
        torn_space.beyond = {**former.beyond, name: (functions, np.arange(former.size, torn_space.size))}
    return torn_space


def _split(space: Space, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``dofs`` with other numbers where functions are split, and (copies,) the function that each new one copies."""
    f2t, dofs = space.mesh.f2t, space.dofs.copy()
    on = FaceIntegrals(space, facets, f2t[0, facets]).functions
    local, cells = np.nonzero(on[dofs])
    functions = dofs[local, cells]
    # The places of the functions of cells, in which neighbours are joined by a facet without a contact.
    count = len(cells)
    place = csc_array((np.arange(1, count + 1), (functions, cells)), shape=(space.size, dofs.shape[1]))
    joins = np.setdiff1d(np.flatnonzero(f2t[1] >= 0), facets)
    one, other = (place[:, side] for side in f2t[:, joins])
    pairs = one.multiply(other > 0).tocsc().data - 1, other.multiply(one > 0).tocsc().data - 1
    graph = coo_array((np.ones(len(pairs[0]), bool), pairs), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    # A set of cells keeps the function's number if it has the first of its cells.
    _, start, label = np.unique(label, return_index=True, return_inverse=True)
    former = functions[start]
    order = np.lexsort((cells, functions))
    firsts = order[np.flatnonzero(np.diff(functions[order], prepend=-1))]
    new = np.ones(len(former), bool)
    new[label[firsts]] = False
    number = former.copy()
    number[new] = space.size + np.arange(new.sum())
    dofs[local, cells] = number[label]
    return dofs, former[new]


@dataclass(frozen=True, eq=False)
class Interface:
    """Facets on which a function jumps, from the side ``one`` to the ``other``: the same facets by other functions."""

    one: FaceIntegrals
    other: FaceIntegrals

    @staticmethod
    def inside(space: Space, facets: np.ndarray) -> Interface:
        """Facets inside, seen from both of their cells."""
        first, second = space.mesh.f2t[:, facets]
        here, there = space.dofs[:, first], space.dofs[:, second]
        # Partners have the same origin; functions without a partner vanish on the facet.
        same = space.origin[here][:, None] == space.origin[there]
        partners = np.take_along_axis(there, same.argmax(axis=1), axis=0)
        other = FaceIntegrals(space, facets, first, dofs=np.where(same.any(axis=1), partners, here))
        return Interface(FaceIntegrals(space, facets, first), other)

    def jump(self, u: np.ndarray) -> np.ndarray:
        """(facets, points): a function (functions,) on side ``one`` less its value on the ``other``."""
        return self.one.value(u) - self.other.value(u)

    def load(self, density: np.ndarray | float = 1.0) -> np.ndarray:
        """(functions,): the integral of a density (facets, 1 or points) times the jump of each function."""
        return self.one.load(density) - self.other.load(density)

    def mass(self) -> csc_array:
        """The integral of the jump of u times the jump of v."""
        one, entries = np.ones((1, 1)), []
        for (_, a, _), (_, b, _) in zip(self.one.sides, self.other.sides, strict=True):
            entries += [a.entries(one), b.entries(one), a.entries(-one, b), b.entries(-one, a)]
        return sum_entries(entries, self.one.space.size)
