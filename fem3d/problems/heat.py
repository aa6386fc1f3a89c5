"""The discrete heat problem of any mesh: M d(rise)/dt + K rise = source, with the fixed nodes kept for their reactions.

The unknown is the rise above the scene's initial temperature. Its degrees of freedom, of a hierarchical basis, are here
called nodes, although only those of vertices are nodal values. The free nodes are numbered first, the fixed nodes (a
given temperature) last, so that the reactions, the heat that enters at the fixed nodes, are the last rows of the same
equations. A field that vanishes at the fixed nodes is a vector of the free nodes, any other a vector of all. Sources
and given rises come as channels (`statespace.channels`). `fem3d.problems.assembly` assembles it from a scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.cholesky import Factors, Kept, Ordering, Solver, part
from fem3d.problems.following import Rest, Storage, Term
from fem3d.spaces.domain import Domain
from scenes.model import Value
from statespace.channels import Inputs


@dataclass(frozen=True, eq=False)
class Film:
    """A boundary of given flux or convection: the heat that enters at no rise (W, per channel), and per kelvin (W/K,
    all nodes)."""

    entering: np.ndarray
    per_kelvin: np.ndarray


@dataclass(frozen=True, eq=False)
class HeatProblem:
    """Matrices and load vectors of the heat equation. Free nodes come before fixed nodes.

    Attributes
    ----------
    free, end_time : number of free nodes; end of the run (s)
    stiffness, mass : (all nodes, all nodes), W/K and J/K
    loads, given : (channels, all nodes), W, and (channels, fixed nodes), the given rises (K)
    generated : heat of the sources per channel (W)
    held : for each boundary of given temperature, its part (all nodes,) of the reaction of each fixed node: tested with
        it as a field, the equations give the heat that enters at the boundary
    edges : (fixed nodes, fixed nodes), at nodes where boundaries meet at an angle: the reactions of the edge alone
    anchored : whether every part has an exit for heat, so that K is regular
    unit : (all nodes,), coefficients of the constant 1
    groups, ordering : (all nodes,), number of the vertex, edge, facet or cell of each node; their elimination order
    order : (all nodes,), index of each node among the functions of the domain's space
    contradiction : (all nodes,), difference between contradictory given temperatures (K)
    terms, storage : the terms that make the problem nonlinear, and the heat storage that does so over time
    about, rest, exact : only of a linearized problem (`fem3d.problems.assembly`): the field (functions,) of the
        linearization, the part of the tangent beside the stiffness, and the exact problem
    """

    inputs: Inputs
    free: int
    stiffness: csc_array
    mass: csc_array
    loads: np.ndarray
    given: np.ndarray
    generated: np.ndarray
    held: dict[str, np.ndarray]
    edges: csc_array
    films: dict[str, Film]
    anchored: bool
    end_time: float
    unit: np.ndarray
    groups: np.ndarray
    ordering: Ordering
    domain: Domain
    order: np.ndarray
    contradiction: np.ndarray
    terms: tuple[Term, ...] = ()
    storage: Storage | None = None
    rest: Rest | None = None
    about: np.ndarray | None = None
    exact: HeatProblem | None = None
    kept: Kept = field(init=False, default_factory=Kept)

    def field(self, u: np.ndarray) -> np.ndarray:
        """(..., functions): a field (free or all nodes) as coefficients of the space's functions."""
        whole = self.whole(u)
        coefficients = np.zeros((*whole.shape[:-1], self.domain.space.size))
        coefficients[..., self.order] = whole
        return coefficients

    def take(self, row: np.ndarray) -> np.ndarray:
        """(..., all nodes): the unknowns of (..., functions)."""
        return row[..., self.order]

    def lower(self, level: int) -> HeatProblem:
        """The problem in a lower space that this one's holds (`Space.nested`): leading parts of the same matrices."""
        in_lower = self.domain.space.nested[level][self.order]
        kept = np.flatnonzero(in_lower)
        free = int(in_lower[: self.free].sum())
        fixed = kept[free:] - self.free
        return replace(
            self, free=free, stiffness=part(self.stiffness, kept), mass=part(self.mass, kept),
            loads=self.loads[:, kept], given=self.given[:, fixed],
            held={name: share[kept] for name, share in self.held.items()}, edges=part(self.edges, fixed),
            films={name: replace(f, per_kelvin=f.per_kelvin[kept]) for name, f in self.films.items()},
            unit=self.unit[kept], groups=self.groups[kept], order=self.order[kept],
            contradiction=self.contradiction[kept], rest=None if self.rest is None else self.rest.part(kept),
            exact=None if self.exact is None else self.exact.lower(level),
        )  # fmt: skip

    @property
    def size(self) -> int:
        """Free and fixed nodes together."""
        return int(self.stiffness.shape[0])

    @cached_property
    def inner_stiffness(self) -> csc_array:
        """The stiffness matrix of the free nodes."""
        return self.stiffness[: self.free, : self.free]

    @cached_property
    def inner_mass(self) -> csc_array:
        """The mass matrix of the free nodes."""
        return self.mass[: self.free, : self.free]

    def factors(self, matrix: csc_array) -> Factors:
        """The factors of a matrix of the free nodes, which couples no others than the stiffness."""
        self.ordering.hold(self.inner_stiffness, self.groups[: self.free])
        return Factors(matrix, self.groups[: self.free], self.ordering)

    @property
    def solve_steady(self) -> Solver:
        """Solver of K rise = load at the free nodes, by one factorization; without an exit for heat, of
        (K + M / end_time) rise = load."""

        def made() -> Solver:
            matrix = self.inner_stiffness
            matrix = matrix if self.anchored else combined(matrix, 1.0 / self.end_time, self.inner_mass)
            return self.factors(matrix).solve

        return self.kept.made("solve_steady", made)

    def outflow(self, rise: np.ndarray) -> np.ndarray:
        """(all nodes,): the heat flow by conduction and films at a rise (all nodes), in W: K rise, and the terms."""
        problem = self.exact or self
        flow = problem.stiffness @ rise
        for term in problem.terms:
            flow += problem.take(term.outflow(problem.field(rise)))
        return flow

    def stored(self, rise: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """(all nodes,): the stored power (W) at a rise and its rate (all nodes)."""
        heat: np.ndarray = self.mass @ rate
        if self.storage is not None:
            heat = heat + self.take(self.storage.between(self.field(rise), self.field(rate)))
        return heat

    def solve_dual(self, loads: np.ndarray, time: float | None = None) -> np.ndarray:
        """(k, free nodes): the solutions of the transposed problem, linearized where it is nonlinear, for loads of the
        same shape; of the steady problem, or with (M + time K) in its place."""
        solve = self.solve_steady if time is None else self.solve_shifted(time)
        if self.rest is None:
            return solve(loads)
        return self.inner_rest.times(time or 1.0).transposed().solve(solve, loads)

    @cached_property
    def inner_rest(self) -> Rest:
        """The rest of the tangent on the free nodes."""
        assert self.rest is not None
        return self.rest.part(np.arange(self.free))

    def solve_shifted(self, shift: float) -> Solver:
        """Solver of (M + shift K) u = b on the free nodes; the factors of the last shift are kept."""
        last, solve = self.kept.pop("solve_shifted", (None, None))
        if last != shift:
            solve = self.factors(combined(self.inner_mass, shift, self.inner_stiffness)).solve
        self.kept["solve_shifted"] = shift, solve
        return solve

    def let_go(self, steady: bool = False) -> None:
        """Release the factors of the last shift, and of the ``steady`` problem too; later calls make them anew."""
        for name in ["solve_shifted", *["solve_steady"] * steady]:
            self.kept.pop(name, None)

    @cached_property
    def lifts(self) -> np.ndarray:
        """(channels, all nodes): for each channel the rise that its given temperatures alone keep up."""
        n = self.free
        lifts = np.zeros((self.inputs.count, self.size))
        lifts[:, n:] = self.given
        for lift in lifts:
            if lift.any():
                lift[:n] = self.solve_steady(-(self.stiffness @ lift)[:n])
                if self.anchored:
                    lift[:] = self.improve(lift, np.zeros(self.size))
        return lifts

    def improve(self, rise: np.ndarray, source: np.ndarray) -> np.ndarray:
        """(all nodes,): a rise (all nodes) after iterative refinement for a source (W, all nodes), with residuals in
        extended precision, which brings the heat balance to rounding even where cells are needles."""
        k, n, inner = self.inner_stiffness, self.free, rise[: self.free]
        load = (source - self.stiffness @ np.concatenate([np.zeros(n), rise[n:]]))[:n]
        entries = k.data.astype(np.longdouble)
        for _ in range(2 if n else 0):
            # The matrix is symmetric: its columns serve as rows.
            residual = load - np.add.reduceat(entries * inner[k.indices], k.indptr[:-1])
            change = self.solve_steady(residual.astype(float))
            inner = inner + change
            if np.abs(change).max() < 1e-8 * np.abs(inner).max():
                break  # the next change is as much smaller than this one, below rounding
        return np.concatenate([inner, rise[n:]])

    def norm(self, u: np.ndarray) -> float:
        """Root of the integral of rho c u^2 of a field at the free nodes."""
        return float(np.sqrt(u @ (self.inner_mass @ u)))

    def whole(self, field: np.ndarray) -> np.ndarray:
        """(..., all nodes): fields at the free nodes with zeros at the fixed nodes."""
        width = self.size - field.shape[-1]
        return np.concatenate([field, np.zeros((*field.shape[:-1], width))], axis=-1) if width else field

    def jumps(self, end: float) -> np.ndarray:
        """Instants (s) inside (0, end) at which a given temperature jumps."""
        held = self.lifts.any(axis=1)
        return np.array([t for t in self.inputs.knots(end) if (self.inputs.jumps(t) * held).any()])

    def disputed(self, names: Sequence[str]) -> np.ndarray:
        """(k, all nodes): fields like ``held``. The heat that enters at some boundaries together may be off by the sum
        of their sizes, because boundaries share edges at an angle: there each part is only a leading term.

        With a flux like r^(s - 1) on both, the true part of a boundary with the share t is t^s / (t^s + (1 - t)^s): off
        by 0.79 t (1 - t) at most for s = 2/3, of a re-entrant edge, between intervals whose lengths differ by a layer
        (meshes.grading.RATIO).
        """
        together: np.ndarray = sum((self.held[name][self.free :] for name in names), np.zeros(self.edges.shape[0]))
        weights = 0.8 * together * (1 - together) * (self.edges.diagonal() > 0)
        at = np.flatnonzero(weights > 1e-12)
        fields = np.zeros((len(at), self.size))
        fields[:, self.free :] = weights[at, None] * self.edges[at].toarray()
        return fields

    @cached_property
    def held_rows(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """For each boundary of given temperature the rows (all nodes,) of its heat flow per rise and per rate."""
        return {name: (self.turned(v), self.mass @ v) for name, v in self.held.items()}

    def turned(self, z: np.ndarray) -> np.ndarray:
        """(all nodes,): the transposed tangent times a field (all nodes), in W per K of the test function."""
        tested: np.ndarray = self.stiffness @ z
        return tested if self.rest is None else tested + self.rest.transposed()(z)


def combined(a: csc_array, factor: float, b: csc_array) -> csc_array:
    """a + factor * b."""
    if a.indices is b.indices or (a.nnz == b.nnz and (a.indices == b.indices).all()):
        return csc_array((a.data + factor * b.data, a.indices, a.indptr), shape=a.shape)
    return csc_array(a + factor * b)


def above(channels: Inputs, temperature: Value, initial: float) -> np.ndarray:
    """(channels,): a temperature (K) as a rise."""
    rises = channels.split(temperature)
    rises[0] -= initial
    return rises
