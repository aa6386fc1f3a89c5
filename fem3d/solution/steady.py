"""The coupled steady state of temperature and current, by Newton's method with continuation in the drive.

With u the rise, phi the potential at the whole drive and mu the square of the fraction of the drive (for heat alone
the fraction), the discrete equations are

    A(u) = f + mu q(u, phi),    E(u) phi = 0,    q = int sigma(u) |grad phi|^2 v,

A being the heat flow by conduction and through faces, f the heat sources and E the conductor between its electrodes. A
Newton step solves the exact linearization by GMRES, preconditioned with the Cholesky factors of both diagonal blocks.
It starts at the answer to the cold Joule heat. Where its steps do not shrink fast, the path of states from mu = 0 is
followed by pseudo-arclength continuation (Keller, 1977), which passes folds: the state is the first one on the path at
mu = 1. Where the path ends before, the heating runs away, and the largest mu on it is the limit.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from fem3d.problems.assembly import at_films, linearized
from fem3d.problems.conductors import independent
from fem3d.problems.current import Conductor, Pattern, Potential
from fem3d.problems.heat import HeatProblem
from scenes.errors import BeyondLawError, ConvergenceError, NumericsError, RunawayError

CONVERGED = 1e-4  # of the accuracy: the relative size of the step that would be next
INNER = 1e-4  # relative residual of a linear system: a Newton step then leaves this much of the one before
TANGENT = 1e-7  # the same for the direction of a path, whose part in mu is small near a fold and a pole
MOST_INNER = 100  # steps of GMRES
MOST_NEWTON = 20  # steps at one point
# Contraction of Newton's steps that counts as convergence (Deuflhard, Newton Methods for Nonlinear Problems, 2004,
# section 2.1: 1/2), and with which no path is needed: by Kantorovich's theorem the state then is the only one near.
CONTRACTS, SURELY = 0.5, 0.25
ON_THE_WAY = 1e-4  # relative size of the last step to a state that only leads on to others
MOST_POINTS = 100  # of a path
MOST_BEYOND = 20  # of them beyond a fold, where steps that double lead from 1 K to 1e6 K
SHORTEST = 1e-6  # relative step along a path that ends it
FOLD = 1e-5  # relative error of the largest mu, of which messages state three digits
STEEP = 2.0  # power of mu with which the hottest rise grows from which on it runs away; without laws it is 1
HOTTEST = 1e5  # K, beyond any solid: no state that hot is looked for
MOST_FINER = 4  # times that the quadrature of laws is refined
QUADRATURE = 0.03  # of the accuracy: what a finer quadrature of laws may change
PATTERN = 5e-2  # of the accuracy: a change of the current's pattern that moves the rise less is left out
REFACTORED = 15  # steps of GMRES after which factors are made anew: they take about as long


@dataclass(frozen=True, eq=False)
class SteadyState:
    """The converged state of one mesh.

    ``rise`` (all nodes, K) and the ``source`` (all nodes, W) that it answers; ``joule`` (W) of each box and
    ``currents`` (A) of electrodes and probes; ``power`` (W); the ``potential`` (functions, V) and the current's
    ``density`` (A/m2). ``fields`` (free nodes, any number) and ``patterns`` are the temperature and current fields for
    a reduced problem, ``steps`` counts Newton's steps, ``unsettled`` is the relative error of iteration and
    quadrature. The ``heat`` problem is linearized about the state where a law makes it nonlinear.
    """

    heat: HeatProblem
    conductor: Conductor | None
    rise: np.ndarray
    source: np.ndarray
    joule: dict[str, float] = field(default_factory=dict)
    currents: dict[str, float] = field(default_factory=dict)
    power: float = 0.0
    potential: np.ndarray | None = None
    fields: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    patterns: list[Pattern] = field(default_factory=list)
    steps: int = 1
    unsettled: float = 0.0
    density: np.ndarray = field(default_factory=lambda: np.zeros((3, 0, 0)))

    @cached_property
    def hot_potential(self) -> np.ndarray:
        """The potential (V) at the converged rise."""
        c = self.conductor
        assert c is not None
        return c.solve(self.rise, c.voltages[0], self.potential).potential


def solve_steady(
    heat: HeatProblem,
    conductor: Conductor | None,
    drive: float,
    accuracy: float,
    start: np.ndarray | None = None,
    thermal: bool = True,
) -> SteadyState:
    """Solve the coupled steady equations of heat and current at constant inputs.

    Newton's method solves the equations in the docstring of this module, with continuation in the drive where needed.

    Parameters
    ----------
    heat : matrices and loads of the heat equation on one mesh, linear or with nonlinear laws. A problem linearized
        near the state keeps its linearization and its quadrature of laws.
    conductor : the current equation on the same mesh with its voltages, or None for heat alone
    drive : voltage (V) or current (A) that messages name as the drive; the inputs of the problem set the actual one
    accuracy : relative accuracy of the solution; iteration and quadrature leave a small part as error
    start : (all nodes,), rise (K) near the solution, such as the state of another mesh in the nodes of this one.
        Newton's method begins there; where it does not converge, the search begins anew without a start.
    thermal : whether to solve for temperatures; else only for the currents at the initial temperature

    Returns a `SteadyState`: ``rise`` (all nodes,) above the initial temperature (K), ``potential`` (functions,) (V),
    the Joule heat (W) and the currents (A).

    Raises RunawayError where no steady state exists with a rise below `HOTTEST` (1e5 K), BeyondLawError where the
    resistivity is not positive on the way (a finer mesh may help), and NumericsError where the scene has no steady
    state or the iteration does not converge.
    """
    if heat.inputs.schedules:
        raise NumericsError("a scene whose conditions vary in time has no steady state")
    if not thermal:
        assert conductor is not None
        return _currents_alone(heat, conductor)
    if not heat.anchored:
        raise NumericsError("a part of the scene has no exit for heat: it has no steady state")
    tangent = heat if heat.exact is not None else None
    heat = heat.exact or heat
    newton = Newton(heat, conductor, factors=tangent and tangent.solve_steady)
    point, left = newton.solve(drive, CONVERGED * accuracy, start)
    off = 0.0
    for _ in range(MOST_FINER if newton.nonlinear and tangent is None else 0):
        linearization = Linearization(newton, point)
        # Of kinks one difference may be small by chance.
        off = max(newton.by_quadrature(point, linearization, more) for more in (1, 2))
        if off <= QUADRATURE * accuracy:
            break
        finer = newton.finer(2)
        try:
            point, left = finer.correct(finer.at_rise(point.rise, 1.0), None, CONVERGED * accuracy)
        except NotConvergedError:
            break  # the coarser quadrature stands, with its error
        newton = finer
    if not newton.nonlinear:
        return _linear_state(newton, point, left, accuracy)
    return _nonlinear_state(newton, point, left + off, tangent)


class NotConvergedError(NumericsError):
    """Newton's method does not converge from where it started."""


