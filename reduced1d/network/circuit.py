"""Heat, or current, in a layout as a circuit: the flow through each of its branches, and which of them are
resistances.

A branch is a point of a line's quadrature (the flow along the line there, for its gradient), a point at which two
lines that run alike exchange heat, a joint between the means of two intervals, or a condition. With the unknowns u and
the inputs x (the given temperatures, fluxes, voltages)

    flow = (B u - N x) / r,    r = extra + sum over its halves of size * resistivity(T),

where a half is the part of one line in a branch's resistance: length/area of its material, at its own temperature M u.
The weak form of the heat equation on the lines, Kirchhoff's laws at the joints, is then B^T flow = load.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from reduced1d.network.elements import Elements, joined
from reduced1d.network.lines import Condition, Joint, Layout, Touch
from scenes.errors import SceneError, quoted
from scenes.model import Value


@dataclass(frozen=True, eq=False)
class Circuit:
    """m branches with h halves on n unknowns, of which ``free`` (n, f) and ``fixed`` (n, inputs) make all: u = free v +
    fixed x.

    ``across`` (m, n) and ``given`` (m, inputs) are B and N, ``halves`` (h, n) is M, ``branch`` and ``line`` (h,)
    say of which branch and of which line, ``size`` is in 1/m, ``extra`` (m,) in K/W or ohm; ``span`` (2, h) from
    where to where along its line a half lies (m). ``load`` (n, inputs) is the direct effect of inputs. ``rows`` says
    which branches are those of ("line", number), ("joint", number) or ("condition", number).
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
        each = (self.size * resistivity.T).T
        total: np.ndarray = (self.summed @ each).T + self.extra
        return total.T

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

    def components(self) -> np.ndarray:
        """(f,): a number for each set of free unknowns that branches join, from 1 on where a branch joins the set to a
        given value, and -1 - number where none does."""
        linked = abs(self.free_across)
        graph = (linked.T @ linked).tocoo()
        count, labels = sp.csgraph.connected_components(graph, directed=False)
        outside = abs(self.across @ self.fixed).sum(axis=1) + abs(self.given).sum(axis=1)
        tied = np.zeros(count, bool)
        reached = (linked.T @ np.asarray(outside).ravel()) > 0
        tied[labels[reached]] = True
        return np.where(tied[labels], 1 + labels, -1 - labels)


Half = tuple[int, sp.csr_matrix, np.ndarray, np.ndarray]
"""What one line has of some branches: the line, and by branch its values, sizes (1/m) and places along the line (m)."""


