"""Newton's method for the coupled equations of temperature and current (`fem3d.solution.steady`).

The unknowns are one vector x: the rises at the free dofs, the unknown potentials, and mu, by which the Joule heat is
scaled, or without a current the heat sources and given temperatures. A step solves the exact linearization by GMRES,
preconditioned with Cholesky factors of approximations of both diagonal blocks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem3d.problems.cholesky import Solver
from fem3d.problems.current import Conductor
from fem3d.problems.gmres import solve_by_gmres
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import LinearizedHeat, linearized, nonlinear, refine_quadratures
from fem3d.problems.material_laws import Conduction, missed_by_quadrature
from scenes.errors import BeyondLawError, NumericsError

# Relative residual of a linear system: a step of Newton's method is about this part of the one before, or larger.
RESIDUAL = 1e-4
MOST_NEWTON = 20  # steps at one point: at the slowest contraction, `CONTRACTS`, they gain six digits
# Contraction of Newton's steps that counts as convergence (Deuflhard, Newton Methods for Nonlinear Problems, 2004,
# section 2.1: 1/2).
CONTRACTS = 0.5
HOTTEST = 1e5  # K, beyond any solid: paths end at a rise so large; Newton's method alone goes to twice that


class NotConvergedError(NumericsError):
    """Newton's method does not converge from where it started."""


class CoarseMeshError(NumericsError):
    """The mesh is too coarse for a law, or has no solution in a lower space although it has one in its own."""


class VanishedError(NotConvergedError):
    """The resistivity is not positive everywhere."""


@dataclass(frozen=True, eq=False)
class Point:
    """A state of the coupled equations.

    Attributes
    ----------
    x : the unknowns
    rise, potential : (all dofs,) in K, and (functions,) in V
    resistivity, density : (rows, points) in ohm m, and the current density (3, rows, points) in A/m2
    driven : (all dofs,), the heat by the whole drive, in W
    residual : (unknowns but mu,), the missing heat (W) and current (A)
    """

    x: np.ndarray
    rise: np.ndarray
    potential: np.ndarray
    resistivity: np.ndarray
    density: np.ndarray
    driven: np.ndarray
    residual: np.ndarray

    @property
    def mu(self) -> float:
        """The square of the fraction of the drive; for heat alone the fraction."""
        return float(self.x[-1])


class Equations:
    """The coupled equations of a heat problem and its conductor."""

    def __init__(self, heat: HeatProblem, conductor: Conductor | None) -> None:
        self.heat, self.conductor = heat, conductor
        # Tangents of laws take longest, and Newton's method does with those of the linear problem's quadrature.
        terms: list[Any] = [*heat.terms]
        self.of_tangents = replace(heat, terms=tuple(replace(term, more=0) for term in terms))
        self.nonlinear = nonlinear(heat, conductor)
        self.electric = conductor is not None and bool(conductor.voltages[0].any())
        potentials = 0 if conductor is None else len(conductor.free) + len(conductor.terminals)
        self.along_mu = np.append(np.zeros(heat.free + potentials), 1.0)

    def at(self, x: np.ndarray) -> Point:
        """The point at unknowns. Raises NotConvergedError where there is none."""
        heat, c, n = self.heat, self.conductor, self.heat.free
        if not np.isfinite(x).all():
            raise NotConvergedError("Newton's method diverges")
        rise = np.concatenate([x[:n], heat.given[0] * (1.0 if self.electric else x[-1])])
        # The drive does not scale the heat sources beside a current.
        unscaled, driven = heat.loads[0] * self.electric, heat.loads[0] * (not self.electric)
        lacking = potential = resistivity = density = np.empty(0)
        if c is not None:
            resistivity = c.resistivity(rise)
            if not (resistivity > 0).all():
                raise VanishedError("the resistivity vanishes on the way to the steady state")
            potential = c.given(c.voltages[0]) + c.expanded(x[n:-1])
            density = -c.on.gradient(potential) / resistivity
            driven = driven + heat.take(c.on.load(resistivity * (density**2).sum(axis=0)))
            lacking = c.residual(potential, resistivity, c.voltages[0])
        heating = (unscaled + x[-1] * driven - heat.outflow(rise))[:n]
        return Point(x, rise, potential, resistivity, density, driven, np.concatenate([heating, lacking]))

    def at_rise(self, rise: np.ndarray, mu: float, potential: np.ndarray | None = None) -> Point:
        """The point of a rise (all dofs,), with a ``potential`` (functions,), else with the potential there."""
        c, potentials = self.conductor, np.empty(0)
        if c is not None:
            if not (c.resistivity(rise) > 0).all():
                raise VanishedError("the resistivity is not positive at the given temperatures")
            potentials = c.unknowns(c.solve(rise, c.voltages[0]).potential if potential is None else potential)
        return self.at(np.concatenate([rise[: self.heat.free], potentials, [mu]]))

    def size(self, change: np.ndarray, point: Point) -> float:
        """The relative size of a change: of the largest rise, of the largest voltage, of mu."""
        n = self.heat.free
        rise = largest(change[:n]) / (max(largest(point.rise), largest(change[:n])) or 1.0)
        volts = largest(change[n:-1]) / (largest(point.potential) or 1.0)
        return max(rise, volts, abs(float(change[-1])) / max(point.mu, 1e-300))

    def layer_error(self, point: Point) -> float:
        """The relative error by layers of laws that lie between the points of their quadratures."""
        heat, c, u = self.heat, self.conductor, self.heat.field(point.rise)
        parts = [part for term in heat.terms if isinstance(term, Conduction) for part in term.groups]
        laws = [(part.law, part.cells, part.on.value(u)) for part in parts]
        if c is not None and c.law is not None:
            laws.append((c.law, c.cells, c.on.value(u)[: len(c.cells)]))
        return max((missed_by_quadrature(heat.domain, *each, u) for each in laws), default=0.0)