@dataclass(frozen=True, eq=False)
class Point:
    """A state: ``rise`` (all nodes, K), ``potential`` (functions, V) at the whole drive, ``mu``; and derived
    values: the resistivity, its relative change per kelvin and the current density (rows, points), the heat that the
    whole drive makes (``driven``, all nodes, W), and the residuals of heat (free nodes, W) and of current (A)."""

    rise: np.ndarray
    potential: np.ndarray
    mu: float
    resistivity: np.ndarray
    density: np.ndarray
    driven: np.ndarray
    of_heat: np.ndarray
    of_current: np.ndarray


@dataclass(frozen=True, eq=False)
class Direction:
    """A change of a state: ``rise`` (free nodes), ``potential`` (unknowns of the conductor) and ``mu``."""

    rise: np.ndarray
    potential: np.ndarray
    mu: float

    def times(self, factor: float) -> Direction:
        """The same, some times as long."""
        return Direction(factor * self.rise, factor * self.potential, factor * self.mu)


@dataclass(frozen=True, eq=False)
class Row:
    """A linear function of the change of a state: ``rise`` (free nodes) and ``mu``."""

    rise: np.ndarray
    mu: float

    def __call__(self, change: Direction) -> float:
        return float(self.rise @ change.rise) + self.mu * change.mu


