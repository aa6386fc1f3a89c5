"""Heat, or current, in a layout as a circuit: the flow through each of its branches, and which of them are
resistances.

A branch is a point of a line's quadrature (the flow along the line there, for its gradient), a point at which two
lines that run alike exchange heat, a link between the means of two intervals, or a boundary. With the unknowns u and
the inputs x (the given temperatures, fluxes, voltages)

    flow = (B u - N x) / r,    r = extra + sum over its halves of size * resistivity(T),

where a half is the part of one line in a branch's resistance: length/area of its material, at its own temperature M u.
The weak form of the heat equation on the lines, Kirchhoff's laws at the links, is then B^T flow = load.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from reduced1d.network.lines import Layout, Link, Touch, joined
from reduced1d.numerics import Elements
from scenes.errors import SceneError, quoted


@dataclass(frozen=True, eq=False)
class Circuit:
    """m branches with h halves on n unknowns, of which ``free`` (n, f) and ``fixed`` (n, inputs) make all: u = free v +
    fixed x.

    across, given, halves : (m, n), (m, inputs), (h, n), B, N and M
    branch, line, size : (h,), the branch and the line of each half, and its length/area in 1/m
    span : (2, h), extent of each half along its line (m)
    extra : (m,), K/W or ohm
    load : (n, inputs), direct effect of the inputs
    rows : the branches of ("line", number), ("link", number) or ("terminal", boundary)
    """

    across: sp.csr_matrix
    given: sp.csr_matrix
    halves: sp.csr_matrix
    branch: np.ndarray
    line: np.ndarray
    size: np.ndarray
    span: np.ndarray
    extra: np.ndarray
    free: sp.csr_matrix
    fixed: sp.csr_matrix
    load: sp.csr_matrix
    rows: dict[tuple[str, int], slice]

    def resistance(self, resistivity: np.ndarray) -> np.ndarray:
        """(m,) or (m, any): of each branch, from the resistivity (h,) or (h, any) of each half."""
        return np.asarray(((self.summed @ (self.size * resistivity.T).T).T + self.extra).T)

    @cached_property
    def summed(self) -> sp.csr_matrix:
        """(m, h): the sum of each branch's halves."""
        h = len(self.branch)
        return sp.csr_matrix((np.ones(h), (self.branch, np.arange(h))), shape=(len(self.extra), h))

    def matrix(self, conductance: np.ndarray) -> sp.csr_matrix:
        """(n, n): B^T conductance B."""
        return self.across.T @ weighted(self.across, conductance)

    @cached_property
    def free_across(self) -> sp.csr_matrix:
        """(m, f): B on the free unknowns."""
        return (self.across @ self.free).tocsr()

    @cached_property
    def copies(self) -> np.ndarray:
        """(f,): of how many unknowns each free one is the value."""
        return np.asarray(self.free.sum(axis=0)).ravel()


Half = tuple[int, sp.csr_matrix, np.ndarray, np.ndarray]
"""The part of one line in some branches: the line, and by branch its values, sizes (1/m) and places along it (m)."""