class Builder:
    """Collects the branches of a circuit: first lines, then joints and conditions."""

    def __init__(self, layout: Layout, elements: Elements, inputs: int, electric: bool) -> None:
        self.layout, self.elements, self.inputs, self.electric = layout, elements, inputs, electric
        kinds = {"joint": "joint", "condition": "condition"}
        if electric:
            kinds = {"wire": "joint", "electrode": "condition"}
        self.measured = {(kinds[kind], n): value for (kind, n), value in layout.measured if kind in kinds}
        self.across: list[sp.csr_matrix] = []
        self.given: list[sp.csr_matrix] = []
        self.halves: list[sp.csr_matrix] = []
        self.branch: list[np.ndarray] = []
        self.line: list[np.ndarray] = []
        self.size: list[np.ndarray] = []
        self.span: list[np.ndarray] = []
        self.extra: list[np.ndarray] = []
        self.load = sp.lil_matrix((elements.size, inputs))
        self.same: list[tuple[int, int]] = []
        self.held: dict[int, tuple[str, int, Value]] = {}
        self.rows: dict[tuple[str, int], slice] = {}
        self.count = 0

    def _add(
        self,
        key: tuple[str, int],
        across: sp.csr_matrix,
        halves: list[Half],
        given: int | None = None,
        extra: np.ndarray | float = 0.0,
    ) -> None:
        m, extra = across.shape[0], np.broadcast_to(extra, across.shape[0]).astype(float)
        if key in self.measured:
            each = sum((size * self.cold(line) for line, _, size, _ in halves), extra)
            factor = self.measured[key] * float((1 / each).sum())
            halves, extra = [(line, values, size * factor, span) for line, values, size, span in halves], extra * factor
        self.rows[key] = slice(self.count, self.count + m)
        self.across.append(across)
        column = np.zeros((m, self.inputs))
        if given is not None:
            column[:, given] = 1.0
        self.given.append(sp.csr_matrix(column))
        for line, values, size, span in halves:
            self.halves.append(values)
            self.span.append(np.broadcast_to(span, (2, m)))
            self.branch.append(self.count + np.arange(m))
            self.line.append(np.full(m, line))
            self.size.append(size)
        self.extra.append(extra)
        self.count += m

    def cold(self, line: int) -> float:
        """The resistivity of a line's material at the start, in m K/W or ohm m."""
        if self.electric:
            return float(self.layout.resistivity(line))
        return 1 / self.layout.lines[line].box.material.thermal_conductivity

    def along(self, number: int) -> None:
        """A line of its own."""
        line, e = self.layout.lines[number], self.elements
        q = e.inside(number, line.start, line.stop)
        self._add(("line", number), e.slopes[q], [(number, e.values[q], 1 / (line.area * e.weights[q]), e.places[q])])

    def joint(self, number: int, joint: Joint) -> None:
        """The exchange of two lines where they touch; two ends without a contact become one unknown."""
        one, other = joint.one, joint.other
        by_point, measured = joint.kind == "along", self.measured.get(("joint", number))
        if joint.kind == "ends" and not measured and not joint.contact:
            assert one.end is not None
            assert other.end is not None
            self.same.append((self.elements.end(one.line, one.end), self.elements.end(other.line, other.end)))
            return
        sides = [self.side(touch, by_point) for touch in (one, other)]
        halves = [(t.line, *side) for t, side in zip((one, other), sides, strict=True) if t.end is None]
        if joint.kind == "ends" and not joint.contact:
            values, _, span = sides[0]
            halves = [(one.line, values, np.ones(1), span)]  # what was measured, at the first line's end
        areas: np.ndarray | float = one.area
        if by_point:
            areas = self._areas(one, self.elements.inside(one.line, one.start, one.stop))
        self._add(("joint", number), sides[0][0] - sides[1][0], halves, extra=joint.contact / areas)

    def side(self, touch: Touch, by_point: bool) -> tuple[sp.csr_matrix, np.ndarray, np.ndarray]:
        """The values of a line where it is touched, point by point or their mean, with the half's sizes (1/m) and where
        along the line it begins and ends (m)."""
        e, span = self.elements, np.array([[touch.start], [touch.stop]])
        if touch.end is not None:
            unit = sp.csr_matrix(([1.0], ([0], [e.end(touch.line, touch.end)])), shape=(1, e.size))
            return unit, np.zeros(1), span
        if not by_point:
            return e.mean(touch.line, touch.start, touch.stop), np.array([touch.half / touch.area]), span
        q = e.inside(touch.line, touch.start, touch.stop)
        return e.values[q], touch.half / self._areas(touch, q), e.places[q]

    def _areas(self, touch: Touch, q: np.ndarray) -> np.ndarray:
        """The part of a side's area that belongs to each point of the quadrature (m2)."""
        return touch.area / (touch.stop - touch.start) * self.elements.weights[q]

    def condition(self, number: int, condition: Condition, film: float | None = None) -> None:
        """A given temperature or voltage, or the surroundings behind a film (W/(m2 K))."""
        touch, given = condition.touch, condition.boundary
        b = self.layout.scene.boundaries[given]
        key = ("condition", number)
        terminal = self.elements.terminals.get(given) if self.electric else None
        if touch.end is not None and film is None and not self.measured.get(key):
            end = self.elements.end(touch.line, touch.end)
            if terminal is None:
                self._hold(end, given, b.name, b.value, touch.line)
            else:
                self.same.append((end, terminal))
            return
        values, size, span = self.side(touch, True)
        q = self.elements.inside(touch.line, touch.start, touch.stop)
        areas = np.array([touch.area]) if touch.end is not None else self._areas(touch, q)
        held = touch.end is not None and film is None
        halves = [(touch.line, values, size + held, span)] if touch.end is None or held else []
        if terminal is not None:
            across = values - sp.csr_matrix(np.ones((values.shape[0], 1))) @ self.elements.terminal(given)
            self._add(key, across, halves)
            return
        self._add(key, values, halves, given, 0.0 if film is None else 1 / (film * areas))

    def terminal(self, number: int) -> None:
        """The current at an electrode of unknown potential: given, or driven by a voltage through a resistance in
        series."""
        resistance = self.layout.scene.boundaries[number].series_resistance
        if np.isinf(resistance):
            self.load[self.elements.terminals[number], number] = 1.0
        else:
            self._add(("terminal", number), self.elements.terminal(number), [], number, resistance)

    def _hold(self, dof: int, given: int, name: str, value: Value, line: int) -> None:
        self.held.setdefault(dof, (name, given, value))
        holder = self.held[dof]
        if holder[2] != value:
            raise self._contrary(holder[0], name, self.layout.lines[line].name)

    def _contrary(self, first: str, second: str, line: str) -> SceneError:
        return SceneError(
            f"boundaries {quoted(first)} and {quoted(second)} give two values to one end of the line of "
            f"{quoted(line)}, which a network of lines cannot have: let them act on different boxes, "
            "or take another --model"
        )

    def flux(self, condition: Condition) -> None:
        """A flux of 1 W/m2 as a load."""
        touch, e = condition.touch, self.elements
        if touch.end is not None:
            self.load[e.end(touch.line, touch.end), condition.boundary] += touch.area
        else:
            mean = e.mean(touch.line, touch.start, touch.stop)
            self.load[:, condition.boundary] += touch.area * mean.T.toarray()

    def source(self, number: int, column: int) -> None:
        """A heat source of 1 W/m3 in a line as a load."""
        line = self.layout.lines[number]
        mean = self.elements.mean(number, line.start, line.stop)
        self.load[:, column] += line.area * line.length * mean.T.toarray()

    def circuit(self, used: Callable[[int], bool]) -> Circuit:
        """The circuit of the lines that are ``used``."""
        n, e = self.elements.size, self.elements
        labels = joined(n, self.same)
        holds: dict[int, tuple[str, int, Value]] = {}
        for dof, held in self.held.items():
            other = holds.setdefault(int(labels[dof]), held)
            if other[2] != held[2]:
                raise self._contrary(other[0], held[0], self._line_of(dof))
        lines = np.array([used(i) for i in range(len(self.layout.lines))])
        live = np.zeros(n, bool)
        elements_of = np.repeat(lines, np.diff(e.first))
        live[e.dofs[:, elements_of]] = True
        live[list(e.terminals.values())] = self.electric
        at = np.array([holds[label][1] if label in holds else -1 for label in labels.tolist()])
        ours = np.flatnonzero(live & (at < 0))
        columns = np.unique(labels[ours], return_inverse=True)[1]
        count = int(columns.max()) + 1 if len(columns) else 0
        free = sp.csr_matrix((np.ones(len(ours)), (ours, columns)), shape=(n, count))
        kept = np.flatnonzero(live & (at >= 0))
        fixed = sp.csr_matrix((np.ones(len(kept)), (kept, at[kept])), shape=(n, self.inputs))
        return Circuit(
            sp.vstack(self.across, "csr"), sp.vstack(self.given, "csr"), sp.vstack(self.halves, "csr"),
            np.concatenate(self.branch), np.concatenate(self.line), np.concatenate(self.size),
            np.hstack(self.span), np.concatenate(self.extra), free, fixed, self.load.tocsr(), self.rows,
        )  # fmt: skip

    def _line_of(self, dof: int) -> str:
        return self.layout.lines[int(np.searchsorted(self.elements.first_node, dof, side="right")) - 1].name