@dataclass(eq=False)
class Newton:
    """Newton's method for one problem. ``steps`` counts its steps; ``factors`` belong to the last linearization, and
    ``rough`` are the problem and its conductor by the quadrature of linearizations."""

    heat: HeatProblem
    conductor: Conductor | None
    steps: int = 0
    factors: Any = None
    rough: tuple[HeatProblem, Conductor | None] | None = None

    def __post_init__(self) -> None:
        heat, conductor = self.heat, self.conductor
        self.electric = conductor is not None and bool(conductor.voltages[0].any())
        self.unknowns = 0 if conductor is None else len(conductor.free) + len(conductor.terminals)
        # The drive does not scale the heat sources beside a current.
        self.still = heat.loads[0] if self.electric else np.zeros(heat.size)
        self.scaled = np.zeros(heat.size) if self.electric else heat.loads[0]
        self.factors = heat.solve_steady if self.factors is None else self.factors
        self.nonlinear = bool(heat.terms) or (conductor is not None and conductor.following is not None)
        self.vanished = False

    def given(self, mu: float) -> np.ndarray:
        """(fixed nodes,): the given rises."""
        return self.heat.given[0] * (1.0 if self.electric else mu)

    def at(self, rise: np.ndarray, potential: np.ndarray, mu: float) -> Point | None:
        """The point of a rise (free nodes) and a potential; None where there is none."""
        heat, c = self.heat, self.conductor
        rise = np.concatenate([rise[: heat.free], self.given(mu)])
        if not np.isfinite(rise).all() or not np.isfinite(mu):
            return None
        driven, nothing, of_current = self.scaled, np.empty(0), np.empty(0)
        resistivity = density = nothing
        if c is not None:
            resistivity = c.resistivity(rise)
            if not (resistivity > 0).all():
                self.vanished = True
                return None
            density = -c.on.gradient(potential) / resistivity
            driven = driven + heat.take(c.on.load(resistivity * (density**2).sum(axis=0)))
            of_current = c.unbalanced(potential, resistivity, c.voltages[0])
        of_heat = (self.still + mu * driven - heat.outflow(rise))[: heat.free]
        return Point(rise, potential, mu, resistivity, density, driven, of_heat, of_current)

    def at_rise(self, rise: np.ndarray, mu: float, near: np.ndarray | None = None) -> Point:
        """The point of a rise, with the potential there."""
        c = self.conductor
        potential = np.empty(0)
        if c is not None:
            whole = np.concatenate([rise[: self.heat.free], self.given(mu)])
            if not c.conducts(whole):
                raise BeyondLawError
            potential = c.solve(whole, c.voltages[0], near).potential
        point = self.at(rise, potential, mu)
        if point is None:
            raise NotConvergedError("no state is near what the iteration starts from")
        return point

    def moved(self, point: Point, by: Direction) -> Point | None:
        """The point at the end of a change."""
        potential = point.potential
        if self.conductor is not None:
            potential = potential + self.conductor.expanded(by.potential)
        return self.at(point.rise[: self.heat.free] + by.rise, potential, point.mu + by.mu)

    def solve(self, drive: float, enough: float, start: np.ndarray | None) -> tuple[Point, float]:
        """The state at the whole drive, and the relative size of the step that would be next."""
        if start is not None:
            try:
                return self.correct(self.at_rise(start, 1.0), None, enough)
            except (NotConvergedError, BeyondLawError):
                pass
        zero = self.unpowered(drive, enough)
        cold = self.at(zero.rise[: self.heat.free], zero.potential, 1.0)
        assert cold is not None
        try:
            return self.correct(cold, None, enough, mild=True)
        except NotConvergedError:
            c = self.conductor
            if self.vanished and c is not None and c.by_current and not (c.warm > 0).any():
                # Nothing runs away here: a smaller resistance takes less heat.
                raise BeyondLawError from None
        ahead = Linearization(self, zero).solve(None, Row(np.zeros(self.heat.free), 1.0), 1.0)
        return Path(self, zero, ahead, drive).solve(enough)

    def unpowered(self, drive: float, enough: float) -> Point:
        """The state without a current, or without anything that heats."""
        heat = self.heat
        if not self.electric:
            return self.at_rise(np.zeros(heat.size), 0.0)
        rise = heat.lifts[0]
        if heat.loads[0].any():
            rise = rise + heat.whole(heat.solve_steady(heat.loads[0][: heat.free]))
        if heat.terms and rise.any():
            rise = Newton(heat, None).solve(drive, enough, rise)[0].rise
        if self.conductor is not None and not self.conductor.conducts(rise):
            raise NumericsError("the resistivity is not positive at the given temperatures")
        return self.at_rise(rise, 0.0)

    def correct(self, point: Point, row: Row | None, enough: float, mild: bool = False) -> tuple[Point, float]:
        """Newton's method from a point, on the plane through it that a ``row`` defines, at its mu without one.

        The second result is the relative size of the step that would be next. With ``mild`` the contraction must be so
        strong that no other state is near.
        """
        fixed = row is None
        row = row or Row(np.zeros(self.heat.free), 1.0)
        linear = not self.nonlinear and not (self.conductor and self.conductor.warms)
        known, contraction = np.inf, 0.0 if linear else INNER
        for number in range(MOST_NEWTON):
            self.steps += 1
            change = Linearization(self, point).solve(point, row, 0.0)
            # To the last digit, which GMRES does not give.
            change = replace(change, mu=0.0) if fixed else change
            size = self.size(change, point)
            if number:
                contraction = size / max(known, 1e-300)
                if contraction > (SURELY if mild and number == 1 and size > enough else CONTRACTS):
                    # Rounding, or the bends of laws, cause further small steps: they count in the error.
                    if size <= max(10 * enough, 1e-7):
                        return point, size
                    break
            new = self.moved(point, change)
            if new is None or np.abs(new.rise).max(initial=0.0) > 2 * HOTTEST:
                break
            point, known, left = new, size, contraction * size
            if left <= enough and (number or linear or size <= enough):
                return point, left
        raise NotConvergedError("Newton's method does not converge")

    def size(self, change: Direction, point: Point) -> float:
        """The relative size of a change: of the largest rise, of the largest voltage, of mu."""
        rise = _largest(change.rise) / (max(_largest(point.rise), _largest(change.rise)) or 1.0)
        volts = _largest(change.potential) / (_largest(point.potential) or 1.0)
        return max(rise, volts, abs(change.mu) / max(point.mu, 1e-300) if change.mu else 0.0)

    def finer(self, points: int) -> Newton:
        """The same problem, by quadratures of its laws with so many more points along each axis."""
        terms = tuple(term.finer(points) for term in self.heat.terms)
        return replace(
            self, heat=replace(self.heat, terms=terms), conductor=self.conductor and self.conductor.finer(points),
            rough=self.rough or (self.heat, self.conductor),
        )  # fmt: skip

    def by_quadrature(self, point: Point, linearization: Linearization, points: int) -> float:
        """The relative change of a state that quadratures of its laws with so many more points make: of the rise and
        the potential, of the currents and of their heat."""
        finer = self.finer(points)
        other = finer.at(point.rise, point.potential, point.mu)
        if other is None:
            return np.inf
        off = self.size(linearization.solve(other, Row(np.zeros(self.heat.free), 1.0), 0.0), point)
        if self.conductor is None or finer.conductor is None:
            return off
        currents, others = self._currents(self.conductor, point), self._currents(finer.conductor, other)
        made, again = (float(self.heat.unit @ p.driven) for p in (point, other))
        return max(off, _largest(others - currents) / (_largest(currents) or 1.0), abs(again - made) / (made or 1.0))

    @staticmethod
    def _currents(conductor: Conductor, point: Point) -> np.ndarray:
        through = {name: conductor.through(name, point.potential, point.rise) for name in conductor.sections}
        reaction = -conductor.on.flow(point.density)
        return np.array(
            [*conductor.pattern(Potential(point.potential, point.density, reaction, through)).currents.values()]
        )


