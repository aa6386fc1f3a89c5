"""The coupled steady state where a term makes the heat problem nonlinear: Newton's method, along a rising drive.

The residual is exact but for its quadrature: outflow(u) - source(u), the Joule heat being that of the current that is
solved for at u. Its tangent (`fem3d.problems.linearized`) treats the current's pattern as given, which costs steps and
no accuracy. Where a step fails, the drive is raised in smaller steps from a state that is known; where these end
nowhere, no steady state exists beyond: the heating runs away, as a conductivity falls or a resistance changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from fem3d.problems.current import Conductor, Potential
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import at_films, linearized
from fem3d.solution.steady import SteadyState
from scenes import physics
from scenes.errors import NumericsError, RunawayError

MOST_STEPS = 30  # of Newton's method at one drive
# So many steps shrink to half at least: those from far above to a face that radiates shrink to (3/4)^5.
STALLED = 5
# SLOW, SECANTS, AROUND, ROUGH, NEXT_TO, WORSE and OFF decide how many steps it takes, not which state it ends at, and
# BETTER how good quadratures are where a mesh is refined: found on the sink from 1 to 12 V and on 21 random scenes with
# laws; what other values take is in `validate stress`: "constants".
ENDS = 1e-4  # of the accuracy: what the next step would be, relatively, with which a state counts as found
# Times the size of the next step with which a state counts as found: up to that it does where no step leads nearer, as
# rounding and what potentials are solved to go on making one. It stands in the errors.
ROUNDED = 10.0
INNER = 1e-2  # to which each step's linear system is solved, relatively
# Where a step is more than this part of the last one, as the current's pattern moves with the heat, secants of so many
# earlier ones serve too (Anderson, J. ACM 12, 1965).
SLOW, SECANTS = 0.1, 5
HALVINGS = 3  # of a step that doesn't bring the state nearer
SHORTEST = 1e-3  # step of the drive, relative, at which its largest value counts as found
AROUND = 0.05  # of a limit: steps near it, which begin at twice that below it
NEAR = 0.1  # of a drive: a step of that size fails because there is no state ahead, not because it is too long
# Power of the drive that the rise grows with, from which on it runs away: that of a voltage is 2, that of heat 1.
STEEP = 4.0
ON_THE_WAY = 1e-3  # relative size of the last step to a state that only leads on to another
HOTTEST = 1e5  # K, beyond any solid: a state that hot counts as none
# Of the accuracy: what a finer quadrature may change of the rise; and of the error of the mesh before, so much of which
# may be left on this one, which is refined then: for an answer quadratures are made finer on the same mesh.
TOLD, BETTER = 0.03, 0.3
MOST_FINER = 6
ROUGH = 2e-2  # relative size of the next step to a state that another space begins from
NEXT_TO = 1e-2  # size of a step, relative to the rise, after which a new tangent would be the same
WORSE = 1.5  # factor on what such a step leaves, up to which the tangent serves
OFF = 0.1  # of a step: what the next one by the same tangent may be of it, if that is to serve again


@dataclass(frozen=True, eq=False)
class Point:
    """A rise (all nodes), the current there, the ``source`` (all nodes, W) and the residual (free nodes, W)."""

    rise: np.ndarray
    potential: Potential | None
    source: np.ndarray
    residual: np.ndarray

    @property
    def volts(self) -> np.ndarray | None:
        """(functions,): the potential."""
        return None if self.potential is None else self.potential.potential


@dataclass
class Newton:
    """The states of a nonlinear problem at fractions of what drives it, which count as found with a relative size
    ``enough`` of the step that would be next: how many ``steps`` they took, that size ``ahead``, and a ``tangent``, by
    which a step is ``off`` times the last one, and was ``least`` times that where the tangent was new and the step
    small."""

    heat: HeatProblem
    conductor: Conductor | None
    enough: float
    steps: int = 0
    ahead: float = np.inf
    off: float = np.inf
    tangent: HeatProblem | None = field(default=None, repr=False)
    least: float = 0.0
    vanished: bool = False
    """Whether a resistivity was not positive at the rise that was looked at last."""

    def at(self, rise: np.ndarray, drive: float, near: np.ndarray | None = None) -> Point | None:
        """The point of a rise, ``near`` being the potential of a similar one at this drive; None where no law says
        anything there."""
        heat, conductor = self.heat, self.conductor
        hottest = float(np.abs(rise[heat.unit == 1.0]).max(initial=0.0))
        if not np.isfinite(rise).all() or hottest > HOTTEST:
            return None
        source, potential = drive * heat.loads[0], None
        self.vanished = conductor is not None and not conductor.conducts(rise)
        if self.vanished:
            return None
        if conductor is not None:
            potential = conductor.solve(rise, drive * conductor.voltages[0], near)
            source = source + conductor.joule_load(potential.density, rise)
        return Point(rise, potential, source, (source - heat.outflow(rise))[: heat.free])

    def solve(
        self, drive: float, start: np.ndarray, near: np.ndarray | None, enough: float = 0.0, off: float = np.inf
    ) -> Point | None:
        """The state at a fraction of the drive, from a rise near it, or one that is near ``enough`` for what is asked
        of it; None where the iteration leads nowhere. ``off`` is what the tangent that there is is off by there."""
        heat = self.heat
        start = np.concatenate([start[: heat.free], drive * heat.given[0]])
        point, self.off, self.ahead = self.at(start, drive, near), off, np.inf
        sizes: list[float] = []
        rises, directions = list[np.ndarray](), list[np.ndarray]()
        for _ in range(MOST_STEPS):
            if point is None or (len(sizes) > STALLED and sizes[-1] > sizes[-1 - STALLED] / 2):
                return None
            self.steps += 1
            known, tangent = self.tangent, self.tangent_at(point)
            try:
                direction = tangent.inner_rest.solve(tangent.solve_steady, point.residual[None], INNER)[0]
            except NumericsError:
                return None
            sizes.append(_largest(direction))
            rises, directions = [*rises[-SECANTS:], point.rise[: heat.free]], [*directions[-SECANTS:], direction]
            if len(sizes) > 1 and sizes[-1] > SLOW * sizes[-2]:
                direction = _accelerated(rises, directions)
            # Near a runaway the rest of the tangent makes steps longer than the stiffness alone has them.
            longer = max(1.0, sizes[-1] / (_largest(tangent.solve_steady(point.residual)) or 1.0))
            nearer = self._along(point, tangent, direction, drive)
            if nearer is None:
                return point if self.ahead < min(ROUNDED * self.enough, ON_THE_WAY) else None
            point = nearer
            if tangent is not known and sizes[-1] < NEXT_TO * _largest(point.rise):
                self.least = self.off
            self.ahead = longer * self.off * sizes[-1] / (_largest(point.rise) or 1.0)
            if self.ahead < max(self.enough, enough):
                return point
        return None

    def tangent_at(self, point: Point) -> HeatProblem:
        """The problem linearized about a point, or about one so near that its factors serve."""
        if self.tangent is None or self.off > max(OFF, WORSE * self.least):
            density = np.empty(0) if point.potential is None else point.potential.density
            self.tangent, self.off = linearized(self.heat, self.conductor, point.rise, density), 0.0
            self.least = 0.0
        return self.tangent

    def finer(self, point: Point) -> Newton:
        """The same problem, with its tangent, by quadratures that are finer for a point."""
        u = self.heat.field(point.rise)
        heat = replace(self.heat, terms=tuple(term.finer(u) for term in self.heat.terms))
        return replace(self, heat=heat, conductor=self.conductor and self.conductor.finer(u))

    def missed(self, point: Point, better: Newton) -> float:
        """What a better quadrature would change, relatively: of the rise of a point, seen through the tangent, and of
        the currents there and their heat."""
        change = better.heat.outflow(point.rise) - self.heat.outflow(point.rise)
        electric = 0.0
        if point.potential is not None and better.conductor is not None and better.conductor is not self.conductor:
            again = better.conductor.solve(point.rise, better.conductor.voltages[0], point.volts)
            joule = point.source - self.heat.loads[0]
            more = better.conductor.joule_load(again.density, point.rise) - joule
            change -= more
            currents, others = (
                np.array([*better.conductor.pattern(potential).currents.values()])
                for potential in (point.potential, again)
            )
            unit = self.heat.unit
            electric = max(
                _largest(others - currents) / (_largest(currents) or 1.0),
                abs(float(unit @ more)) / (float(unit @ joule) or 1.0),
            )
        seen = self.tangent_at(point).solve_steady(change[: self.heat.free])
        return max(_largest(seen) / (_largest(point.rise) or 1.0), electric)

    def _along(self, point: Point, tangent: HeatProblem, direction: np.ndarray, drive: float) -> Point | None:
        """The point at the end of a step, which is halved until it is nearer, as the tangent sees it."""
        n, size = self.heat.free, _largest(direction)
        for halving in range(HALVINGS + 1):
            factor = 0.5**halving
            rise = np.concatenate([point.rise[:n] + factor * direction, point.rise[n:]])
            new = self.at(rise, drive, point.volts)
            if new is None:
                continue
            remaining = _largest(tangent.solve_steady(new.residual))
            if remaining < (1 - factor / 4) * size or remaining < 1e-9 * _largest(rise):
                self.off = remaining / size if remaining > 1e-9 * _largest(rise) else 0.0
                return new
        return None


def coupled(
    heat: HeatProblem,
    conductor: Conductor | None,
    voltage: float,
    accuracy: float,
    start: np.ndarray | None = None,
    limit: float | None = None,
    error: float = 0.0,
) -> SteadyState:
    """The steady state at constant inputs; ``start`` is a rise (all nodes) that may be near it. The heat problem of the
    state is the one linearized about it, by a quadrature that is made finer until its error hardly counts, as far as
    that goes. ``voltage`` (V) names the drive in messages; of another, coarser mesh ``limit`` is the fraction of the
    drive from which on it had no state, and ``error`` the relative one of its state.

    Raises RunawayError where no steady state exists, NumericsError where the iteration fails.
    """
    newton = _newton(heat, conductor, ENDS * accuracy)
    point = None if start is None else newton.solve(1.0, start, None)
    point = point or _driven(newton, voltage, limit)
    most, off = TOLD * max(accuracy, BETTER * min(error, 1.0)), np.inf
    for _ in range(MOST_FINER):
        better = newton.finer(point)
        off = newton.missed(point, better)
        again = None if off <= most else better.solve(1.0, point.rise, point.volts, off=newton.off)
        if again is None:
            break  # it does, or a finer mesh may do better: what is left stands in the errors
        newton, point = better, again
    return _state(newton, point, off)


def rough(heat: HeatProblem, conductor: Conductor | None, voltage: float, limit: float | None = None) -> SteadyState:
    """About the steady state, for another space to begin from. Arguments, and what is raised, as of `coupled`."""
    newton = _newton(heat, conductor, ROUGH)
    point = _driven(newton, voltage, limit)
    newton.off = 0.0  # nobody asks for what is linearized about it
    return _state(newton, point, 0.0)


def within(
    near: SteadyState, tangent: HeatProblem, conductor: Conductor | None, voltage: float, accuracy: float
) -> SteadyState:
    """The steady state in a space that the one of a state ``near`` it holds: of the problem of which ``tangent`` is the
    one linearized about that state. Raises as `coupled` does."""
    assert tangent.exact is not None
    newton = Newton(tangent.exact, conductor, ENDS * accuracy, tangent=tangent)
    start = tangent.take(near.heat.field(near.rise))
    point = newton.solve(1.0, start, near.potential, off=0.0)
    return _state(newton, point or _driven(newton, voltage), 0.0)


def _newton(heat: HeatProblem, conductor: Conductor | None, enough: float) -> Newton:
    if heat.inputs.schedules:
        raise NumericsError("a scene whose conditions vary in time has no steady state")
    if not heat.anchored:
        raise NumericsError("a part of the scene has no exit for heat: it has no steady state")
    return Newton(heat, conductor, enough)


def _driven(newton: Newton, voltage: float, limit: float | None = None) -> Point:
    """The state at the whole drive, which is raised as far as each step leads; in steps of their own up to a little
    beyond a ``limit`` that there may be."""
    heat = newton.heat
    drive, step, beyond, rise, near_by = 0.0, 1.0, np.inf, np.zeros(heat.size), 0.0
    if limit is not None:
        step = (1 - 2 * AROUND) * limit
    near: np.ndarray | None = None
    before: tuple[float, np.ndarray] | None = None
    while True:
        ahead = min(1.0, drive + step)
        if ahead >= beyond:
            ahead = (drive + beyond) / 2
        guess = rise if before is None else rise + (ahead - drive) / (drive - before[0]) * (rise - before[1])
        volts = None if near is None else near * (ahead / drive)
        point = newton.solve(ahead, guess, volts, 0.0 if ahead == 1.0 else ON_THE_WAY)
        if point is not None:
            if ahead == 1.0:
                return point
            before, drive, rise, near = (drive, rise), ahead, point.rise, point.volts
            around = limit is not None and abs(drive / limit - 1) < 3 * AROUND
            step = min(2 * step, AROUND * (limit or 1.0)) if around else 2 * step
        else:
            step = (ahead - drive) / 2
            if step <= NEAR / 2 * ahead:
                beyond = ahead
        if min(step, beyond - drive) < SHORTEST * max(drive, SHORTEST):
            if drive > (1 + SHORTEST) * near_by:
                # From so near states may be found that weren't from further away.
                near_by, beyond, step = drive, np.inf, 2 * SHORTEST * drive
                continue
            steep = before is not None and _power(before, (drive, rise)) > STEEP
            given_current = newton.conductor is not None and newton.conductor.by_current
            may = physics.may_run_away(heat.domain.scene, given_current)
            # Where a resistivity falls to zero there is a last state without a fold.
            raise _runaway(newton, voltage, drive, rise, may and (steep or newton.vanished))


def _accelerated(rises: list[np.ndarray], steps: list[np.ndarray]) -> np.ndarray:
    """The last of some ``steps`` from ``rises`` (free nodes), less what combines with the earlier ones to nothing."""
    moves, changes = np.diff(rises, axis=0), np.diff(steps, axis=0)
    shares = np.linalg.lstsq(changes.T, steps[-1], rcond=None)[0]
    return np.asarray(steps[-1] - shares @ (moves + changes))


def _power(before: tuple[float, np.ndarray], after: tuple[float, np.ndarray]) -> float:
    """The power of the drive with which the largest rise grows between two drives with their rises."""
    (low, first), (high, last) = before, after
    return (_largest(last) - _largest(first)) / (_largest(last) or 1.0) / ((high - low) / high)


def _runaway(newton: Newton, voltage: float, drive: float, rise: np.ndarray, steep: bool) -> RunawayError:
    """What is said where the largest fraction of the drive with a known steady state is ``drive``, at which the rise is
    ``steep`` where it runs away."""
    conductor, limit = newton.conductor, drive * (abs(voltage) or 1.0)
    hottest = newton.heat.domain.scene.initial_temperature + HOTTEST
    # The last step of the drive, which changes the rise by less than this, led beyond.
    if not steep and _largest(rise) > (1 - 2 * STEEP * SHORTEST) * HOTTEST:
        return RunawayError(
            f"at {drive:.3g} times what drives the scene the steady state is at {hottest:,.0f} K, hotter than any "
            "solid: no hotter one is looked for", limit,
        )  # fmt: skip
    if not steep:
        return RunawayError(
            f"no steady state is found beyond {drive:.3g} times what drives the scene, which need not be a runaway",
            limit,
        )
    where = f"no steady state exists below {hottest:,.0f} K"
    if conductor is None or not voltage:
        return RunawayError(
            f"thermal runaway: {where}, because the conductivity falls as it heats", limit,
            f"the largest part of what heats the scene that has one is {limit:.3g}",
        )  # fmt: skip
    what, unit = ("current", "A") if conductor.by_current else ("voltage", "V")
    return RunawayError(
        f"thermal runaway: at {voltage:g} {unit} {where}, because the conductivity falls or the resistance changes as "
        "it heats", limit, f"the largest {what} that has one is {limit:.3g} {unit}",
    )  # fmt: skip


def _state(newton: Newton, point: Point, off: float) -> SteadyState:
    """The state of a point, with what its quadrature is ``off`` by."""
    conductor, potential = newton.conductor, point.potential
    density = np.zeros((3, 0, 0)) if potential is None else potential.density
    near, rise = newton.tangent_at(point), point.rise.copy()
    # What is left of the residual may be rough: hardly any of a rise, and more of a flow.
    rise[: near.free] += near.solve_steady(point.residual)
    about = near.field(rise)
    heat = at_films(replace(near, about=about, exact=newton.heat), about)
    heat.kept.tell(solve_steady=near.solve_steady)
    # What the stiffness makes of the rise is not the outflow where a term is no conduction.
    source = point.source + heat.stiffness @ rise - newton.heat.outflow(rise)
    lift = heat.lifts[0]
    fields = (rise - lift)[: heat.free, None]
    unsettled = newton.ahead + off
    if conductor is None or potential is None:
        return SteadyState(
            heat, None, rise, source, {}, {}, 0.0, None, fields, [], 0.0, False, newton.steps,
            unsettled=unsettled,
        )  # fmt: skip
    # The heat of the source that the rise answers, and not that of a rise one step on: so they balance.
    pattern, joule = conductor.pattern(potential), conductor.joule(density, point.rise)
    return SteadyState(
        heat, conductor, rise, source, joule, pattern.currents, float(sum(joule.values())), potential.potential,
        fields, [pattern], 0.0, True, newton.steps, unsettled=unsettled, density=density,
    )  # fmt: skip


def _largest(field: np.ndarray) -> float:
    return float(np.abs(field).max(initial=0.0))
