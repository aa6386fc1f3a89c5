"""The discrete heat problem of any mesh: M du/dt + K u = f(t), with u the rise above the scene's initial temperature.

The degrees of freedom (dofs) are coefficients of a hierarchical basis. Free dofs are numbered first, fixed dofs (of a
given temperature) last: the last rows of the same equations are the reactions, the heat that enters at fixed dofs. A
vector that vanishes at fixed dofs is (free dofs,), any other (all dofs,). Sources and given rises come as channels
(`statespace.channels`). `fem3d.problems.assembly` assembles the problem from a scene.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.cholesky import Factors, Ordering, Solver
from fem3d.problems.material_laws import Storage, Term
from fem3d.spaces.domain import Domain
from fem3d.spaces.sparse import submatrix
from scenes.model import Value
from statespace.channels import Inputs


class Cache(dict[Hashable, Any]):
    """Values that a problem computes on first use."""

    def get_or_make(self, name: Hashable, make: Callable[[], Any]) -> Any:
        """The value of a name, made if it is not there."""
        if name not in self:
            self[name] = make()
        return self[name]


@dataclass(frozen=True, eq=False)
class FaceFlow:
    """The heat that enters at faces: at no rise (channels,) in W, and per kelvin (all dofs,) in W/K."""

    entering: np.ndarray
    per_kelvin: np.ndarray


@dataclass(frozen=True, eq=False)
class HeatProblem:
    """Matrices and load vectors of the heat equation. Free dofs come before fixed dofs.

    Attributes
    ----------
    domain, free : the cells with the scene on them; number of free dofs
    order : (all dofs,), index of each dof among the functions of the domain's space
    elimination : the elimination order of vertices, edges, facets and cells
    stiffness, mass : (all dofs, all dofs), W/K and J/K
    loads, given : (channels, all dofs), W, and (channels, fixed dofs), the given rises (K)
    generated : heat of the sources per channel (W)
    shares : for each boundary of given temperature, its part (all dofs,) of the reaction of each fixed dof: tested
        with this vector, the equations give the heat that enters at the boundary
    edges : (fixed dofs, fixed dofs), at dofs where boundaries meet at an angle: the reactions of the edge alone
    face_flows : by boundary of given flux, convection or radiation, linear in the rise
    contradiction : (all dofs,), difference between contradictory given temperatures (K)
    terms, storage : the terms that make the problem nonlinear, and the heat storage that does so over time
    cache : computed so far: "solve_steady", "solve_shifted" with its shift, and by probe its "reading"
    """

    domain: Domain
    free: int
    order: np.ndarray
    elimination: Ordering
    stiffness: csc_array
    mass: csc_array
    loads: np.ndarray
    given: np.ndarray
    generated: np.ndarray
    shares: dict[str, np.ndarray]
    edges: csc_array
    face_flows: dict[str, FaceFlow]
    contradiction: np.ndarray
    terms: tuple[Term, ...]
    storage: Storage | None
    cache: Cache = field(init=False, default_factory=Cache)

    @property
    def inputs(self) -> Inputs:
        """The channels of sources and given values."""
        return self.domain.inputs

    @cached_property
    def unit(self) -> np.ndarray:
        """(all dofs,): coefficients of the constant 1."""
        return self.domain.space.unit[self.order]

    def field(self, u: np.ndarray) -> np.ndarray:
        """(..., functions): vectors (..., free or all dofs) as coefficients of the space's functions."""
        whole = self.whole(u)
        coefficients = np.zeros((*whole.shape[:-1], self.domain.space.size))
        coefficients[..., self.order] = whole
        return coefficients

    def take(self, row: np.ndarray) -> np.ndarray:
        """(..., all dofs): the rows of these dofs in (..., functions), for coefficients and for loads."""
        return row[..., self.order]

    def lower(self, number: int) -> Self:
        """The problem in a lower space that this one's holds (`Space.nested`): leading parts of the same matrices."""
        kept = np.flatnonzero(self.domain.space.nested[number][self.order])
        free = int((kept < self.free).sum())
        fixed = kept[free:] - self.free
        return replace(
            self, free=free, order=self.order[kept],
            stiffness=submatrix(self.stiffness, kept), mass=submatrix(self.mass, kept),
            loads=self.loads[:, kept], given=self.given[:, fixed],
            shares={name: share[kept] for name, share in self.shares.items()}, edges=submatrix(self.edges, fixed),
            face_flows={n: replace(f, per_kelvin=f.per_kelvin[kept]) for n, f in self.face_flows.items()},
            contradiction=self.contradiction[kept],
        )  # fmt: skip

    @property
    def size(self) -> int:
        """Free and fixed dofs together."""
        return int(self.stiffness.shape[0])

    @cached_property
    def inner_stiffness(self) -> csc_array:
        """The stiffness matrix of the free dofs."""
        return self.stiffness[: self.free, : self.free]

    @cached_property
    def inner_mass(self) -> csc_array:
        """The mass matrix of the free dofs."""
        return self.mass[: self.free, : self.free]

    def factors(self, matrix: csc_array, precision: type = float) -> Factors:
        """The factors of a matrix of the free dofs, which couples no others than the stiffness."""
        entities = self.domain.space.entity[self.order[: self.free]]
        self.elimination.hold(self.inner_stiffness, entities)
        return Factors(matrix, entities, self.elimination, precision)

    @property
    def solve_steady(self) -> Solver:
        """Solver of K rise = load at the free dofs, by one factorization; without an exit for heat, of
        (K + M / t) rise = load with the end t of the run."""

        def make() -> Solver:
            matrix, domain = self.inner_stiffness, self.domain
            if not domain.anchored:
                matrix = matrix + self.inner_mass / domain.scene.end_time
            return self.factors(matrix).solve

        return self.cache.get_or_make("solve_steady", make)

    def outflow(self, rise: np.ndarray) -> np.ndarray:
        """(all dofs,): the heat flow by conduction and faces at a rise (all dofs), in W: K rise, and the terms."""
        flow: np.ndarray = self.stiffness @ rise
        u = self.field(rise)
        for term in self.terms:
            flow += self.take(term.outflow(u))
        return flow

    def stored(self, rise: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """(all dofs,): the stored power (W) at a rise and its rate (all dofs)."""
        heat: np.ndarray = self.mass @ rate
        if self.storage is not None:
            heat = heat + self.take(self.storage.power(self.field(rise), self.field(rate)))
        return heat

    def solve_dual(self, loads: np.ndarray, time: float | None) -> np.ndarray:
        """(k, free dofs): the solutions of the transposed problem for loads (k, free dofs), with K or (M + time K)."""
        return self.solve_steady(loads) if time is None else self.solve_shifted(time)(loads)

    def solve_shifted(self, shift: float) -> Solver:
        """Solver of (M + shift K) u = b on the free dofs; the factors of the last shift are kept."""
        last, solve = self.cache.pop("solve_shifted", (None, None))
        if last != shift:
            solve = self.factors(self.inner_mass + shift * self.inner_stiffness).solve
        self.cache["solve_shifted"] = shift, solve
        return solve

    def let_go(self, steady: bool = False) -> None:
        """Release the factors of the last shift, and of the ``steady`` problem too; later calls make them anew."""
        for name in ["solve_shifted", *["solve_steady"] * steady]:
            self.cache.pop(name, None)

    @cached_property
    def lifts(self) -> np.ndarray:
        """(channels, all dofs): for each channel the rise that its given temperatures alone keep up."""
        n = self.free
        lifts = np.zeros((self.inputs.count, self.size))
        lifts[:, n:] = self.given
        for lift in lifts:
            if lift.any():
                lift[:n] = self.solve_steady(-(self.stiffness @ lift)[:n])
                if self.domain.anchored:
                    lift[:] = self.refine_iteratively(lift, np.zeros(self.size))
        return lifts

    def refine_iteratively(self, rise: np.ndarray, source: np.ndarray) -> np.ndarray:
        """(all dofs,): a rise (all dofs) after iterative refinement for a source (W, all dofs), with residuals in
        extended precision, which brings the heat balance to rounding even where cells are needles."""
        k, n, inner = self.inner_stiffness, self.free, rise[: self.free]
        load = (source - self.stiffness @ np.concatenate([np.zeros(n), rise[n:]]))[:n]
        entries = k.data.astype(np.longdouble)
        for _ in range(2 if n else 0):
            # The matrix is symmetric: its columns serve as rows.
            residual = load - np.add.reduceat(entries * inner[k.indices], k.indptr[:-1])
            inner = inner + self.solve_steady(residual.astype(float))
        return np.concatenate([inner, rise[n:]])

    def norm(self, u: np.ndarray) -> float:
        """Root of the integral of rho c u^2 for u (free dofs,)."""
        return float(np.sqrt(u @ (self.inner_mass @ u)))

    def whole(self, u: np.ndarray) -> np.ndarray:
        """(..., all dofs): vectors (..., free or all dofs) with zeros at fixed dofs that they lack."""
        width = self.size - u.shape[-1]
        return np.concatenate([u, np.zeros((*u.shape[:-1], width))], axis=-1) if width else u

    def disputed(self, names: Sequence[str]) -> np.ndarray:
        """(k, all dofs): vectors like ``shares``. The heat that enters at some boundaries together may be off by the
        sum of the heats that these give, because boundaries share edges at an angle: there a share is a leading term.

        With a flux like r^(s - 1) on both, the true part of a boundary with the share t is t^s / (t^s + (1 - t)^s): off
        by 0.79 t (1 - t) at most for s = 2/3, of a re-entrant edge, between intervals whose lengths differ by a layer
        (meshes.grading.RATIO).
        """
        together: np.ndarray = sum((self.shares[name][self.free :] for name in names), np.zeros(self.edges.shape[0]))
        weights = 0.8 * together * (1 - together) * (self.edges.diagonal() > 0)
        at = np.flatnonzero(weights > 1e-12)
        fields = np.zeros((len(at), self.size))
        fields[:, self.free :] = weights[at, None] * self.edges[at].toarray()
        return fields

    @cached_property
    def reaction_rows(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """For each boundary of given temperature the rows (all dofs,) of its heat flow per rise and per rate."""
        return {name: (self.apply_transposed(v), self.mass @ v) for name, v in self.shares.items()}

    def apply_transposed(self, z: np.ndarray) -> np.ndarray:
        """(all dofs,): the transposed stiffness matrix times a vector (all dofs,)."""
        return np.asarray(self.stiffness @ z)


def as_rise(channels: Inputs, temperature: Value, initial: float) -> np.ndarray:
    """(channels,): a temperature (K) as a rise."""
    rises = channels.split(temperature)
    rises[0] -= initial
    return rises
