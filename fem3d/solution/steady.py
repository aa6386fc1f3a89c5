"""The coupled steady state of temperature and current, by Newton's method and continuation in the drive.

With u the rise and phi the potential at the whole drive, the discrete equations are

    A(u) = f + mu q(u, phi),    E(u) phi = 0,    q = int sigma(u) |grad phi|^2 v,

A being the heat flow by conduction and through faces, f the heat sources and E the conductor between its electrodes.
The drive is scaled by sqrt(mu), so that the Joule heat is scaled by mu. Without a current mu scales f and the given
temperatures instead, A(u) = mu f.

The unknowns are one vector x: the rises at the free nodes, the unknown potentials, and mu. A Newton step solves the
exact linearization by GMRES, preconditioned with Cholesky factors of approximations of both diagonal blocks. It starts
at a state of another mesh, or at the state without drive with mu = 1. Where its steps do not shrink fast, the path of
states from mu = 0 is followed by pseudo-arclength continuation along secants (Keller, 1977), which passes folds: the
state is the first one on the path at mu = 1, or the one to which Newton's method leads from a state of another mesh.
Where the path turns back before, it has no state beyond the largest mu on it, and the heating counts as run away. It
may also end at `HOTTEST`, at a vanishing resistivity or without convergence; the error says so.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from fem3d.problems.assembly import at_films, linearized, refine_quadratures
from fem3d.problems.current import Conductor, Potential
from fem3d.problems.following import MOST_GMRES, solve_by_gmres
from fem3d.problems.heat import HeatProblem
from scenes.errors import BeyondLawError, ConvergenceError, NumericsError, RunawayError

# Relative residual of a linear system, and part of the accuracy that Newton's iteration may leave: so a step leaves no
# more of the one before than the last step may leave of the accuracy.
INNER = 1e-4
REFACTORED = 15  # steps of GMRES after which factors are made anew: they take about as long
MOST_NEWTON = 20  # steps at one point
# Contraction of Newton's steps that counts as convergence (Deuflhard, Newton Methods for Nonlinear Problems, 2004,
# section 2.1: 1/2), and with which no path is needed: by Kantorovich's theorem the state then is the only one near.
CONTRACTS, SURELY = 0.5, 0.25
MOST_POINTS = 100  # of a path
MOST_BEYOND = 20  # of them beyond a fold, where steps that double lead from 1 K to 1e6 K
ON_PATH = 1e-5  # relative error of the states of a path, whose largest drive messages state in three digits
SHORTEST = 1e-6  # relative step along a path that ends it
FOLD = 1e-3  # relative error of the place of a fold, where mu is stationary
STEEP = 2.0  # power of mu with which the hottest rise grows from which on it runs away; without laws it is 1
HOTTEST = 1e5  # K, beyond any solid: paths end at a rise so large; Newton's method alone goes to twice that
MOST_FINER = 4  # times that the quadrature of laws is refined
# Points along each axis that finer quadratures of laws have beyond the one in use. The error that a kink leaves jumps
# from rule to rule. It exceeds the sum of three differences for 1 of 500 random pairs of kinks, the larger of two
# differences for 24.
FURTHER = (1, 2, 3)
NEGLIGIBLE = 0.03  # of the accuracy: what a finer quadrature of laws, or another pattern of the current, may change


Solver = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class SteadyState:
    """The converged state of one mesh.

    ``rise`` (all nodes, K) and the ``source`` (all nodes, W) that it answers; ``joule`` (W) of each box and
    ``currents`` (A) of electrodes and probes; ``power`` (W); the ``potential`` (functions, V) and the current's
    ``density`` (A/m2). ``steps`` counts Newton's steps, ``unsettled`` is the relative error of iteration and
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
    steps: int = 1
    unsettled: float = 0.0
    density: np.ndarray = field(default_factory=lambda: np.zeros((3, 0, 0)))


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
    drive : voltage (V) or current (A) of the whole drive, in messages and in `RunawayError.limit`; the inputs of the
        problem set the actual one
    accuracy : relative accuracy of the rises. Iteration and quadrature aim at a small part of it;
        `SteadyState.unsettled` is the relative error that they leave.
    start : (all nodes,), rise (K) near the solution, such as the state of another mesh in the nodes of this one.
        Newton's method begins there; where it does not converge, the search begins anew without a start.
    thermal : whether to solve for temperatures; else only for the currents at the initial temperature

    Returns a `SteadyState`: ``rise`` (all nodes,) above the initial temperature (K), ``potential`` (functions,) (V),
    the Joule heat (W) and the currents (A).

    Raises RunawayError where the path of states ends below the whole drive: it turns back, leads to an infinite rise,
    or a voltage uses up a falling resistivity (a runaway, whose limit `RunawayError.largest` states); or it passes
    `HOTTEST` (1e5 K) otherwise, or does not go on (perhaps no runaway: `largest` is empty). Raises BeyondLawError where
    the resistivity reaches zero on the path of a given current, or of a voltage whose resistivity does not fall with
    the temperature, or where a finer quadrature meets a resistivity that is not positive. Raises NumericsError where
    conditions vary in time, heat has no exit, the resistivity is not positive without a drive, or the iteration does
    not converge.
    """
    if heat.inputs.schedules:
        raise NumericsError("a scene whose conditions vary in time has no steady state")
    if not thermal:
        assert conductor is not None
        return _currents_alone(heat, conductor)
    if not heat.anchored:
        raise NumericsError("a part of the scene has no exit for heat: it has no steady state")
    tangent = heat if heat.exact is not None else None
    newton = Newton(heat.exact or heat, conductor, (tangent or heat).solve_steady)
    point, unsettled = newton.solve(drive, INNER * accuracy, start)
    off = 0.0
    for _ in range(MOST_FINER if newton.nonlinear and tangent is None else 0):
        off = newton.by_quadrature(point)
        if off <= NEGLIGIBLE * accuracy:
            break
        finer = newton.finer(2)
        try:
            point, unsettled = finer.correct(finer.at(point.x), None, INNER * accuracy)
        except NotConvergedError:
            break  # the coarser quadrature stands, with its error
        newton = finer
    return read_state(newton, point, unsettled + off, tangent)


class NotConvergedError(NumericsError):
    """Newton's method does not converge from where it started."""