class Linearization:
    """The derivative of the equations at a point: v, w and m being the changes of u, phi and mu,

        A'(u) v + mu (rho'/rho) h v + 2 mu J . grad w - m q,    E(u) w + J (rho'/rho) v . grad,

    h = rho |J|^2 tested with functions. ``driven`` (free dofs,) is q less what given temperatures add.
    """

    def __init__(self, equations: Equations, point: Point) -> None:
        self.equations, self.point = equations, point
        heat, c = equations.of_tangents, equations.conductor
        self.tangent: HeatProblem = linearized(heat, None, point.rise, np.empty(0)) if heat.terms else heat
        self._given = heat.given[0] * (not equations.electric)
        if c is not None:
            self.precondition = c.preconditioner(point.resistivity)
        if c is not None and c.warms:
            self._steep = np.broadcast_to(c.steepness(point.rise), c.on.weights.shape)
            self._heating = point.resistivity * (point.density**2).sum(axis=0)
        self.driven = -self(equations.along_mu)[: heat.free]

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Its product with a change (unknowns,): the changes of heat (W) and current (A) that leave."""
        heat, c, point = self.equations.heat, self.equations.conductor, self.point
        v, w = x[: heat.free], x[heat.free : -1]
        whole = np.concatenate([v, x[-1] * self._given])
        leaving = self.tangent.stiffness @ whole - x[-1] * point.driven
        if isinstance(self.tangent, LinearizedHeat):
            leaving = leaving + self.tangent.rest(whole)
        leaving = leaving[: heat.free]
        if c is None:
            return leaving
        slope = c.on.gradient(c.expanded(w))
        made, charge = -2 * (point.density * slope).sum(axis=0), slope / point.resistivity
        if c.warms:
            warmed = self._steep * c.on.value(heat.field(heat.whole(v)))
            made = made - self._heating * warmed
            charge = charge + point.density * warmed
        leaving = leaving - point.mu * heat.take(c.on.load(made))[: heat.free]
        return np.concatenate([leaving, c.packed(c.on.flow(charge), w)])


class Newton:
    """Newton's method for some equations. ``steps`` counts its steps; ``factors`` solve an earlier linearization."""

    def __init__(self, equations: Equations, factors: Solver) -> None:
        self.equations, self.factors, self.steps = equations, factors, 0

    def correct(
        self, point: Point, row: np.ndarray | None, tolerance: float, surely: bool = False
    ) -> tuple[Point, float]:
        """Newton's method from a point, on the plane through it that a ``row`` (unknowns,) defines, or at its mu.

        The second result is the relative size of the step that would be next, at most ``tolerance``. With ``surely``
        the first contraction must be below 1/4: by Kantorovich's theorem no other state is near.
        """
        before, contraction = np.inf, RESIDUAL
        for number in range(MOST_NEWTON):
            self.steps += 1
            change = self.solve(Linearization(self.equations, point), point.residual, row)
            size = self.equations.size(change, point)
            if number:
                contraction = size / max(before, 1e-300)
                if contraction > (0.25 if surely and number == 1 and size > tolerance else CONTRACTS):
                    # Rounding, or the bends of laws, cause further small steps: they count in the error.
                    if size <= max(10 * tolerance, 1e-7):
                        return point, size
                    break
            point = self.equations.at(point.x + change)
            if largest(point.rise) > 2 * HOTTEST:
                break
            before, left = size, contraction * size
            if left <= tolerance and (number or size <= tolerance):
                return point, left
        raise NotConvergedError("Newton's method does not converge")

    def quadrature_error(self, fold: Point, row: np.ndarray) -> float:
        """The relative error that quadratures of laws leave in the mu of a fold: the sum of its changes by finer ones
        on the plane of a ``row`` (`correct`). Raises BeyondLawError where the resistivity is not positive in one."""
        equations, off = self.equations, 0.0
        linearization = Linearization(equations, fold)
        for problems in refine_quadratures(equations.heat, equations.conductor):
            try:
                residual = Equations(*problems).at(fold.x).residual
            except VanishedError:
                raise BeyondLawError from None
            off += abs(float(self.solve(linearization, residual, row)[-1]))
        return off / max(fold.mu, 1e-300)

    def solve(self, linearization: Linearization, residual: np.ndarray, row: np.ndarray | None) -> np.ndarray:
        """(unknowns,): the change that removes residuals, and whose product with a ``row`` (unknowns,) is zero, by
        default its change of mu. Raises NotConvergedError where the linear system is not solved."""
        along = self.equations.along_mu if row is None else row
        change, count = self._by_gmres(linearization, residual, along)
        # Factors take about as long as 15 steps of GMRES.
        if self.equations.heat.terms and (change is None or count > 15):
            try:
                self.factors = linearization.tangent.solve_steady
            except NumericsError:
                raise NotConvergedError("the linearized problem is not positive definite") from None
            if change is None:
                change, _ = self._by_gmres(linearization, residual, along)
        if change is None:
            raise NotConvergedError("the linearized problem is singular, or close to it")
        if row is None:
            change[-1] = 0.0  # to the last digit, which GMRES does not give
        return change

    def _by_gmres(self, at: Linearization, residual: np.ndarray, row: np.ndarray) -> tuple[np.ndarray | None, int]:
        """The change, or None where GMRES does not converge, and its steps."""
        n, c, solve = self.equations.heat.free, self.equations.conductor, self.factors
        answer, first = solve(np.array([at.driven, residual[:n]]))
        along = row[-1] + float(row[:n] @ answer)
        if along == 0.0:
            return None, 0
        # In units of the answer: the largest rise, voltage and mu.
        units = [max(largest(answer), 1e-300), max(largest(at.point.potential), 1e-300), 1.0]
        scale = np.repeat(units, [n, len(row) - n - 1, 1])

        def preconditioned(v: np.ndarray, leaving: np.ndarray, to: float) -> np.ndarray:
            m = (to - float(row[:n] @ v)) / along
            return np.concatenate([v + m * answer, leaving[n:] if c is None else at.precondition(leaving[n:]), [m]])

        def product(x: np.ndarray) -> np.ndarray:
            leaving = at(x * scale)
            return preconditioned(solve(leaving[:n]), leaving, float(row @ (x * scale))) / scale

        try:
            change, count = solve_by_gmres(product, preconditioned(first, residual, 0.0) / scale, RESIDUAL)
        except NumericsError:
            return None, 0
        return change * scale, count


def largest(values: np.ndarray) -> float:
    """Return the largest absolute value; 0 of none."""
    return float(np.abs(values).max(initial=0.0))