class Linearization:
    """The derivative of the equations at a point: v, w and m being the changes of u, phi and mu,

        A'(u) v + mu (rho'/rho) h v + 2 mu J . grad w - m q,    E(u) w + J (rho'/rho) v . grad,

    h = rho |J|^2 tested with functions, and the row of `Newton.correct`.
    """

    def __init__(self, newton: Newton, point: Point) -> None:
        self._newton, self._point = newton, point
        heat, c = newton.rough or (newton.heat, newton.conductor)
        self._conductor = c
        self._tangent = linearized(heat, None, point.rise, np.empty(0)) if heat.terms else heat
        self._rest = self._tangent.inner_rest if heat.terms else None
        if c is not None:
            self._resistivity, self._density = point.resistivity, point.density
            if newton.rough is not None:
                self._resistivity = c.resistivity(point.rise)
                self._density = -c.on.gradient(point.potential) / self._resistivity
            self._precondition = c.near(self._resistivity).precondition
            if c.warms:
                self._steep = np.broadcast_to(c.steepness(point.rise), c.on.weights.shape)
                self._heating = self._resistivity * (self._density**2).sum(axis=0)
        self._driven = point.driven[: heat.free]
        if heat.given[0].any() and not newton.electric:
            held = np.concatenate([np.zeros(heat.free), heat.given[0]])
            reached = self._tangent.stiffness @ held
            if self._tangent.rest is not None:
                reached = reached + self._tangent.rest(held)
            self._driven = self._driven - reached[: heat.free]

    def __call__(self, v: np.ndarray, w: np.ndarray, m: float) -> tuple[np.ndarray, np.ndarray]:
        """Its product with a direction: (free nodes,) and (unknowns of the conductor,)."""
        heat, c, mu = self._newton.heat, self._conductor, self._point.mu
        of_heat = self._tangent.inner_stiffness @ v - m * self._driven
        if self._rest is not None:
            of_heat = of_heat + self._rest(v)
        if c is None:
            return of_heat, w
        slope = c.on.gradient(c.expanded(w))
        made = -2 * (self._density * slope).sum(axis=0)
        charge = slope / self._resistivity
        if c.warms:
            warmed = self._steep * c.on.value(heat.field(heat.whole(v)))
            made = made - self._heating * warmed
            charge = charge + self._density * warmed
        of_heat = of_heat - mu * heat.take(c.on.load(made))[: heat.free]
        return of_heat, c.packed(c.on.flow(charge), w)

    def solve(self, residual: Point | None, row: Row, to: float) -> Direction:
        """Return the direction that removes the residuals of a point (zero without a point), and whose product with
        ``row`` is ``to``. Raises NotConvergedError where the linear system is not solved."""
        newton, own = self._newton, bool(self._newton.heat.terms)
        found, count = self._by_gmres(residual, row, to)
        if own and (found is None or count > REFACTORED):
            try:
                newton.factors = self._tangent.solve_steady
            except NumericsError:
                raise NotConvergedError("the linearized problem is not positive definite") from None
            if found is None:
                found, _ = self._by_gmres(residual, row, to)
        if found is None:
            raise NotConvergedError("the linearized problem is singular, or close to it")
        return found

    def _by_gmres(self, residual: Point | None, row: Row, to: float) -> tuple[Direction | None, int]:
        """The direction, and how many steps of GMRES it takes; None where they do not converge."""
        heat, c, solve = self._newton.heat, self._newton.conductor, self._newton.factors
        n, k = heat.free, self._newton.unknowns
        answer = solve(self._driven)
        along = row.mu + float(row.rise @ answer)
        if along == 0.0:
            return None, 0

        def preconditioned(r: np.ndarray, s: np.ndarray, to: float) -> np.ndarray:
            v = solve(r)
            m = (to - float(row.rise @ v)) / along
            return np.concatenate([v + m * answer, s if c is None else self._precondition(s), [m]])

        # In units of the answer: the largest rise, voltage and mu.
        units = [max(_largest(answer), 1e-300), max(_largest(self._point.potential), 1e-300), 1.0]
        scale, left = np.repeat(units, [n, k, 1]), [0.0]

        def product(x: np.ndarray) -> np.ndarray:
            x = x * scale
            of_heat, of_current = self(x[:n], x[n:-1], float(x[-1]))
            return preconditioned(of_heat, of_current, float(row.rise @ x[:n]) + row.mu * float(x[-1])) / scale

        def record(norm: float) -> None:
            left.append(norm)

        of_heat, of_current = (
            (np.zeros(n), np.zeros(k)) if residual is None else (residual.of_heat, residual.of_current)
        )
        right = preconditioned(of_heat, of_current, to) / scale
        x, _ = gmres(
            LinearOperator((len(scale), len(scale)), product, dtype=float), right, atol=0.0, maxiter=1,
            rtol=INNER if residual else TANGENT, restart=MOST_INNER, callback=record, callback_type="pr_norm",
        )  # fmt: skip
        count = len(left) - 1
        if left[-1] > INNER or not np.isfinite(x).all():
            return None, count
        x = x * scale
        return Direction(x[:n], x[n:-1], float(x[-1])), count