class VanishedError(NotConvergedError):
    """The resistivity is not positive everywhere."""


@dataclass(frozen=True, eq=False)
class Point:
    """A state ``x`` with derived values: ``rise`` (all nodes, K), ``potential`` (functions, V), the ``resistivity`` and
    the current ``density`` (rows, points), the heat ``driven`` by the whole drive (all nodes, W), and the ``residual``
    of heat (W) and current (A) at their unknowns."""

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


class Newton:
    """Newton's method for one problem. ``steps`` counts its steps; ``factors`` solve an earlier linearization."""

    def __init__(self, heat: HeatProblem, conductor: Conductor | None, factors: Solver) -> None:
        self.heat, self.conductor, self.factors, self.steps = heat, conductor, factors, 0
        self.nonlinear = bool(heat.terms) or (conductor is not None and conductor.following is not None)
        self.electric = conductor is not None and bool(conductor.voltages[0].any())
        # The drive does not scale the heat sources beside a current.
        self._still: np.ndarray = heat.loads[0] * self.electric
        self._scaled: np.ndarray = heat.loads[0] * (not self.electric)
        potentials = 0 if conductor is None else len(conductor.free) + len(conductor.terminals)
        self.along_mu = np.append(np.zeros(heat.free + potentials), 1.0)

    def at(self, x: np.ndarray) -> Point:
        """The point at unknowns. Raises NotConvergedError where there is none."""
        heat, c, n = self.heat, self.conductor, self.heat.free
        if not np.isfinite(x).all():
            raise NotConvergedError("Newton's method diverges")
        rise = np.concatenate([x[:n], heat.given[0] * (1.0 if self.electric else x[-1])])
        driven, lacking, potential = self._scaled, np.empty(0), np.empty(0)
        resistivity = density = np.empty(0)
        if c is not None:
            resistivity = c.resistivity(rise)
            if not (resistivity > 0).all():
                raise VanishedError("the resistivity vanishes on the way to the steady state")
            potential = c.given(c.voltages[0]) + c.expanded(x[n:-1])
            density = -c.on.gradient(potential) / resistivity
            driven = driven + heat.take(c.on.load(resistivity * (density**2).sum(axis=0)))
            lacking = c.unbalanced(potential, resistivity, c.voltages[0])
        heating = (self._still + x[-1] * driven - heat.outflow(rise))[:n]
        return Point(x, rise, potential, resistivity, density, driven, np.concatenate([heating, lacking]))

    def at_rise(self, rise: np.ndarray, mu: float) -> Point:
        """The point of a rise (all nodes,), with the potential there."""
        c, potentials = self.conductor, np.empty(0)
        if c is not None:
            if not c.conducts(rise):
                raise VanishedError("the resistivity is not positive at the given temperatures")
            potentials = c.unknowns(c.solve(rise, c.voltages[0]).potential)
        return self.at(np.concatenate([rise[: self.heat.free], potentials, [mu]]))

    def solve(self, drive: float, enough: float, start: np.ndarray | None = None) -> tuple[Point, float]:
        """The state at the whole drive, and the relative size of the step that would be next."""
        if start is not None:
            try:
                return self.correct(self.at_rise(start, 1.0), None, enough)
            except NotConvergedError:
                pass
        heat, rise = self.heat, np.zeros(self.heat.size)
        if self.electric and (heat.loads[0].any() or heat.given[0].any()):
            rise = Newton(heat, None, self.factors).solve(drive, enough)[0].rise
        zero = self.at_rise(rise, 0.0)
        try:
            return self.correct(self.at(zero.x + self.along_mu), None, enough, surely=True)
        except NotConvergedError as failure:
            c = self.conductor
            if isinstance(failure, VanishedError) and c is not None and c.by_current and not (c.warm > 0).any():
                # Nothing runs away here: a smaller resistance takes less heat.
                raise BeyondLawError from None
        return Path(self, zero, drive).solve(enough)

    def correct(self, point: Point, row: np.ndarray | None, enough: float, surely: bool = False) -> tuple[Point, float]:
        """Newton's method from a point, on the plane through it that a ``row`` (unknowns,) defines, or at its mu.

        The second result is the relative size of the step that would be next. With ``surely`` the contraction must be
        so strong that no other state is near.
        """
        before, contraction = np.inf, INNER
        for number in range(MOST_NEWTON):
            self.steps += 1
            change = Linearization(self, point).solve(point.residual, self.along_mu if row is None else row)
            if row is None:
                change[-1] = 0.0  # to the last digit, which GMRES does not give
            size = self.size(change, point)
            if number:
                contraction = size / max(before, 1e-300)
                if contraction > (SURELY if surely and number == 1 and size > enough else CONTRACTS):
                    # Rounding, or the bends of laws, cause further small steps: they count in the error.
                    if size <= max(10 * enough, 1e-7):
                        return point, size
                    break
            point = self.at(point.x + change)
            if _largest(point.rise) > 2 * HOTTEST:
                break
            before, left = size, contraction * size
            if left <= enough and (number or size <= enough):
                return point, left
        raise NotConvergedError("Newton's method does not converge")

    def size(self, change: np.ndarray, point: Point) -> float:
        """The relative size of a change: of the largest rise, of the largest voltage, of mu."""
        n = self.heat.free
        rise = _largest(change[:n]) / (max(_largest(point.rise), _largest(change[:n])) or 1.0)
        volts = _largest(change[n:-1]) / (_largest(point.potential) or 1.0)
        return max(rise, volts, abs(float(change[-1])) / max(point.mu, 1e-300))

    def finer(self, points: int) -> Newton:
        """The same problem, by quadratures of its laws with so many more points along each axis."""
        finer = Newton(*refine_quadratures(self.heat, self.conductor, points), self.factors)
        finer.steps = self.steps
        return finer

    def by_quadrature(self, point: Point) -> float:
        """The relative error that quadratures of laws leave in a state: the sum of its changes by finer ones, of the
        rise and the potential, of the currents and of their heat."""
        linearization, off = Linearization(self, point), 0.0
        for finer in map(self.finer, FURTHER):
            try:
                other = finer.at(point.x)
            except VanishedError:
                raise BeyondLawError from None
            changes = [self.size(linearization.solve(other.residual, self.along_mu), point)]
            if self.conductor is not None and finer.conductor is not None:
                currents, others = _currents(self.conductor, point), _currents(finer.conductor, other)
                made, again = (float(self.heat.unit @ p.driven) for p in (point, other))
                changes += [
                    _largest(others - currents) / (_largest(currents) or 1.0),
                    abs(again - made) / (made or 1.0),
                ]
            off += max(changes)
        return off


