"""The coupled steady state of temperature and current, by Newton's method and continuation in the drive.

With u the rise and phi the potential at the whole drive, the discrete equations are

    A(u) = f + mu q(u, phi),    E(u) phi = 0,    q = int sigma(u) |grad phi|^2 v,

A being the heat flow by conduction and through faces, f the heat sources and E the conductor between its electrodes.
The drive is scaled by sqrt(mu), so that the Joule heat is scaled by mu. Without a current mu scales f and the given
temperatures instead, A(u) = mu f.

Newton's method (`fem3d.solution.newton`) starts at a given state of another space, or without drive and with mu = 1.
If its steps do not shrink fast, pseudo-arclength continuation along secants (Keller, 1977) follows the path of states
from mu = 0 on, past folds. The result is the first state on the path at mu = 1, or the state to which Newton's method
leads from a given state. If the path turns back before, no state exists beyond its largest mu, and the heating runs
away. A path may also end at a rise of `HOTTEST`, at a vanishing resistivity or without convergence. Near a pole, beyond
a fold, or with the resistivity used up by a voltage this is a runaway, too.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import LinearizedHeat, linearized, refine_quadratures
from fem3d.problems.paths import Label
from fem3d.solution.newton import (
    HOTTEST,
    RESIDUAL,
    CoarseMeshError,
    Equations,
    Linearization,
    Newton,
    NotConvergedError,
    Point,
    VanishedError,
    largest,
)
from scenes.errors import BeyondLawError, NumericsError, RunawayError

ON_PATH = 1e-5  # relative error of the states of a path, whose largest drive messages state in three digits
NEGLIGIBLE = 0.03  # of the accuracy: what another pattern of the current may change
TIGHT = 1e-2  # part of the accuracy that Newton's iteration may leave, and to which changes of states are solved


@dataclass(frozen=True, eq=False)
class SteadyState:
    """The converged state of one mesh.

    Attributes
    ----------
    heat, conductor : the problems; ``heat`` is linearized about the state where a law makes it nonlinear
    rise, source : (all dofs,), the rise (K), and the heat sources with the Joule heat (W) that cause it
    joule, currents : the Joule heat by the labels of rows (W); the currents into electrodes and probes (A)
    potential, density : (functions,) in V, and the current density (3, rows of the conductor, points) in A/m2
    unsettled : relative error of the iteration, and by layers of laws that lie between the points of quadratures
    """

    heat: HeatProblem
    conductor: Conductor | None
    rise: np.ndarray
    source: np.ndarray
    joule: dict[Label, float] = field(default_factory=dict)
    currents: dict[str, float] = field(default_factory=dict)
    potential: np.ndarray | None = None
    unsettled: float = 0.0
    density: np.ndarray = field(default_factory=lambda: np.zeros((3, 0, 0)))

    @property
    def power(self) -> float:
        """All Joule heat (W)."""
        return float(sum(self.joule.values()))

    @property
    def exact(self) -> HeatProblem:
        """The heat problem before its linearization."""
        return self.heat.exact if isinstance(self.heat, LinearizedHeat) else self.heat


def solve_steady(
    heat: HeatProblem,
    conductor: Conductor | None,
    drive: float,
    accuracy: float,
    start: np.ndarray | None = None,
    potential: np.ndarray | None = None,
) -> SteadyState:
    """Solve the coupled steady equations of heat and current on one mesh, as the docstring of this module describes.

    Parameters
    ----------
    heat, conductor : the heat equation, and the current equation on the same mesh; None for heat alone
    drive : voltage (V) or current (A) of the inputs, for `RunawayError.limit`; 0 for heat alone, for a fraction of it
    accuracy : relative accuracy of the rises. The iteration aims at a small part of it.
    start, potential : (all dofs,), rise (K), and (functions,), V, near the solution, as in another space

    Raises RunawayError if the path ends below the whole drive: its ``limit`` is the largest drive on the path. Raises
    BeyondLawError if a resistivity law reaches zero first, CoarseMeshError if layers of a law lie between the points of
    its quadrature, and other NumericsError if conditions vary in time or heat has no exit.
    """
    if heat.inputs.schedules:
        raise NumericsError("a scene whose conditions vary in time has no steady state")
    if not heat.domain.anchored:
        raise NumericsError("a part of the scene has no exit for heat: it has no steady state")
    tangent = heat if isinstance(heat, LinearizedHeat) else None
    newton = Newton(Equations(tangent.exact if tangent else heat, conductor), heat.solve_steady)
    point, unsettled = _search(newton, drive, TIGHT * accuracy, start, potential)
    off = newton.equations.layer_error(point) if newton.equations.nonlinear and tangent is None else 0.0
    if off > accuracy:
        raise CoarseMeshError("the mesh is too coarse for the laws of the temperature")
    return read_state(newton.equations, point, unsettled + off, tangent)


def _search(
    newton: Newton, drive: float, tolerance: float, start: np.ndarray | None = None, potential: np.ndarray | None = None
) -> tuple[Point, float]:
    """The state at the whole drive, and the relative size of the step that would be next."""
    equations, c = newton.equations, newton.equations.conductor
    if start is not None:
        with suppress(NotConvergedError):
            return newton.correct(equations.at_rise(start, 1.0, potential), None, tolerance)
    heat, rise = equations.heat, np.zeros(equations.heat.size)
    if equations.electric and (heat.loads[0].any() or heat.given[0].any()):
        rise = _search(Newton(Equations(heat, None), newton.factors), 0.0, tolerance)[0].rise
    try:
        zero = equations.at_rise(rise, 0.0)
    except VanishedError:
        raise BeyondLawError from None
    try:
        return newton.correct(equations.at(zero.x + equations.along_mu), None, tolerance, surely=True)
    except NotConvergedError as failure:
        if isinstance(failure, VanishedError) and c is not None and c.current_driven and not (c.warm > 0).any():
            # Nothing runs away here: a smaller resistance takes less heat.
            raise BeyondLawError from None
    return Continuation(newton, zero, drive).solve(tolerance)


def read_state(equations: Equations, point: Point, unsettled: float, tangent: LinearizedHeat | None) -> SteadyState:
    """The steady state of a point, with the problem linearized about it where a law makes it nonlinear."""
    heat, c, rise = equations.heat, equations.conductor, point.rise
    joule, currents, source = dict[Label, float](), dict[str, float](), heat.loads[0]
    potential, density = None, np.zeros((3, 0, 0))
    if c is not None:
        hot = c.solve(rise, c.voltages[0], point.potential)
        potential, density = hot.potential, hot.density
        # The heat at the rise that the source is of: so they balance.
        joule, currents = c.joule(density, rise), hot.currents
        source = source + c.joule_load(density, rise)
    problem: HeatProblem = heat
    if equations.nonlinear:
        near, rise = tangent or linearized(heat, c, rise, density), rise.copy()
        rise[: heat.free] += near.solve_steady((source - heat.outflow(rise))[: heat.free])
        problem = replace(near, about=heat.field(rise))
        problem.cache.update(solve_steady=near.solve_steady)
    else:
        rise = heat.refine_iteratively(rise, source)
    return SteadyState(problem, c, rise, source, joule, currents, potential, unsettled, density)


def solve_currents(heat: HeatProblem, conductor: Conductor | None) -> SteadyState:
    """Solve for the currents at the initial temperature alone; there are none where the voltages are equal."""
    no_rise = np.zeros(heat.size)
    if conductor is None:
        return SteadyState(heat, None, no_rise, heat.loads[0])
    cold = conductor.solve(no_rise, conductor.voltages[0])
    return SteadyState(
        heat, conductor, no_rise, heat.loads[0], conductor.joule(cold.density, no_rise), cold.currents, cold.potential,
        density=cold.density,
    )  # fmt: skip


class Continuation:
    """The states of a problem from mu = 0 on, by their arclength in the rise (its root mean square over the capacity,
    relative to the answer to the cold Joule heat) and in mu."""

    def __init__(self, newton: Newton, start: Point, drive: float) -> None:
        self._newton, self._start, self._drive, self._unit_of_drive = newton, start, abs(drive), ""
        self._equations = equations = newton.equations
        if equations.conductor is not None and equations.electric and drive:
            self._unit_of_drive = "A" if equations.conductor.current_driven else "V"
        self._hottest = f"{float(equations.heat.domain.scene.initial_temperature) + HOTTEST:,.0f} K"
        self._answer = newton.factors(Linearization(equations, start).driven)
        self._size = equations.heat.norm(self._answer) ** 2 or 1.0
        self._off = 0.0  # relative error of the largest mu by quadratures of laws
        self._jagged = False  # whether the path turned forward again below its largest mu

    def solve(self, tolerance: float) -> tuple[Point, float]:
        """The first state at the whole drive. Raises as `solve_steady` does."""
        newton, point, n = self._newton, self._start, self._equations.heat.free
        ahead = np.zeros(len(point.x))
        ahead[:n], ahead[-1] = self._answer, 1.0
        ahead = self._unit(ahead)
        # Half of the drive, or the drive of a tenth of the hottest rise by the cold answer.
        first = min(0.5 / ahead[-1], 0.1 * HOTTEST / max(largest(ahead[:n]), 1e-300))
        before, top, step, length = point, 0.0, first, 0.0
        # A path turns back and forth where the bends of a law pass through the cells of a coarse mesh.
        for _ in range(300):
            count = newton.steps
            try:
                new = self._on_plane(point.x + step * ahead, ahead)
                folds = new.mu < point.mu == top
                highest = self._highest(before, point, new) if folds else new
                off = newton.quadrature_error(highest, self._row(self._unit(new.x - before.x))) if folds else 0.0
                if point.mu < 1.0 <= highest.mu:
                    below = before if folds else point
                    share = (1.0 - below.mu) / (highest.mu - below.mu)
                    return newton.correct(self._equations.at(below.x + share * (highest.x - below.x)), None, tolerance)
            except NotConvergedError as failure:
                if self._equations.of_tangents is not self._equations.heat:
                    self._equations.of_tangents = self._equations.heat
                    continue
                step /= 2
                if step < 1e-6 * max(length, first):
                    raise self._end(top, point, isinstance(failure, VanishedError)) from None
                continue
            self._off = off if folds or highest.mu > top else self._off
            self._jagged |= before.mu > point.mu < new.mu < top
            if largest(new.rise) > HOTTEST:
                raise self._too_hot(top, point, new)
            top = max(top, highest.mu)
            if new.mu <= 0.0:
                raise self._runaway(top)
            length += step
            before, point, ahead = point, new, self._unit(new.x - point.x)
            step = 2 * step if newton.steps - count <= 3 else step
        self._jagged = True
        raise self._end(top, point, False)

    def _row(self, direction: np.ndarray) -> np.ndarray:
        """(unknowns,): the row whose product with a change is its length along a direction."""
        n, row = self._equations.heat.free, np.zeros(len(direction))
        row[:n], row[-1] = self._equations.heat.inner_mass @ direction[:n] / self._size, direction[-1]
        return row

    def _unit(self, direction: np.ndarray) -> np.ndarray:
        return direction / np.sqrt(self._row(direction) @ direction)

    def _on_plane(self, x: np.ndarray, direction: np.ndarray) -> Point:
        return self._newton.correct(self._equations.at(x), self._row(direction), ON_PATH)[0]

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

        with suppress(NotConvergedError):  # the highest one so far is close; mu is stationary at a fold
            minimize_scalar(missing, bounds=(0.0, places[-1]), method="bounded", options={"xatol": 1e-3 * places[-1]})
        return max(states, key=lambda each: each.mu)

    def _too_hot(self, top: float, point: Point, new: Point) -> RunawayError:
        """The error of a path that leads beyond the hottest state of interest, from a point to a new one."""
        from scipy.optimize import brentq

        direction, last = self._unit(new.x - point.x), new

        def beyond(place: float) -> float:
            nonlocal last
            last = self._on_plane(point.x + place * (new.x - point.x), direction)
            return float(np.log(largest(last.rise) / HOTTEST))

        with suppress(NotConvergedError, ValueError):  # the last one is close; of two states on a plane one may be cool
            brentq(beyond, 0.0, 1.0, xtol=1e-3)
        ratio = largest(last.rise) / max(largest(point.rise), 1e-300)
        # Without laws the hottest rise grows like mu: where it grows like mu squared or faster it runs away.
        if last.mu <= top or 2 * np.log(last.mu / max(point.mu, 1e-300)) < np.log(ratio):
            return self._runaway(max(last.mu, top))
        at = f"at {self._fraction(last.mu):.3g} times the drive of the scene the steady state reaches {self._hottest}"
        return self._error(last.mu, self._off, f"{at}, hotter than any solid: lower the drive")

    def _end(self, top: float, point: Point, vanished: bool) -> NumericsError:
        """The error of a path that does not go on."""
        c = self._equations.conductor
        # Where a resistivity that falls with the temperature is used up, the path ends without a fold.
        if vanished and c is not None and (c.current_driven or not (c.warm < 0).any()):
            return BeyondLawError()
        if vanished or (top > point.mu and not self._jagged):
            return self._runaway(top)
        # A finer mesh may show where a jagged path leads.
        off = math.inf if self._jagged else self._off
        beyond = f"no steady state is found beyond {self._fraction(top):.3g} times the drive of the scene"
        return self._error(top, off, f"{beyond}, which need not be a runaway")

    def _runaway(self, mu: float) -> RunawayError:
        """The error of a path that turns back at some mu."""
        limited, at, why = "part of what heats the scene", "", "the conductivity falls"
        if self._unit_of_drive:
            limited = "current" if self._unit_of_drive == "A" else "voltage"
            at, why = f"at {self._drive:g} {self._unit_of_drive} ", "the conductivity or the resistance changes"
        message = f"thermal runaway: {at}no steady state exists below {self._hottest}, because {why} as it heats"
        return self._error(mu, self._off, message, f"the largest {limited} with a steady state")

    def _fraction(self, mu: float) -> float:
        """The fraction of the drive."""
        return float(np.sqrt(max(mu, 0.0))) if self._equations.electric else mu

    def _error(self, mu: float, off: float, message: str, limited: str = "") -> RunawayError:
        """The error of a path that ends at some mu, with its relative error ``off``."""
        limit = self._fraction(mu) * (self._drive or 1.0)
        error = RunawayError(message, limit, limited, self._unit_of_drive, self._drive or 1.0)
        error.error = off * limit if limit else 0.0
        return error


class Tangent:
    """The linearized equations F'(x) at a steady state, with changes solved to a part of an ``accuracy``.

    With the equations F(x, s) = 0 of a scene and its neighbours and the state x at s = 0, the state at s is
    x - F'(x)^-1 (F(x, s) - F(x, 0)) to first order. A derivative costs a linear solve, and errors of the iteration that
    found x cancel in F(x, s) - F(x, 0).
    """

    def __init__(self, state: SteadyState, accuracy: float) -> None:
        # Each solution for the residual of the one before reduces it by the tolerance of GMRES.
        self._solutions = math.ceil(math.log(TIGHT * accuracy) / math.log(RESIDUAL))
        equations = Equations(state.exact, state.conductor)
        self._state, self._newton = state, Newton(equations, state.heat.solve_steady)
        equations.of_tangents, self._point = equations.heat, equations.at_rise(state.rise, 1.0)
        self._derivative = Linearization(equations, self._point)

    def state(self, heat: HeatProblem, conductor: Conductor | None) -> SteadyState:
        """Return the state of a scene beside, from its heat problem and its conductor on the same cells, moved."""
        equations, change = Equations(heat, conductor), np.zeros(len(self._point.x))
        residual = equations.at(self._point.x).residual - self._point.residual
        for _ in range(self._solutions if residual.any() else 0):
            change += self._newton.solve(self._derivative, residual - self._derivative(change), None)
        tangent = None
        if isinstance(known := self._state.heat, LinearizedHeat):
            tangent = LinearizedHeat.of(heat, known.about, known.stiffness, known.rest)
            tangent.cache.update(solve_steady=self._newton.factors)
        return read_state(equations, equations.at(self._point.x + change), 0.0, tangent)

    def by_finer_quadratures(self) -> list[SteadyState]:
        """Return the states by finer quadratures of the laws. Raises BeyondLawError where the resistivity is not
        positive in one."""
        try:
            return [self.state(*finer) for finer in refine_quadratures(self._state.exact, self._state.conductor)]
        except VanishedError:
            raise BeyondLawError from None