class Path:
    """The states of a problem from mu = 0 on, by their arclength in the rise (its root mean square over the capacity,
    relative to the answer to the cold Joule heat) and in mu."""

    def __init__(self, newton: Newton, start: Point, ahead: Direction, drive: float) -> None:
        self._newton, self._start, self._drive = newton, start, drive
        self._size = newton.heat.norm(ahead.rise) ** 2 or 1.0
        self._first = self._unit(ahead)

    def solve(self, enough: float) -> tuple[Point, float]:
        """The first state at the whole drive. Raises as `solve_steady` does."""
        newton = self._newton
        point, tangent = self._start, self._first
        # Half of the drive, or the drive of a tenth of the hottest rise by the cold answer.
        first = min(0.5 / tangent.mu, 0.1 * HOTTEST / max(_largest(tangent.rise), 1e-300))
        top, step, length, beyond = point, first, 0.0, 0
        newton.vanished = False
        for _ in range(MOST_POINTS):
            before = newton.steps
            new = self._ahead(point, tangent, step, ON_THE_WAY)
            if new is None:
                step /= 2
                beyond += top is not point
                if step < SHORTEST * max(length, first):
                    raise self._ended(top, point)
                continue
            hot = _largest(new.rise)
            if hot > 1.01 * HOTTEST:
                step *= (HOTTEST - _largest(point.rise)) / (hot - _largest(point.rise))
                continue
            try:
                following = self._tangent(new, tangent)
            except NotConvergedError:
                step /= 2
                continue
            highest = new
            if tangent.mu > 0 >= following.mu:
                highest = self._fold(point, tangent, step, new, following)
            if highest.mu > top.mu:
                top = highest
            if point.mu < 1.0 <= highest.mu:
                try:
                    return newton.correct(self._between(point, highest), None, enough)
                except NotConvergedError:
                    step /= 2
                    if step < SHORTEST * max(length, first):
                        raise
                    continue
            length += step
            beyond += top is not new
            # Without laws no path turns back.
            if beyond > (MOST_BEYOND if newton.nonlinear else 0):
                raise self._runaway(top)
            if hot > 0.99 * HOTTEST:
                raise self._hottest(top, new, following)
            quick, newton.vanished = newton.steps - before <= 3, False
            point, tangent, step = new, following, 2 * step if quick else step
        raise ConvergenceError(
            f"no steady state is found within {MOST_POINTS} points on the path of states: the last one is at "
            f"{self._drive_of(point):.4g} of the drive, {_largest(point.rise):.4g} K hot"
        )

    def _unit(self, direction: Direction) -> Direction:
        squared = self._newton.heat.norm(direction.rise) ** 2 / self._size + direction.mu**2
        return direction.times(1 / np.sqrt(squared))

    def _row(self, tangent: Direction) -> Row:
        return Row(self._newton.heat.inner_mass @ tangent.rise / self._size, tangent.mu)

    def _ahead(self, point: Point, tangent: Direction, step: float, enough: float) -> Point | None:
        """Return the state on the plane at the end of a step along the tangent; None where Newton's method fails."""
        guess = self._newton.moved(point, tangent.times(step))
        if guess is None:
            return None
        try:
            return self._newton.correct(guess, self._row(tangent), enough)[0]
        except NotConvergedError:
            return None

    def _tangent(self, point: Point, along: Direction) -> Direction:
        return self._unit(Linearization(self._newton, point).solve(None, self._row(along), 1.0))

    def _fold(self, point: Point, tangent: Direction, step: float, new: Point, after: Direction) -> Point:
        """The state of the largest mu between two points, by cubics through mu and its slope along the path."""
        from scipy.interpolate import CubicHermiteSpline

        row, best = self._row(tangent), new if new.mu > point.mu else point
        ends = [(0.0, point.mu, tangent.mu), (step, new.mu, after.mu / row(after))]
        for _ in range(MOST_NEWTON):
            cubic = CubicHermiteSpline(*zip(*ends, strict=True))
            at = float(cubic.derivative().roots(extrapolate=False)[0])
            between = self._ahead(point, tangent, at, FOLD)
            if between is None:
                break
            best = between if between.mu > best.mu else best
            if abs(between.mu - float(cubic(at))) <= FOLD * between.mu:
                break
            along = self._tangent(between, tangent)
            ends[int(along.mu <= 0)] = (at, between.mu, along.mu / row(along))
        return best

    def _between(self, point: Point, beyond: Point) -> Point:
        """The states of two points interpolated to the whole drive."""
        share = (1.0 - point.mu) / (beyond.mu - point.mu)
        n = self._newton.heat.free
        rise = point.rise + share * (beyond.rise - point.rise)
        potential = point.potential + share * (beyond.potential - point.potential)
        at = self._newton.at(rise[:n], potential, 1.0)
        if at is None:
            raise NotConvergedError("no state is between two points of the path")
        return at

    def _drive_of(self, point: Point) -> float:
        """The fraction of the drive that a point is at."""
        return float(np.sqrt(max(point.mu, 0.0))) if self._newton.electric else point.mu

    def _limit(self, top: Point) -> float:
        return self._drive_of(top) * (abs(self._drive) or 1.0)

    def _hottest(self, top: Point, point: Point, tangent: Direction) -> RunawayError:
        """Return the error of a path that leads beyond the hottest state of interest."""
        at = int(np.abs(point.rise[: self._newton.heat.free]).argmax())
        # The way to a pole of the rise, as one of order one: mu_end - mu = T dmu/dT.
        left = tangent.mu * point.rise[at] / tangent.rise[at]
        if top is not point or STEEP * left < point.mu:
            return self._runaway(replace(top, mu=top.mu + max(left, 0.0)) if top is point else top)
        return RunawayError(
            f"at {self._drive_of(point):.3g} times what drives the scene the steady state is at "
            f"{self._initial + HOTTEST:,.0f} K, hotter than any solid: no hotter one is looked for",
            self._limit(top),
        )

    def _ended(self, top: Point, point: Point) -> NumericsError:
        """The error of a path that does not go on."""
        newton = self._newton
        c = newton.conductor
        if newton.vanished and c is not None:
            # Where a resistivity that falls with the temperature is used up, the path ends without a fold.
            falling = (c.warm < 0).any() and not c.by_current
            return self._runaway(top) if falling else BeyondLawError()
        if top is not point and top.mu > point.mu:
            return self._runaway(top)
        return RunawayError(
            f"no steady state is found beyond {self._drive_of(top):.3g} times what drives the scene, which need not be "
            "a runaway", self._limit(top),
        )  # fmt: skip

    def _runaway(self, top: Point) -> RunawayError:
        c, drive = self._newton.conductor, abs(self._drive)
        limit = self._limit(top)
        where = f"no steady state exists below {self._initial + HOTTEST:,.0f} K"
        if c is None or not self._newton.electric or not drive:
            return RunawayError(
                f"thermal runaway: {where}, because the conductivity falls as it heats", limit,
                f"the largest part of what heats the scene that has one is {limit:.3g}",
            )  # fmt: skip
        what, unit = ("current", "A") if c.by_current else ("voltage", "V")
        if self._newton.nonlinear:
            why = "the conductivity falls or the resistance changes"
            largest = f"the largest {what} that has one is {limit:.4g} {unit}"
        else:
            where, why = "no steady state exists", f"the resistance {'rises' if c.by_current else 'falls'}"
            largest = f"the largest {what} with a steady state is {limit:.4g} {unit}"
        return RunawayError(f"thermal runaway: at {drive:g} {unit} {where}, because {why} as it heats", limit, largest)

    @property
    def _initial(self) -> float:
        return float(self._newton.heat.domain.scene.initial_temperature)


