"""Heat conduction whose conductivity follows the temperature, as a term beside the linear problem.

The linear problem has the conductivity k0 of the initial temperature. `Conduction` adds the integral of (k(T) - k0)
grad u . grad v, by a quadrature of its own, and what its tangent is made of: the matrix of k(T) - k0, symmetric, and
the integral of k'(T) w grad u . grad v, which is not. A term of another kind has the methods of `Term` and joins
`HeatProblem.terms`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.sparse import coo_array, csc_array

from fem3d.spaces.cut import Boxes, joined
from fem3d.spaces.domain import Domain
from fem3d.spaces.integrals import Cells, Faces, halves
from scenes import laws, physics
from scenes.laws import Property, Table

COLDEST = 1.0  # K: a state on the way to the solution may lie below, where no law says anything
# Of the coldest temperature that a scene may have: polynomials swing below it beside steep rises, and a law that is
# followed there makes equations of a coarse mesh that have no solution. One that is known to a half is nowhere so cold.
SWING = 0.5
# Of the span of the points of a quadrature, which a cell may go on beyond them: two points leave 1/4 (1/sqrt(3) - 1/2
# on either side over 1/sqrt(3)), more of them less.
OUTSIDE = 0.37
MORE = 1  # points along each axis beyond those of the linear problem: see `fem3d.solution.newton` for what they leave
FINER = 2  # points along each axis more, where boxes don't help


class Term(Protocol):
    """What makes the heat problem nonlinear: at a field u (functions,), a rise in K."""

    def outflow(self, u: np.ndarray) -> np.ndarray:
        """(functions,): what it adds to K u, in W."""

    def tangent(self, u: np.ndarray) -> tuple[csc_array, csc_array | None]:
        """(functions, functions) twice, in W/K: a symmetric part of its derivative, with which K stays positive
        definite, and the rest where there is one."""

    def bent(self, u: np.ndarray) -> np.ndarray:
        """(3, all cells): by how much u (K) changes along each axis of the cells in which the term bends, else zero."""

    def finer(self, *fields: np.ndarray) -> Term:
        """The same by a quadrature that is finer for some fields u, which tells the error of its own."""


class OfCells:
    """A property (by its key) on some cells, as a function of the temperature at points (cells, points): (cells,
    points), or (3, cells, points) where it differs along the axes."""

    def __init__(self, domain: Domain, key: str, cells: np.ndarray) -> None:
        given = [m.law(key) for m in domain.materials]
        bodies = domain.body[cells]
        self._start = domain.scene.initial_temperature
        self._coldest = max(COLDEST, SWING * physics.coldest(domain.scene))
        self._axes = any(isinstance(given[b], tuple) for b in np.unique(bodies))
        kinds, self._kind = np.unique(bodies, return_inverse=True)
        self._parts = [(np.flatnonzero(bodies == b), given[b]) for b in kinds.tolist()]

    def value(self, rise: np.ndarray) -> np.ndarray:
        """The property at a rise (K)."""
        return self._made(rise, lambda law, t: law(t) if callable(law) else np.full_like(t, law))

    def slope(self, rise: np.ndarray) -> np.ndarray:
        """Its derivative (per K): none where the value is that of the coldest temperature."""
        slopes = self._made(rise, lambda law, t: law.slope(t) if callable(law) else np.zeros_like(t))
        return np.asarray(np.where(self._start + rise < self._coldest, 0.0, slopes))

    def on(self, cells: Cells, u: np.ndarray, made: Made | None = None) -> np.ndarray:
        """(cells, points), or with axes in front: what is ``made`` of the property at a field u (functions,), itself by
        default, as `Cells.averaged` has it."""
        made = made or OfCells.value
        return cells.averaged(u, lambda at, rise: made(self if isinstance(at, slice) else self.of(at), rise))

    def above(self, rise: np.ndarray) -> np.ndarray:
        """Its integral over the temperature, from the initial one to a rise (K) above."""
        start = np.full_like(rise, self._start)
        return self._made(rise, lambda law, t: law.integral(t) - law.integral(start[: len(t)]) if callable(law) else
                          law * (t - self._start))  # fmt: skip

    def of(self, cells: slice | np.ndarray) -> OfCells:
        """That of some of the cells, by their places among them, each as often as it is there."""
        some = copy(self)
        some._kind = self._kind[cells]
        some._parts = [(np.flatnonzero(some._kind == k), given) for k, (_, given) in enumerate(self._parts)]
        return some

    def bends(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """(cells,): where a table has a bend between two rises (cells,), in K."""
        bent = np.zeros(len(low), bool)
        for at, given in self._parts:
            for law in laws.of(given):
                for bend in getattr(law, "temperatures", ()):
                    bent[at] |= (self._start + low[at] < bend) & (bend < self._start + high[at])
        return bent

    def bent(self, on: Cells, u: np.ndarray) -> np.ndarray:
        """The cells, by their place among those that integrals are ``on``, in which a law bends between the
        temperatures of a field u (functions,)."""
        if not any(isinstance(law, Table) for _, given in self._parts for law in laws.of(given)):
            return np.empty(0, int)
        rise = on.value(u)
        low, high = rise.min(axis=1), rise.max(axis=1)
        beyond = OUTSIDE * (high - low)
        return np.flatnonzero(self.bends(low - beyond, high + beyond))

    def _made(self, rise: np.ndarray, evaluate: Callable[[Property, np.ndarray], np.ndarray]) -> np.ndarray:
        temperature = np.maximum(self._start + rise, self._coldest)
        values = np.empty((*((3,) if self._axes else ()), *rise.shape))
        for at, given in self._parts:
            if self._axes:
                for d, law in enumerate(laws.along(given)):
                    values[d, at] = evaluate(law, temperature[at])
            else:
                values[at] = evaluate(given, temperature[at])
        return values


Made = Callable[[OfCells, np.ndarray], np.ndarray]


def finer(law: OfCells, on: Cells, cells: np.ndarray, fields: Sequence[np.ndarray]) -> tuple[Boxes, np.ndarray]:
    """The boxes of those ``cells`` in which a law bends between the temperatures of any of some fields (functions,),
    cut further where it does; and the cells (k,) in which it does and which may have no more boxes."""
    boxes, changes = _bent(law, on, cells, fields)
    bent = np.asarray(changes.any(axis=0))
    smaller = boxes.of(bent).cut(changes[:, bent])
    counts = np.bincount(np.concatenate([boxes.cells[~bent], smaller.cells]), minlength=cells.max(initial=0) + 1)
    few = counts <= on.most_boxes
    boxes, stuck = boxes.of(~bent | ~few[boxes.cells]), np.unique(boxes.cells[bent & ~few[boxes.cells]])
    boxes = joined([boxes, smaller.of(few[smaller.cells])])
    return boxes.of(boxes.sides.min(axis=0) < 1), stuck


def _bent(law: OfCells, on: Cells, cells: np.ndarray, fields: Sequence[np.ndarray]) -> tuple[Boxes, np.ndarray]:
    """All boxes of some cells, those that are not cut as one each; and by how much fields change along the axes of each
    (3, boxes), zero where the law doesn't bend between their temperatures."""
    boxes, changes = Boxes.whole(cells), np.zeros((3, len(cells)))
    for u in fields:
        if len(bent := law.bent(on, u)):
            changes[:, bent] = np.maximum(changes[:, bent], on.within(on.gradient(u))[:, bent])
    if on.cut is None:
        return boxes, changes
    of_boxes, law = np.zeros((3, len(on.cut.owner))), law.of(on.cut.owner)
    for u in fields:
        low, high = on.cut.extremes(u)
        of_boxes = np.maximum(of_boxes, law.bends(low, high) * on.cut.changes(u))
    rest = np.setdiff1d(np.arange(len(cells)), on.cut.places)
    return joined([boxes.of(rest), on.cut.boxes]), np.concatenate([changes[:, rest], of_boxes], axis=1)