class _Builder:
    """Collects the branches of a circuit: first lines, then links."""

    def __init__(self, layout: Layout, elements: Elements, inputs: int, electric: bool) -> None:
        self.layout, self.elements, self.inputs, self.electric = layout, elements, inputs, electric
        kind = "current" if electric else "heat"
        self.measured = {number: value for (of, number), value in layout.measured if of == kind}
        self.branches: list[tuple[sp.csr_matrix, int | None, np.ndarray]] = []
        self.halves: list[tuple[int, Half]] = []
        self.rows: dict[tuple[str, int], slice] = {}
        self.load = sp.lil_matrix((elements.size, inputs))
        self.same: list[tuple[int, int]] = []
        self.held: dict[int, int] = {}
        self.count = 0

    def add(
        self, key: tuple[str, int], across: sp.csr_matrix, halves: list[Half], given: int | None = None,
        extra: np.ndarray | float = 0.0, measured: float | None = None,
    ) -> None:  # fmt: skip
        m, extra = across.shape[0], np.broadcast_to(extra, across.shape[0]).astype(float)
        if measured:
            cold = (size * self.layout.resistivity(line, self.electric) for line, _, size, _ in halves)
            factor = measured * float((1 / sum(cold, extra)).sum())
            halves, extra = [(line, values, size * factor, span) for line, values, size, span in halves], extra * factor
        self.rows[key] = slice(self.count, self.count + m)
        self.branches.append((across, given, extra))
        self.halves += [(self.count, half) for half in halves]
        self.count += m

    def line(self, number: int) -> None:
        """The flow along a line."""
        line, e = self.layout.lines[number], self.elements
        q = e.inside(number, line.start, line.stop)
        self.add(("line", number), e.slopes[q], [(number, e.values[q], 1 / (line.area * e.weights[q]), e.places[q])])

    def link(self, number: int, link: Link) -> None:
        """The flow through a link. Ends with nothing between become one unknown; a flux is a load."""
        one, other, e = link.one, link.other, self.elements
        boundary = None if other else self.layout.scene.boundaries[link.boundary]
        film, measured = self.layout.film(link), self.measured.get(number)
        if boundary and boundary.kind == "heat_flux":
            row = e.unit(e.end(one.line, one.end)) if one.end is not None else e.mean(one.line, one.start, one.stop)
            self.load[:, link.boundary] += one.area * row.T.toarray()
            return
        if film == 0.0:
            return
        terminal = e.terminals.get(link.boundary) if self.electric and not other else None
        held = link.kind == "ends" and film is None and not link.contact
        if held and not measured:
            assert one.end is not None
            first = e.end(one.line, one.end)
            if other:
                assert other.end is not None
                self.same.append((first, e.end(other.line, other.end)))
            elif terminal is not None:
                self.same.append((first, terminal))
            else:
                self._hold(first, link.boundary, self.held)
            return
        sides = [self._side(touch, link.kind == "along") for touch in link.touches]
        halves = [(t.line, *side) for t, side in zip(link.touches, sides, strict=True) if t.end is None]
        across = sides[0][0]
        if held:
            halves = [(one.line, across, np.ones(1), sides[0][2])]  # measured, at the first line's end
        if other:
            across = across - sides[1][0]
        elif terminal is not None:
            across = across - sp.csr_matrix(np.ones((across.shape[0], 1))) @ e.unit(terminal)
        q = e.inside(one.line, one.start, one.stop)
        areas = self._areas(one, q) if link.kind == "along" else np.array([one.area])
        given = link.boundary if not other and terminal is None else None
        extra = (link.contact + (1 / film if film else 0.0)) / areas
        self.add(("link", number), across, halves, given, extra, measured)

    def _side(self, touch: Touch, by_point: bool) -> tuple[sp.csr_matrix, np.ndarray, np.ndarray]:
        """The values of a line where it is touched, point by point or their mean, with the half's sizes (1/m) and where
        along the line it begins and ends (m)."""
        e, span = self.elements, np.array([[touch.start], [touch.stop]])
        if touch.end is not None:
            return e.unit(e.end(touch.line, touch.end)), np.zeros(1), span
        if not by_point:
            return e.mean(touch.line, touch.start, touch.stop), np.array([touch.half / touch.area]), span
        q = e.inside(touch.line, touch.start, touch.stop)
        return e.values[q], touch.half / self._areas(touch, q), e.places[q]

    def _areas(self, touch: Touch, q: np.ndarray) -> np.ndarray:
        """The part of a side's area that belongs to each point of the quadrature (m2)."""
        return touch.area / (touch.stop - touch.start) * self.elements.weights[q]

    def terminal(self, number: int) -> None:
        """The current at an electrode of unknown potential: given, or driven by a voltage through a resistance in
        series."""
        resistance, unknown = self.layout.scene.boundaries[number].series_resistance, self.elements.terminals[number]
        if np.isinf(resistance):
            self.load[unknown, number] = 1.0
        else:
            self.add(("terminal", number), self.elements.unit(unknown), [], number, resistance)

    def source(self, number: int, column: int) -> None:
        """A heat source of 1 W/m3 in a line as a load."""
        line = self.layout.lines[number]
        mean = self.elements.mean(number, line.start, line.stop)
        self.load[:, column] += line.area * line.length * mean.T.toarray()

    def _hold(self, dof: int, boundary: int, holds: dict[int, int], key: int | None = None) -> None:
        """Give a boundary's value to an unknown; SceneError where another boundary gives it another value."""
        first = holds.setdefault(dof if key is None else key, boundary)
        a, b = (self.layout.scene.boundaries[number] for number in (first, boundary))
        if a.value != b.value:
            line = self.layout.lines[int(np.searchsorted(self.elements.first_node, dof, side="right")) - 1].name
            raise SceneError(
                f"boundaries {quoted(a.name)} and {quoted(b.name)} give two values to one end of the line of "
                f"{quoted(line)}, which a network of lines cannot have: let them act on different boxes, "
                "or take another --model"
            )

    def circuit(self, used: list[bool]) -> Circuit:
        """The circuit of the lines that are ``used``."""
        n, e = self.elements.size, self.elements
        labels, holds = joined(n, self.same), dict[int, int]()
        for dof, boundary in self.held.items():
            self._hold(dof, boundary, holds, int(labels[dof]))
        live = np.zeros(n, bool)
        live[e.dofs[:, np.repeat(used, np.diff(e.first))]] = True
        live[list(e.terminals.values())] = self.electric
        at = np.array([holds.get(label, -1) for label in labels.tolist()])
        ours, kept = np.flatnonzero(live & (at < 0)), np.flatnonzero(live & (at >= 0))
        columns = np.unique(labels[ours], return_inverse=True)[1]
        free = sp.csr_matrix((np.ones(len(ours)), (ours, columns)), shape=(n, int(columns.max(initial=-1)) + 1))
        fixed = sp.csr_matrix((np.ones(len(kept)), (kept, at[kept])), shape=(n, self.inputs))
        across, given, extra = zip(*self.branches, strict=True)
        counts = [len(each) for each in extra]
        inputs = np.repeat([-1 if k is None else k for k in given], counts)
        row, values = np.flatnonzero(inputs >= 0), [half for _, half in self.halves]
        return Circuit(
            sp.vstack(across, "csr"),
            sp.csr_matrix((np.ones(len(row)), (row, inputs[row])), shape=(self.count, self.inputs)),
            sp.vstack([half[1] for half in values], "csr"),
            np.concatenate([first + np.arange(len(half[2])) for first, half in self.halves]),
            np.concatenate([np.full(len(half[2]), half[0]) for half in values]),
            np.concatenate([half[2] for half in values]),
            np.hstack([np.broadcast_to(half[3], (2, len(half[2]))) for half in values]),
            np.concatenate(extra), free, fixed, self.load.tocsr(), self.rows,
        )  # fmt: skip