def _linear_state(newton: Newton, point: Point, unsettled: float, accuracy: float) -> SteadyState:
    """The steady state of a point where conduction is linear, with the fields and patterns for a reduced problem."""
    heat, c = newton.heat, newton.conductor
    if c is None:
        source = heat.loads[0]
        rise = heat.improve(point.rise, source)
        fields = (rise - heat.lifts[0])[: heat.free, None]
        return SteadyState(heat, None, rise, source, fields=fields, steps=newton.steps, unsettled=unsettled)
    hot = c.solve(point.rise, c.voltages[0], point.potential)
    source = heat.loads[0] + c.joule_load(hot.density, point.rise)
    rise, lift = heat.improve(point.rise, source), heat.lifts[0]
    cold = c.solve(lift, c.voltages[0]) if c.warms else hot
    first = heat.solve_steady((heat.loads[0] + c.joule_load(cold.density, lift))[: heat.free])
    change = _pattern_change(heat, c, cold, hot, rise)
    patterns = independent(c, [cold, hot]) if change >= PATTERN * accuracy else [c.pattern(cold)]
    joule = c.joule(hot.density, point.rise)
    return SteadyState(
        heat, c, rise, source, joule, c.pattern(hot).currents, float(sum(joule.values())), hot.potential,
        np.column_stack([first, (rise - lift)[: heat.free]]), patterns, newton.steps, unsettled, hot.density,
    )  # fmt: skip


