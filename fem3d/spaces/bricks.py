"""The trunk space on a grid of bricks: scikit-fem's mesh and degrees of freedom, matrices and integrals over bricks.

Vectors run over all functions of the grid's highest degree; coefficients above the degrees of their intervals are
zero. All cells are axis-parallel, so every matrix is the reference matrix scaled by the sides
(`fem3d.spaces.element.reference_matrices`)."""

from __future__ import annotations

from functools import cached_property, lru_cache, partial

import numpy as np
from skfem import MeshHex
from skfem.assembly.dofs import Dofs
from skfem.refdom import RefHex

from fem3d.spaces import element
from fem3d.spaces.element import Degrees, ElementHexTrunk, Rule, Side, multi_indices
from fem3d.spaces.integrals import AT_ONCE, Space, entities
from fem3d.spaces.sparse import Entries
from meshes.grid import Grid


class BrickSpace(Space):
    """The functions on the cells of a grid that a box owns.

    ``ijk`` (3, cells) are the grid indices of each cell, ``h`` (3, cells) its sides (m), and ``degrees`` (3, cells) the
    highest degrees of its edges. The degrees of the two lower spaces are lower by two and by one.
    """

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        self.p = p = int(max(d.max() for d in grid.degrees))
        self.ijk = np.argwhere(grid.solid).T
        self.h = np.array([np.diff(b)[i] for b, i in zip(grid.breaks, self.ijk, strict=True)])
        shape = tuple(n + 1 for n in grid.owner.shape)
        corners = self.ijk[:, None] + RefHex.p.astype(int)[:, :, None]
        vertices, t = np.unique(np.ravel_multi_index(tuple(corners), shape), return_inverse=True)
        at = np.array(np.unravel_index(vertices, shape))
        points = np.array([b[i] for b, i in zip(grid.breaks, at, strict=True)])
        self.mesh = MeshHex(points, t.reshape(8, -1).astype(np.int32), validate=False)
        numbering = Dofs(self.mesh, ElementHexTrunk(p))
        self.dofs, self.size = numbering.element_dofs, int(numbering.N)
        # Places count cells, however thin: connectivity matters, not length.
        self.entity, self.places = entities(self.mesh, numbering, at)
        self.degrees = grid.of_cells
        kinds, kind = np.unique(self.degrees, axis=1, return_inverse=True)
        self._classes = [np.flatnonzero(kind.ravel() == k) for k in range(kinds.shape[1])]

    @cached_property
    def depth(self) -> np.ndarray:
        """(functions,): as in `Space`, and negative for functions above the degrees of their intervals."""
        # The place of each function (functions, 3): even numbers are the grid's breakpoints, odd numbers its intervals.
        at = self._of_functions(2 * self.ijk.T + np.array([0, 2, 1])[np.minimum(multi_indices(self.p), 2)][:, None])
        axes, k = at % 2 == 1, self._of_functions(multi_indices(self.p)[:, None])
        degrees = self.grid.of_entities[:, *at.T].T.astype(int)
        slack = np.where(axes, degrees - k, self.p + 1).min(axis=1)
        together = np.where(axes, degrees, 0).max(axis=1) - np.where(axes, k, 0).sum(axis=1)
        return np.where(axes.any(axis=1), np.minimum(slack, together), slack)

    def _of_functions(self, of_dofs: np.ndarray) -> np.ndarray:
        """(functions, 3): numbers of the functions of each cell (functions of a cell, cells or 1, 3)."""
        numbers = np.zeros((self.size, 3), int)
        numbers[self.origin[self.dofs]] = of_dofs
        return numbers[self.origin]

    def energies(self, k: np.ndarray, c: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Divide the energy among the axes along which each function of v is of a degree above 1, equally."""
        volume, energies, along = self.h.prod(axis=0), np.empty((len(v), 3, self.h.shape[1])), multi_indices(self.p) > 1
        scale = np.concatenate([k * volume / self.h**2, [c * volume]])
        shares = np.where(along.any(axis=1), along.T / np.maximum(along.sum(axis=1), 1), 1 / 3)
        present = np.asarray(v.any(axis=0))
        for cells in self._classes:
            at = self.dofs[:, cells]
            flows = (element.stacked_matrices(self.p, self._highest(cells)) @ u[at]).reshape(4, *at.shape)
            of_v = present[at].any(axis=1)
            heats = np.einsum("dc,dfc->fc", scale[:, cells], flows[:, of_v])
            energies[..., cells] = shares[:, of_v] @ (heats * v[:, at[of_v]])
        return energies

    def _entries(self, cells: np.ndarray, k: np.ndarray, c: np.ndarray) -> list[Entries]:
        h, entries, scale = self.h[:, cells], [], np.zeros((4, self.h.shape[1]))
        scale[:3, cells], scale[3, cells] = k * h.prod(axis=0) / h**2, c * h.prod(axis=0)
        for alike in self.alike(cells):
            (rows, columns, one), at = element.reference_matrices(self.p, self._highest(alike)), self.dofs[:, alike]
            both = np.array([one[:3].T @ scale[:3, alike], np.outer(one[3], scale[3, alike])])
            entries.append((both.reshape(2, -1) / 2, at[rows].ravel(), at[columns].ravel()))
        return entries

    def alike(self, cells: np.ndarray) -> list[np.ndarray]:
        chosen = np.zeros(self.h.shape[1], bool)
        chosen[cells] = True
        return [shared for members in self._classes if len(shared := members[chosen[members]])]

    def rule(self, cells: np.ndarray, more: int) -> Rule:
        """Gauss's rule; along each axis the points are the highest degree of the cells there plus one and ``more``."""
        return _rule(self.p, self._highest(cells), more)

    def _highest(self, cells: np.ndarray) -> Degrees:
        x, y, z = self.degrees[:, cells].max(axis=1, initial=1).tolist()
        return x, y, z

    def side(self, number: int, more: int) -> Side:
        return _side(self.p, number, more)

    def jacobian(self, cells: np.ndarray, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        h = self.h[:, cells, None]
        return 1 / h, h.prod(axis=0)

    def at(self, X: np.ndarray, along: int | None = None) -> np.ndarray:
        return element.shape_functions(multi_indices(self.p), X, along)

    def sample(self, u: np.ndarray, points: np.ndarray) -> np.ndarray:
        """(...): a field (functions,) at points (3, ...) in m, meaningless outside of the solid."""
        number = np.zeros(self.grid.owner.shape, int)
        number[tuple(self.ijk)] = np.arange(self.ijk.shape[1])
        at, X = np.empty((3, points[0].size), int), np.empty((3, points[0].size))
        for d, (breaks, places) in enumerate(zip(self.grid.breaks, points, strict=True)):
            at[d] = np.clip(np.searchsorted(breaks, places.ravel(), side="right") - 1, 0, len(breaks) - 2)
            X[d] = (places.ravel() - breaks[at[d]]) / np.diff(breaks)[at[d]]
        dofs, values = self.dofs[:, number[tuple(at)]], np.empty(points[0].size)
        step = AT_ONCE // len(dofs)
        for some in (slice(i, i + step) for i in range(0, len(values), step)):
            values[some] = (self.at(X[:, some]) * u[dofs[:, some]].T).sum(axis=1)
        return values.reshape(points[0].shape)


@lru_cache(maxsize=32)
def _rule(p: int, degrees: Degrees, more: int) -> Rule:
    points, weights = element.cube_rule(*(degree + 1 + more for degree in degrees))
    functions = partial(element.shape_functions, multi_indices(p))
    return element.make_rule(points.T, weights, functions, np.flatnonzero(element.active_functions(p, degrees)))


@lru_cache(maxsize=64)
def _side(p: int, number: int, more: int) -> Side:
    points, weights = element.cube_rule(p + 1 + more, p + 1 + more)
    return element.make_side(RefHex, number, (points.T, weights), partial(element.shape_functions, multi_indices(p)))