def following(domain: Domain, key: str) -> np.ndarray:
    """The cells whose property of a key follows the temperature."""
    follows = np.array([laws.varies(getattr(m, key)) for m in domain.materials])
    return np.flatnonzero(follows[domain.body])


@dataclass(frozen=True, eq=False)
class Conduction:
    """The conductivity beyond that of the initial temperature, on the cells where it follows; with so many ``more``
    points (all cells,) along each axis than else, and the ``boxes`` that cells are cut into where a law bends."""

    domain: Domain
    more: np.ndarray | None = None
    boxes: Boxes | None = None

    @cached_property
    def parts(self) -> list[tuple[Cells, OfCells, np.ndarray, np.ndarray]]:
        """Cells with a quadrature, the law and its value at the initial temperature there, and their numbers."""
        parts, space = [], self.domain.space
        for alike in space.alike(following(self.domain, "thermal_conductivity")):
            more = np.zeros(len(alike), int) if self.more is None else self.more[alike]
            for number in np.unique(more).tolist():
                cells = alike[more == number]
                on = space.on(cells, MORE + number, self.boxes)
                law = OfCells(self.domain, "thermal_conductivity", cells)
                parts.append((on, law, law.value(np.zeros((len(cells), 1))), cells))
        return parts

    def outflow(self, u: np.ndarray) -> np.ndarray:
        """(functions,): int (k - k0) grad u . grad v, in W."""
        return self.between(u, u)

    def between(self, u: np.ndarray, w: np.ndarray) -> np.ndarray:
        """(functions,): int (k - k0) grad w . grad v with the conductivity of a field u, in W."""
        flow = np.zeros(self.domain.space.size)
        for on, law, cold, _ in self.parts:
            if w[on.dofs].any():
                flow += on.flow((law.on(on, u) - cold) * on.gradient(w))
        return flow

    def tangent(self, u: np.ndarray) -> tuple[csc_array, csc_array]:
        """(functions, functions) twice: the integrals of (k - k0) grad w . grad v and of k' w grad u . grad v."""
        # Both have one pattern, so both travel through one conversion as a complex number.
        entries = []
        for on, law, cold, _ in self.parts:
            one, other = on.tangent(law.on(on, u) - cold, law.on(on, u, OfCells.slope) * on.gradient(u))
            entries.append((one + 1j * other).ravel())
        size = self.domain.space.size
        return halves(csc_array(coo_array((np.concatenate(entries), self._places), shape=(size, size))))

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """The rows and the columns of the entries of all cells' blocks."""
        rows, columns = [], []
        for on, _, _, _ in self.parts:
            dofs = on.dofs.astype(np.int32)
            shape = (*dofs.shape, dofs.shape[1])
            rows.append(np.broadcast_to(dofs[:, :, None], shape).ravel())
            columns.append(np.broadcast_to(dofs[:, None], shape).ravel())
        return np.concatenate(rows), np.concatenate(columns)

    def bent(self, u: np.ndarray) -> np.ndarray:
        """(3, all cells): by how much a field u changes along each axis of the cells where a law bends between its
        temperatures (K); zero elsewhere."""
        changes = np.zeros((3, len(self.domain.body)))
        for on, law, _, cells in self.parts:
            at = law.bent(on, u)
            if len(at):
                changes[:, cells[at]] = on.within(on.gradient(u))[:, at]
        return changes

    def finer(self, *fields: np.ndarray) -> Conduction:
        """By smaller boxes where a law bends between the temperatures of a field u; by `FINER` more points along each
        axis where these don't help, and without any bend in all cells."""
        cut = [finer(law, on, cells, fields) for on, law, _, cells in self.parts]
        boxes, stuck = joined([b for b, _ in cut]), np.concatenate([s for _, s in cut])
        more = np.zeros(len(self.domain.body), int) if self.more is None else self.more.copy()
        before = 0 if self.boxes is None else len(self.boxes.cells)
        more[stuck if len(stuck) or len(boxes.cells) > before else slice(None)] += FINER
        return Conduction(self.domain, more, boxes)