def _nonlinear_state(newton: Newton, point: Point, unsettled: float, tangent: HeatProblem | None) -> SteadyState:
    """The steady state of a point where a law makes conduction nonlinear, with the problem linearized about it."""
    heat, c = newton.heat, newton.conductor
    potential = None if c is None else c.solve(point.rise, c.voltages[0], point.potential)
    density = np.zeros((3, 0, 0)) if potential is None else potential.density
    near, source = tangent or linearized(heat, c, point.rise, density), heat.loads[0]
    if c is not None:
        source = source + c.joule_load(density, point.rise)
    rise = point.rise.copy()
    rise[: heat.free] += near.solve_steady((source - heat.outflow(rise))[: heat.free])
    u = heat.field(rise)
    about = at_films(replace(near, about=u, exact=heat), u)
    about.kept.tell(solve_steady=near.solve_steady)
    # The linearized stiffness times the rise is not the outflow where a term is no conduction.
    source = source + about.stiffness @ rise - heat.outflow(rise)
    state = SteadyState(
        about, c, rise, source, fields=(rise - about.lifts[0])[: heat.free, None], steps=newton.steps,
        unsettled=unsettled,
    )  # fmt: skip
    if c is None or potential is None:
        return state
    # The heat at the rise that the source is of: so they balance.
    joule, pattern = c.joule(density, point.rise), c.pattern(potential)
    return replace(
        state, joule=joule, currents=pattern.currents, power=float(sum(joule.values())), potential=potential.potential,
        patterns=[pattern], density=density,
    )  # fmt: skip


