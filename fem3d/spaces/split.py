"""Functions that jump across some facets: each side has its own functions.

A vertex, edge or facet on a contact has one function of each kind for every set of its cells that hang together by
facets without a contact. So at the rim of a contact that ends inside the solid both sides share functions: around the
rim all cells hang together.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import copy
from typing import Any, TypeVar

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components

from fem3d.spaces.integrals import Faces, Space

S = TypeVar("S", bound=Space)


def split(space: S, facets: np.ndarray, beyond: Mapping[str, Faces] | None = None) -> S:
    """A space whose functions jump across some facets inside; and with functions ``beyond`` some faces, by name, which
    are no cell's: one for each function of the face. The space itself where there is neither."""
    if not len(facets) and not beyond:
        return space
    dofs, origin = _split(space, facets)
    torn_space = space.renumbered(dofs, origin)
    torn_space.torn = facets
    for name, face in (beyond or {}).items():
        functions = np.flatnonzero(Faces(torn_space, face.facets, face.cells).functions)
        torn_space = torn_space.extended(name, functions)
    return torn_space


def _split(space: Space, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``dofs`` with other numbers where functions are split, and (functions,) the former number of each."""
    mesh, count = space.mesh, space.dofs.shape[1]
    on = np.zeros(space.size, bool)
    for seen in mesh.f2t[:, facets]:
        for functions, _ in _of_sides(space, facets, seen):
            on[functions] = True
    touching = np.flatnonzero(on[space.dofs].any(axis=0))
    local, at = np.nonzero(on[space.dofs[:, touching]])
    cells = touching[at]
    # Each function of each cell, by the function and the cell.
    keys, place = np.unique(space.dofs[local, cells].astype(np.int64) * count + cells, return_inverse=True)
    joins = np.setdiff1d(np.unique(mesh.t2f[:, touching]), facets)
    joins = joins[mesh.f2t[1, joins] >= 0]
    pairs = [np.empty((2, 0), np.int64)]
    for functions, which in _of_sides(space, joins, mesh.f2t[0, joins]):
        both = functions[None].astype(np.int64) * count + mesh.f2t[:, joins[which]][:, None]
        pairs.append(both[:, on[functions]])
    first, second = np.searchsorted(keys, np.concatenate(pairs, axis=1))
    graph = coo_array((np.ones(len(first), bool), (first, second)), shape=(len(keys),) * 2)
    # A set of cells keeps the function's number if it has the first of its cells.
    _, label = connected_components(graph, directed=False)
    _, start, label = np.unique(label, return_index=True, return_inverse=True)
    former = keys[start] // count
    rest = np.argsort(start)
    rest = rest[np.flatnonzero(np.diff(former[rest], prepend=-1) == 0)]
    number = former.copy()
    number[rest] = space.size + np.arange(len(rest))
    dofs = space.dofs.copy()
    dofs[local, cells] = number[label[place]]
    return dofs, np.concatenate([np.arange(space.size), former[rest]])


def _of_sides(space: Space, facets: np.ndarray, cells: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """For each side of the reference cell the functions (functions of a side, facets) on the facets at that side of
    their cell, and the indices (facets,) of these facets."""
    local = (space.mesh.t2f[:, cells] == facets).argmax(axis=0)
    for number in np.unique(local):
        at = np.flatnonzero(local == number)
        nonzero = np.flatnonzero(space.side(int(number))[0].values.any(axis=0))
        yield space.dofs[np.ix_(nonzero, cells[at])], at


def twin(faces: Faces, partner: np.ndarray) -> Faces:
    """The same faces as seen by other functions: ``partner`` (facets, functions of a cell), or (functions,), has the
    number of the other one of each."""
    sides = []
    for at, side, normal in faces.sides:
        other: Any = copy(side)
        other.dofs = partner[side.dofs] if partner.ndim == 1 else partner[at]
        vars(other).pop("functions", None)
        sides.append((at, other, normal))
    twins = copy(faces)
    vars(twins).pop("functions", None)
    vars(twins)["sides"] = sides
    return twins


class Interface:
    """Facets on which a function jumps, from the side ``one`` to the ``other``."""

    def __init__(self, one: Faces, other: Faces) -> None:
        self.one, self.other = one, other

    @staticmethod
    def inside(space: Space, facets: np.ndarray) -> Interface:
        """Facets inside, seen from both of their cells."""
        first, second = space.mesh.f2t[:, facets]
        one = Faces(space, facets, first)
        # A function of the first cell and its partner in the second cell have the same origin.
        keys, numbers = [], []
        for functions, at in _of_sides(space, facets, second):
            keys.append((at * len(space.origin) + space.origin[functions]).ravel())
            numbers.append(functions.ravel())
        key, number = np.concatenate(keys), np.concatenate(numbers)
        order = np.argsort(key)
        partner = np.empty((len(facets), len(space.dofs)), int)
        for at, side, _ in one.sides:
            wanted = at[:, None] * len(space.origin) + space.origin[side.dofs]
            place = np.minimum(np.searchsorted(key[order], wanted), len(key) - 1)
            # Other functions of the cell vanish on the side.
            partner[at] = np.where(key[order][place] == wanted, number[order][place], side.dofs)
        return Interface(one, twin(one, partner))

    def jump(self, u: np.ndarray) -> np.ndarray:
        """(facets, points): a function (functions,) on side ``one`` less its value on the ``other``."""
        return self.one.value(u) - self.other.value(u)

    def load(self, density: np.ndarray | float = 1.0) -> np.ndarray:
        """(functions,): the integral of a density (facets, 1 or points) times the jump of each function."""
        return self.one.load(density) - self.other.load(density)

    def mass(self) -> csc_array:
        """The integral of the jump of u times the jump of v."""
        size = self.one.space.size
        rows, columns, data = [], [], []
        for (_, a, _), (_, b, _) in zip(self.one.sides, self.other.sides, strict=True):
            blocks, functions = a.blocks()
            nonzero = np.abs(blocks) > 1e-14 * np.abs(blocks).max(axis=(1, 2), keepdims=True)
            for v, u, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                pairs = v.dofs[:, functions][:, :, None], u.dofs[:, functions][:, None]
                rows.append(np.broadcast_to(pairs[0], blocks.shape)[nonzero])
                columns.append(np.broadcast_to(pairs[1], blocks.shape)[nonzero])
                data.append(sign * blocks[nonzero])
        entries = np.concatenate(data), (np.concatenate(rows), np.concatenate(columns))
        return csc_array(coo_array(entries, shape=(size, size)))