@dataclass(frozen=True, eq=False)
class Storage:
    """The heat capacity beyond that of the initial temperature, on the cells where it follows the temperature."""

    domain: Domain

    @cached_property
    def parts(self) -> list[tuple[Cells, OfCells, np.ndarray, np.ndarray]]:
        """Cells with a quadrature, the law of the specific heat and its value at the initial temperature there, and
        their density (cells, 1)."""
        parts, space = [], self.domain.space
        density = self.domain.per_cell("density")
        for alike in space.alike(following(self.domain, "specific_heat")):
            law = OfCells(self.domain, "specific_heat", alike)
            cold = law.value(np.zeros((len(alike), 1)))
            parts.append((space.on(alike, MORE), law, cold, density[alike][:, None]))
        return parts

    def between(self, u: np.ndarray, w: np.ndarray) -> np.ndarray:
        """(functions,): int rho (c - c0) w v with the specific heat at a field u: of w a rate, in W."""
        heat = np.zeros(self.domain.space.size)
        for on, law, cold, density in self.parts:
            if w[on.dofs].any():
                heat += on.load(density * (law.value(on.value(u)) - cold) * on.value(w))
        return heat

    def heat(self, u: np.ndarray) -> float:
        """What is stored at a field u beyond c0 times it (J)."""
        heat = 0.0
        for on, law, cold, density in self.parts:
            rise = on.value(u)
            heat += float((on.weights * density * (law.above(rise) - cold * rise)).sum())
        return heat


def storage(domain: Domain) -> Storage | None:
    """What makes the heat that a domain stores nonlinear; None where nothing does."""
    return Storage(domain) if len(following(domain, "specific_heat")) else None


def at_faces(domain: Domain, u: np.ndarray, faces: Faces, cells: np.ndarray) -> np.ndarray:
    """(facets, points), or with axes in front: the conductivity at a field u of facets seen from some cells."""
    return OfCells(domain, "thermal_conductivity", cells).value(faces.value(u))


def terms(domain: Domain) -> tuple[Term, ...]:
    """What a conductivity that follows the temperature adds to the heat problem of a domain."""
    return (Conduction(domain),) if len(following(domain, "thermal_conductivity")) else ()