def _pattern_change(heat: HeatProblem, c: Conductor, cold: Potential, hot: Potential, rise: np.ndarray) -> float:
    """By how much heating moves the current's pattern, in terms of the rise or of the current of an electrode."""
    whole, other = c.pattern(hot), c.pattern(cold)
    scale = c.product(cold.density, hot.density) / (c.product(cold.density, cold.density) or 1.0)
    moved = c.joule_load(hot.density, rise) - c.joule_load(scale * cold.density, rise)
    apart = heat.norm(heat.solve_steady(moved[: heat.free])) / (heat.norm(rise[: heat.free]) or 1.0)
    pairs = ((current, scale * other.currents[name]) for name, current in whole.currents.items())
    return max([apart, *(abs(a - b) / abs(a) for a, b in pairs if a)])


def _currents_alone(heat: HeatProblem, conductor: Conductor) -> SteadyState:
    """The currents at the initial temperature."""
    still = np.zeros(heat.size)
    cold = conductor.solve(still, conductor.voltages[0])
    pattern, power = conductor.pattern(cold), float(cold.potential @ cold.reaction)
    return SteadyState(
        heat, conductor, still, heat.loads[0], conductor.joule(cold.density, still), pattern.currents, power,
        cold.potential, np.empty((heat.free, 0)), [pattern], density=cold.density,
    )  # fmt: skip


def _largest(values: np.ndarray) -> float:
    return float(np.abs(values).max(initial=0.0))
