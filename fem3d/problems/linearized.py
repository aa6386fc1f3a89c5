"""Nonlinear heat problems: their tangents about a state, and their quadratures.

The tangent about a state is K + R. K is the stiffness at the state's conductivity, symmetric and factorized; R is the
rest: the change by a rise of the conductivity under the present gradient, and of the Joule heat. The latter assumes a
current whose pattern stays while its size follows the resistance: rho' |J|^2 w, less twice the heat's load times the
relative change of the resistance in the circuit, a matrix of rank one.

GMRES solves (1 + K^-1 R) d = K^-1 b in few steps: K^-1 R is compact, as R has fewer derivatives than K.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.current import Conductor
from fem3d.problems.gmres import solve_by_gmres
from fem3d.problems.heat import HeatProblem
from fem3d.spaces.sparse import submatrix

# Further points along each axis, by which quadratures of laws are compared. The error by a kink jumps from rule to
# rule: it exceeds the sum of three differences for 1 of 500 random pairs of kinks, the larger of two for 24.
FINER = (1, 2, 3)
DUAL_RESIDUAL = 1e-6  # relative, of a dual solution: error bounds need three digits


@dataclass(frozen=True, eq=False)
class Rest:
    """``matrix`` (n, n) + ``columns``^T ``rows``, the latter two (k, n) each."""

    matrix: csc_array
    columns: np.ndarray
    rows: np.ndarray

    def __call__(self, u: np.ndarray) -> np.ndarray:
        """(..., n): its product with vectors (..., n)."""
        return (self.matrix @ u.T).T + (u @ self.rows.T) @ self.columns

    def transposed(self, factor: float = 1.0) -> Rest:
        """The transposed one, some times as large."""
        return Rest(csc_array(factor * self.matrix.T), self.rows, factor * self.columns)

    def part(self, kept: np.ndarray) -> Rest:
        """The rows and columns of some unknowns."""
        return Rest(submatrix(self.matrix, kept), self.columns[:, kept], self.rows[:, kept])


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearizedHeat(HeatProblem):
    """The tangent of an ``exact`` problem ``about`` a field (functions,): K for its stiffness, and R for its ``rest``.

    Its heat flow and the terms are the exact ones."""

    exact: HeatProblem
    about: np.ndarray
    rest: Rest

    @classmethod
    def of(cls, exact: HeatProblem, about: np.ndarray, stiffness: csc_array, rest: Rest) -> Self:
        """The tangent of a problem, with the Robin conditions of the linear one."""
        given = {f.name: getattr(exact, f.name) for f in fields(HeatProblem) if f.init} | {"stiffness": stiffness}
        return cls(**given, exact=exact, about=about, rest=rest)

    def lower(self, number: int) -> Self:
        kept = np.flatnonzero(self.domain.space.nested[number][self.order])
        return replace(super().lower(number), exact=self.exact.lower(number), rest=self.rest.part(kept))

    def outflow(self, rise: np.ndarray) -> np.ndarray:
        return self.exact.outflow(rise)

    def inner_rest(self) -> Rest:
        """The rest on the free dofs."""
        return self.rest.part(np.arange(self.free))

    def solve_dual(self, loads: np.ndarray, time: float | None = None) -> np.ndarray:
        solve = self.solve_steady if time is None else self.solve_shifted(time)
        rest = self.inner_rest().transposed(time or 1.0)

        def product(v: np.ndarray) -> np.ndarray:
            return v + solve(rest(v))

        return np.array([solve_by_gmres(product, first, DUAL_RESIDUAL)[0] for first in solve(loads)])

    def apply_transposed(self, z: np.ndarray) -> np.ndarray:
        return super().apply_transposed(z) + self.rest.transposed()(z)


def linearized(heat: HeatProblem, conductor: Conductor | None, rise: np.ndarray, density: np.ndarray) -> LinearizedHeat:
    """The tangent of a problem about a ``rise`` (all dofs), with a current of a ``density`` (A/m2) there."""
    u = heat.field(rise)
    symmetric = rest = csc_array((heat.domain.space.size,) * 2)
    for one, other in (term.tangent(u) for term in heat.terms):
        symmetric, rest = symmetric + one, rest if other is None else rest + other
    stiffness = csc_array(heat.stiffness + submatrix(symmetric, heat.order)) if heat.terms else heat.stiffness
    matrix = submatrix(csc_array(rest), heat.order)
    columns = rows = np.empty((0, heat.size))
    if conductor is not None and conductor.warms and len(density):
        heating, steepness = conductor.heating(density, density, rise), conductor.steepness(rise)
        matrix = csc_array(matrix - submatrix(conductor.on.mass_of(steepness * heating), heat.order))
        dissipated = float((conductor.on.weights * heating).sum())
        falls = 2 * conductor.share_of_drive(density, dissipated) / (dissipated or 1.0)
        columns = falls * heat.take(conductor.on.load(heating))[None]
        rows = heat.take(conductor.on.load(steepness * heating))[None]
    stiffness.sort_indices()
    return LinearizedHeat.of(heat, u, stiffness, Rest(matrix, columns, rows))


def nonlinear(heat: HeatProblem, conductor: Conductor | None) -> bool:
    """Whether a law of the temperature makes the steady equations nonlinear."""
    return bool(heat.terms) or (conductor is not None and conductor.law is not None)


def refine_quadratures(heat: HeatProblem, conductor: Conductor | None) -> list[tuple[HeatProblem, Conductor | None]]:
    """Return the problem by each of three finer quadratures of its laws (`FINER`)."""
    problems, terms = list[tuple[HeatProblem, Conductor | None]](), list[Any]([*heat.terms, heat.storage])
    for points in FINER:
        finer_terms = [term and replace(term, more=term.more + points) for term in terms]
        finer = replace(heat, terms=tuple(finer_terms[:-1]), storage=finer_terms[-1])
        finer.cache.update(heat.cache)
        problems.append((finer, conductor and conductor.finer(points)))
    return problems