def assemble(
    layout: Layout, elements: Elements, inputs: int, electric: bool, sources: dict[str, int] | None = None
) -> Circuit:
    """Assemble the circuit of the heat, in W and K, or of the current, in A and V, of the lines that conduct.

    Parameters
    ----------
    layout, elements : Layout, Elements
        The lines and their discretization.
    inputs : int
        Number of inputs.
    electric : bool
        Whether it is the circuit of the current.
    sources : dict, optional
        Input of each box with a heat source by the name of the box.
    """
    builder = _Builder(layout, elements, inputs, electric)
    used = [line.conducts or not electric for line in layout.lines]
    for i in np.flatnonzero(used).tolist():
        builder.line(i)
        if sources and (name := layout.lines[i].box.name) in sources:
            builder.source(i, sources[name])
    for number, link in enumerate(layout.links(electric)):
        builder.link(number, link)
    for number in elements.terminals if electric else ():
        builder.terminal(number)
    return builder.circuit(used)


def weighted(matrix: sp.csr_matrix, factors: np.ndarray) -> sp.csr_matrix:
    """A matrix with its rows times some factors."""
    data = matrix.data * np.repeat(factors, np.diff(matrix.indptr))
    return sp.csr_matrix((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def factor(matrix: sp.csr_matrix) -> Any:
    """The LU factors of a matrix of symmetric pattern, real or complex, along an order made for that."""
    options = {"SymmetricMode": True, "DiagPivotThresh": 0.01}
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options=options)
