"""Polynomials along lines, by scikit-fem: values and slopes at the points of a quadrature."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp


class Elements:
    """Elements of a degree between the ``nodes`` (m) of each line.

    ``values`` and ``slopes`` (points, n) take the n unknowns to the points of the quadrature, whose ``weights`` and
    ``places`` along their lines are in m. The potentials of electrodes that no voltage gives, ``terminals`` by the
    number of their boundary, are unknowns behind the unknowns of the lines.
    """

    def __init__(self, nodes: Sequence[np.ndarray], degree: int, terminals: Sequence[int] = ()) -> None:
        from skfem import Basis, ElementLinePp, MeshLine

        self.nodes, self.degree = nodes, degree
        self.first_node = np.cumsum([0, *(len(x) for x in nodes)])
        self.first = np.cumsum([0, *(len(x) - 1 for x in nodes)])
        starts = np.concatenate([f + np.arange(len(x) - 1) for f, x in zip(self.first_node, nodes, strict=False)])
        # Every line from zero on: nodes far from the origin would lose digits.
        mesh = MeshLine(np.concatenate([x - x[0] for x in nodes])[None], np.stack([starts, starts + 1]))
        basis = Basis(mesh, ElementLinePp(degree), intorder=2 * degree + 2)
        self.dofs = basis.element_dofs
        self.terminals = {number: int(basis.N) + k for k, number in enumerate(terminals)}
        self.size = int(basis.N) + len(terminals)
        self.lengths = np.concatenate([np.diff(x) for x in nodes])
        self.points = basis.X.shape[1]
        self.weights = np.asarray(basis.dx).ravel()
        starts_at = np.repeat([x[0] for x in nodes], np.diff(self.first) * self.points)
        self.places = starts_at + np.asarray(basis.global_coordinates())[0].ravel()
        shape = (len(starts), self.points)
        fields = [field[0] for field in basis.basis]
        elements = np.repeat(np.arange(len(starts)), self.points)
        self.values = self._rows(elements, [np.broadcast_to(np.asarray(f), shape) for f in fields])
        self.slopes = self._rows(elements, [np.broadcast_to(f.grad[0], shape) for f in fields])

    def _rows(self, elements: np.ndarray, functions: list[np.ndarray]) -> sp.csr_matrix:
        """(rows, n): one row for each of the ``elements``, from the value of each of its functions."""
        data = np.concatenate([f.ravel() for f in functions])
        columns = np.concatenate([d[elements] for d in self.dofs])
        rows = np.tile(np.arange(len(elements)), len(functions))
        return sp.csr_matrix((data, (rows, columns)), shape=(len(elements), self.size))

    def mass(self, factors: np.ndarray) -> sp.csr_matrix:
        """(n, n): the integrals of products of the functions, times a factor for each element."""
        return self.values.T @ sp.diags_array(np.repeat(factors, self.points) * self.weights) @ self.values

    def stiffness(self, factors: np.ndarray) -> sp.csr_matrix:
        """(n, n): the same of products of their slopes."""
        return self.slopes.T @ sp.diags_array(np.repeat(factors, self.points) * self.weights) @ self.slopes

    def integral(self, factors: np.ndarray) -> np.ndarray:
        """(n,): the integrals of the functions, times a factor for each element."""
        return np.asarray(self.values.T @ (np.repeat(factors, self.points) * self.weights))

    def inside(self, line: int, start: float, stop: float) -> np.ndarray:
        """The points of the quadrature between two nodes of a line (m)."""
        a, b = (self.first[line] + int(np.searchsorted(self.nodes[line], x)) for x in (start, stop))
        return np.arange(a * self.points, b * self.points)

    def mean(self, line: int, start: float, stop: float) -> sp.csr_matrix:
        """(1, n): the mean between two nodes of a line; the value where they are one place."""
        if start == stop:
            return self.at([line], np.array([start]))[0]
        q = self.inside(line, start, stop)
        return sp.csr_matrix(self.weights[None, q] / self.weights[q].sum()) @ self.values[q]

    def unit(self, unknown: int) -> sp.csr_matrix:
        """(1, n): one of the unknowns."""
        return sp.csr_matrix(([1.0], ([0], [unknown])), shape=(1, self.size))

    def end(self, line: int, end: int) -> int:
        """The number of the unknown that is the value at a line's end (0 or 1)."""
        return int(self.first_node[line] if end == 0 else self.first_node[line + 1] - 1)

    def at(self, lines: Sequence[int], places: np.ndarray) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """(places, n) twice: values and slopes at places (m), each along one of the lines."""
        from skfem import ElementLinePp

        shapes, nodes = ElementLinePp(self.degree), [self.nodes[i] for i in lines]
        inner = np.array([min(max(int(np.searchsorted(x, place, side="right")) - 1, 0), len(x) - 2)
                          for x, place in zip(nodes, places.tolist(), strict=True)], int)  # fmt: skip
        element = self.first[np.asarray(lines)] + inner
        local = (places - [x[k] for x, k in zip(nodes, inner.tolist(), strict=True)]) / self.lengths[element]
        each = [shapes.lbasis(local[None], i) for i in range(len(self.dofs))]
        return (
            self._rows(element, [value for value, _ in each]),
            self._rows(element, [slope[0] / self.lengths[element] for _, slope in each]),
        )