def heat_circuit(layout: Layout, elements: Elements, inputs: int, sources: dict[str, int]) -> Circuit:
    """The circuit of the heat, in W and K; ``sources`` are the columns of boxes with a heat source."""
    builder = Builder(layout, elements, inputs, False)
    for i, line in enumerate(layout.lines):
        builder.along(i)
        if line.box.name in sources:
            builder.source(i, sources[line.box.name])
    for j, joint in enumerate(layout.joints):
        builder.joint(j, joint)
    for c, condition in enumerate(layout.conditions):
        b = layout.scene.boundaries[condition.boundary]
        if b.kind == "heat_flux":
            builder.flux(condition)
        elif b.kind == "temperature":
            builder.condition(c, condition)
        elif b.value:
            builder.condition(c, condition, float(b.value))  # type: ignore[arg-type]
    return builder.circuit(lambda line: True)


def current_circuit(layout: Layout, elements: Elements, inputs: int) -> Circuit:
    """The circuit of the current, in A and V, of the lines that conduct."""
    builder = Builder(layout, elements, inputs, True)
    conducts = [line.box.material.resistivity is not None for line in layout.lines]
    for i in np.flatnonzero(conducts).tolist():
        builder.along(i)
    for j, joint in enumerate(layout.wires):
        builder.joint(j, joint)
    for c, condition in enumerate(layout.electrodes):
        builder.condition(c, condition)
    for number in elements.terminals:
        builder.terminal(number)
    return builder.circuit(lambda line: conducts[line])


def weighted(matrix: sp.csr_matrix, factors: np.ndarray) -> sp.csr_matrix:
    """A matrix with its rows times some factors."""
    data = matrix.data * np.repeat(factors, np.diff(matrix.indptr))
    return sp.csr_matrix((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def factor(matrix: sp.csr_matrix) -> Any:
    """The LU factors of a symmetric matrix, real or complex, along an order made for its pattern."""
    options = {"SymmetricMode": True, "DiagPivotThresh": 0.01}
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options=options)