class Linearization:
    """The derivative of the equations at a point: v, w and m being the changes of u, phi and mu,

        A'(u) v + mu (rho'/rho) h v + 2 mu J . grad w - m q,    E(u) w + J (rho'/rho) v . grad,

    h = rho |J|^2 tested with functions. ``driven`` (free nodes,) is q less what given temperatures add.
    """

    def __init__(self, newton: Newton, point: Point) -> None:
        self._newton, self._point = newton, point
        heat, c = newton.heat, newton.conductor
        self._tangent = linearized(heat, None, point.rise, np.empty(0)) if heat.terms else heat
        self._held = heat.given[0] * (not newton.electric)
        if c is not None:
            self._precondition = c.near(point.resistivity).precondition
        if c is not None and c.warms:
            self._steep = np.broadcast_to(c.steepness(point.rise), c.on.weights.shape)
            self._heating = point.resistivity * (point.density**2).sum(axis=0)
        self.driven = -self(newton.along_mu)[: heat.free]

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Its product with a change (unknowns,): the changes of heat (W) and current (A) that leave."""
        heat, c, point = self._newton.heat, self._newton.conductor, self._point
        v, w = x[: heat.free], x[heat.free : -1]
        whole = np.concatenate([v, x[-1] * self._held])
        leaving = self._tangent.stiffness @ whole - x[-1] * point.driven
        if self._tangent.rest is not None:
            leaving = leaving + self._tangent.rest(whole)
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

    def solve(self, residual: np.ndarray, row: np.ndarray) -> np.ndarray:
        """(unknowns,): the change that removes residuals, and whose product with ``row`` (unknowns,) is zero. Raises
        NotConvergedError where the linear system is not solved."""
        newton = self._newton
        change, count = self._by_gmres(residual, row)
        if newton.heat.terms and (change is None or count > REFACTORED):
            try:
                newton.factors = self._tangent.solve_steady
            except NumericsError:
                raise NotConvergedError("the linearized problem is not positive definite") from None
            if change is None:
                change, _ = self._by_gmres(residual, row)
        if change is None:
            raise NotConvergedError("the linearized problem is singular, or close to it")
        return change

    def _by_gmres(self, residual: np.ndarray, row: np.ndarray) -> tuple[np.ndarray | None, int]:
        """The change, or None where GMRES does not converge, and its steps."""
        n, c, solve = self._newton.heat.free, self._newton.conductor, self._newton.factors
        answer = solve(self.driven)
        along = row[-1] + float(row[:n] @ answer)
        if along == 0.0:
            return None, 0
        # In units of the answer: the largest rise, voltage and mu.
        units = [max(_largest(answer), 1e-300), max(_largest(self._point.potential), 1e-300), 1.0]
        scale = np.repeat(units, [n, len(row) - n - 1, 1])

        def preconditioned(leaving: np.ndarray, to: float) -> np.ndarray:
            v = solve(leaving[:n])
            m = (to - float(row[:n] @ v)) / along
            return np.concatenate([v + m * answer, leaving[n:] if c is None else self._precondition(leaving[n:]), [m]])

        def product(x: np.ndarray) -> np.ndarray:
            return preconditioned(self(x * scale), float(row @ (x * scale))) / scale

        change, count = solve_by_gmres(product, preconditioned(residual, 0.0) / scale, INNER, MOST_GMRES)
        return None if change is None else change * scale, count


class Path:
    """The states of a problem from mu = 0 on, by their arclength in the rise (its root mean square over the capacity,
    relative to the answer to the cold Joule heat) and in mu."""

    def __init__(self, newton: Newton, start: Point, drive: float) -> None:
        self._newton, self._start, self._drive = newton, start, drive
        self._answer = newton.factors(Linearization(newton, start).driven)
        self._size = newton.heat.norm(self._answer) ** 2 or 1.0

    def solve(self, enough: float) -> tuple[Point, float]:
        """The first state at the whole drive. Raises as `solve_steady` does."""
        newton, point, n = self._newton, self._start, self._newton.heat.free
        ahead = np.zeros(len(point.x))
        ahead[:n], ahead[-1] = self._answer, 1.0
        ahead = self._unit(ahead)
        # Half of the drive, or the drive of a tenth of the hottest rise by the cold answer.
        first = min(0.5 / ahead[-1], 0.1 * HOTTEST / max(_largest(ahead[:n]), 1e-300))
        before, top, step, length, beyond = point, 0.0, first, 0.0, 0
        for _ in range(MOST_POINTS):
            count = newton.steps
            try:
                new = self._on_plane(point.x + step * ahead, ahead)
                folds = new.mu < point.mu == top
                highest = self._highest(before, point, new) if folds else new
                if point.mu < 1.0 <= highest.mu:
                    below = before if folds else point
                    share = (1.0 - below.mu) / (highest.mu - below.mu)
                    return newton.correct(newton.at(below.x + share * (highest.x - below.x)), None, enough)
            except NotConvergedError as failure:
                step /= 2
                beyond += top > point.mu
                if step < SHORTEST * max(length, first):
                    raise self._ended(top, point, isinstance(failure, VanishedError)) from None
                continue
            if _largest(new.rise) > HOTTEST:
                raise self._hottest(top, point, new)
            top = max(top, highest.mu)
            length += step
            beyond += top > new.mu
            # Without laws no path turns back.
            if beyond > (MOST_BEYOND if newton.nonlinear else 0):
                raise self._runaway(top)
            before, point, ahead = point, new, self._unit(new.x - point.x)
            step = 2 * step if newton.steps - count <= 3 else step
        raise ConvergenceError(
            f"no steady state is found within {MOST_POINTS} points on the path of states: the last one is at "
            f"{self._fraction(point.mu):.4g} of the drive, {_largest(point.rise):.4g} K hot"
        )

    def _row(self, direction: np.ndarray) -> np.ndarray:
        """(unknowns,): the row whose product with a change is its length along a direction."""
        n, row = self._newton.heat.free, np.zeros(len(direction))
        row[:n], row[-1] = self._newton.heat.inner_mass @ direction[:n] / self._size, direction[-1]
        return row

    def _unit(self, direction: np.ndarray) -> np.ndarray:
        return direction / np.sqrt(self._row(direction) @ direction)

    def _on_plane(self, x: np.ndarray, direction: np.ndarray) -> Point:
        return self._newton.correct(self._newton.at(x), self._row(direction), ON_PATH)[0]

    def _highest(self, before: Point, point: Point, new: Point) -> Point:
        """The state of the largest mu between two points about a third, or about the first of two: a fold."""
        from scipy.interpolate import BarycentricInterpolator
        from scipy.optimize import minimize_scalar

        direction = self._unit(new.x - before.x)
        states = [before, new] if before is point else [before, point, new]
        places = [float(self._row(direction) @ (each.x - before.x)) for each in states]
        guess = BarycentricInterpolator(places, [each.x for each in states])

        def missing(place: float) -> float:
            states.append(self._on_plane(guess(place), direction))
            return -states[-1].mu

        with suppress(NotConvergedError):  # the highest one so far is close
            minimize_scalar(missing, bounds=(0.0, places[-1]), method="bounded", options={"xatol": FOLD * places[-1]})
        return max(states, key=lambda each: each.mu)

    def _fraction(self, mu: float) -> float:
        """The fraction of the drive."""
        return float(np.sqrt(max(mu, 0.0))) if self._newton.electric else mu

    def _hottest(self, top: float, point: Point, new: Point) -> RunawayError:
        """The error of a path that leads beyond the hottest state of interest, from a point to a new one."""
        at = int(np.abs(new.rise[: self._newton.heat.free]).argmax())
        hot, hotter = max(abs(point.rise[at]), 1e-300), abs(new.rise[at])
        power = np.log(new.mu / max(point.mu, 1e-300)) / np.log(hotter / hot) if new.mu > top else 0.0
        if power * STEEP < 1:
            # The way to a pole of the rise, as one of order one: mu_end - mu is in proportion to 1 / T.
            return self._runaway(max(new.mu + (new.mu - point.mu) * hot / (hotter - hot), top))
        fraction = self._fraction(point.mu * (HOTTEST / hot) ** power)
        return RunawayError(
            f"at {fraction:.3g} times what drives the scene the steady state is at {self._initial + HOTTEST:,.0f} K, "
            "hotter than any solid: no hotter one is looked for", fraction * (abs(self._drive) or 1.0),
        )  # fmt: skip

    def _ended(self, top: float, point: Point, vanished: bool) -> NumericsError:
        """The error of a path that does not go on."""
        c, fraction = self._newton.conductor, self._fraction(top)
        if vanished and c is not None:
            # Where a resistivity that falls with the temperature is used up, the path ends without a fold.
            falling = (c.warm < 0).any() and not c.by_current
            return self._runaway(top) if falling else BeyondLawError()
        if top > point.mu:
            return self._runaway(top)
        return RunawayError(
            f"no steady state is found beyond {fraction:.3g} times what drives the scene, which need not be a runaway",
            fraction * (abs(self._drive) or 1.0),
        )

    def _runaway(self, mu: float) -> RunawayError:
        """The error of a path that goes no further than some mu."""
        c, drive = self._newton.conductor, abs(self._drive)
        limit = self._fraction(mu) * (drive or 1.0)
        where = f"no steady state exists below {self._initial + HOTTEST:,.0f} K"
        if c is None or not self._newton.electric or not drive:
            return RunawayError(
                f"thermal runaway: {where}, because the conductivity falls as it heats", limit,
                "the largest part of what heats the scene that has one",
            )  # fmt: skip
        what, unit = ("current", "A") if c.by_current else ("voltage", "V")
        if self._newton.nonlinear:
            why = "the conductivity falls or the resistance changes"
            named = f"the largest {what} that has one"
        else:
            where, why = "no steady state exists", f"the resistance {'rises' if c.by_current else 'falls'}"
            named = f"the largest {what} with a steady state"
        message = f"thermal runaway: at {drive:g} {unit} {where}, because {why} as it heats"
        return RunawayError(message, limit, named, unit)

    @property
    def _initial(self) -> float:
        return float(self._newton.heat.domain.scene.initial_temperature)


def _currents(conductor: Conductor, point: Point) -> np.ndarray:
    through = {name: conductor.through(name, point.potential, point.rise) for name in conductor.sections}
    potential = Potential(point.potential, point.density, -conductor.on.flow(point.density), through)
    return np.array([*conductor.pattern(potential).currents.values()])


def read_state(newton: Newton, point: Point, unsettled: float, tangent: HeatProblem | None) -> SteadyState:
    """The steady state of a point, with the problem linearized about it where a law makes it nonlinear."""
    heat, c, rise, source = newton.heat, newton.conductor, point.rise, newton.heat.loads[0]
    joule, currents, potential, density = dict[str, float](), dict[str, float](), None, np.zeros((3, 0, 0))
    if c is not None:
        hot = c.solve(rise, c.voltages[0], point.potential)
        potential, density = hot.potential, hot.density
        # The heat at the rise that the source is of: so they balance.
        joule, currents = c.joule(density, rise), c.pattern(hot).currents
        source = source + c.joule_load(density, rise)
    if newton.nonlinear:
        near, rise = tangent or linearized(heat, c, rise, density), rise.copy()
        rise[: heat.free] += near.solve_steady((source - heat.outflow(rise))[: heat.free])
        u = heat.field(rise)
        problem = at_films(replace(near, about=u, exact=heat), u)
        problem.kept.tell(solve_steady=near.solve_steady)
        # The linearized stiffness times the rise is not the outflow where a term is no conduction.
        source = source + problem.stiffness @ rise - heat.outflow(rise)
    else:
        problem, rise = heat, heat.improve(rise, source)
    return SteadyState(
        problem, c, rise, source, joule, currents, float(sum(joule.values())), potential, newton.steps, unsettled,
        density,
    )  # fmt: skip


def _currents_alone(heat: HeatProblem, conductor: Conductor) -> SteadyState:
    """The currents at the initial temperature."""
    still = np.zeros(heat.size)
    cold = conductor.solve(still, conductor.voltages[0])
    return SteadyState(
        heat, conductor, still, heat.loads[0], conductor.joule(cold.density, still), conductor.pattern(cold).currents,
        float(cold.potential @ cold.reaction), cold.potential, density=cold.density,
    )  # fmt: skip


def _largest(values: np.ndarray) -> float:
    return float(np.abs(values).max(initial=0.0))
