"""The coupled steady state: fixed-point steps in full, accelerated by the reduced problem that they build.

Each step solves the reduced problem on the fields found so far (which also finds runaway), then the full electric and
the full heat problem at that state. Their answer joins the fields, so the iteration converges like a Krylov method
instead of like Picard's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fem3d.problems.current import Conductor, Pattern, Potential
from fem3d.problems.current_fields import combined, independent
from fem3d.problems.heat import HeatProblem
from fem3d.solution import continuation
from fem3d.solution.reduced import project
from fem3d.solution.slight import Leaving
from scenes.errors import BeyondLawError, ConvergenceError, NumericsError, RunawayError

# The fewer where faces leave heat beyond their films: then Newton's method takes over, which takes less than the rest.
MOST_STEPS, STEPS_WITH_FACES = 60, 20
CONVERGED = 1e-3  # the iteration ends where a step changes the rise by less than this fraction of the accuracy
# Below this fraction of the accuracy it also ends where steps no longer halve: rounding keeps it from getting better,
# which on the worst meshes is up to ROUNDED of the rise.
SETTLED, ROUNDED = 1e-1, 1e-7
FOLD_KNOWN = 1e-4  # relative change of the rise below which the largest current of the reduced problem is a fold
SECOND_PATTERN = 15  # steps after which the reduced problem keeps the cold current pattern beside the latest
BACK = 0.8  # factor that a rise at which the resistivity is not positive is lowered by, until it is
UNIFORM = 5e-2  # a current pattern whose change with heating moves the rise by less than this fraction isn't followed


@dataclass(frozen=True, eq=False)
class SteadyState:
    """The converged state of one mesh.

    ``rise`` (all nodes), the ``source`` (W per node, all nodes) that it answers, the Joule heat of each box and the
    current that enters at each electrode or passes a probe; the temperature fields (free nodes) and current patterns
    of the reduced problem. ``pattern_change``: how far heating moves the current's pattern, by its relative effect on
    the rise. ``drive``: the voltages over those of the scene. ``unsettled``: what the coupled iteration has left, and a
    current pattern that wasn't followed, relative to the rise. ``density``: the current's (A/m2).
    """

    heat: HeatProblem
    conductor: Conductor | None
    rise: np.ndarray
    source: np.ndarray
    joule: dict[str, float]
    currents: dict[str, float]
    power: float
    potential: np.ndarray | None
    fields: np.ndarray
    patterns: list[Pattern]
    pattern_change: float
    follows_pattern: bool
    steps: int
    drive: float = 1.0
    unsettled: float = 0.0
    density: np.ndarray = field(default_factory=lambda: np.zeros((3, 0, 0)))

    @cached_property
    def hot_potential(self) -> np.ndarray:
        """The potential (V) at the converged rise."""
        c = self.conductor
        assert c is not None
        return c.solve(self.rise, self.drive * c.voltages[0], self.potential).potential


def coupled(
    heat: HeatProblem,
    conductor: Conductor | None,
    thermal: bool,
    voltage: float,
    accuracy: float,
    follow: bool | None = None,
) -> SteadyState:
    """The steady state at constant inputs; without ``thermal`` the currents alone. ``voltage`` (V) names the drive in
    messages. Whether the current's pattern is followed as it heats up is decided by its effect, or given by
    ``follow``.

    With u the rise, phi the potential and q(u, phi) the Joule heat, step k solves the reduced problem on the fields and
    patterns that there are for u_k, then K u = q(u_k, phi(u_k)) + f in full; its answer joins the fields. It ends where
    that answer is u_k. What leaves by faces beyond their films is a load too (`fem3d.solution.slight`).

    Raises RunawayError where no steady state exists, BeyondLawError where the mesh has one at which the resistivity is
    not positive, ConvergenceError where the iteration fails, NumericsError where faces take no slight part of the heat,
    which `fem3d.solution.newton` is for.
    """
    if heat.inputs.schedules:
        raise NumericsError("a scene whose conditions vary in time has no steady state")
    if conductor is not None and not thermal:
        return _currents_alone(heat, conductor)
    if not heat.anchored:
        raise NumericsError("a part of the scene has no exit for heat: it has no steady state")
    if conductor is None:
        return _heat_alone(heat, accuracy, follow is None)
    given, lift, volts = heat.loads[0], heat.lifts[0], conductor.voltages[0]
    cold, fields = first_guess(heat, conductor)
    latest, patterns = cold, [conductor.pattern(cold)]
    follows, change, moved, limit = conductor.warms and follow is not False, 0.0, np.inf, 0.0
    leaving = Leaving(heat, lift + heat.whole(fields[:, 0]), follow is None)
    beyond = np.zeros(heat.free)  # the last state that the resistivity is not positive at
    most = STEPS_WITH_FACES if heat.terms else MOST_STEPS
    for step in range(1, most + 1):
        reduced = leaving.beside(project(heat, conductor, fields, patterns))
        point = continuation.find(reduced)
        state = reduced.basis @ point.a
        start = _within_the_law(heat, conductor, state)
        if start is not state:
            if _largest(state - beyond) <= CONVERGED * accuracy * _largest(state):
                raise BeyondLawError
            beyond = state
        rise = lift + heat.whole(start)
        if follows:
            hot = conductor.solve(rise, volts, latest.potential)
            load = point.fraction**2 * conductor.joule_load(hot.density, rise)
            if step == 1:
                by_pattern = load - conductor.joule_load(combined(patterns, point.c), rise)
                moved_by_it = heat.norm(heat.solve_steady(by_pattern[: heat.free]))
                change = moved_by_it / point.fraction**2 / (heat.norm(start) or 1.0)
                change = max(change, _apart(conductor.pattern(hot), patterns[0], float(point.c[0]) / point.fraction))
                follows = follow is not None or change >= UNIFORM * accuracy
        if follows:
            latest = hot
            # Away from a fold the latest pattern is the right one in the end; where a fold lies also depends on how the
            # pattern changes along the way, and near it the iteration does.
            both = point.folded or step > SECOND_PATTERN
            patterns = independent(conductor, [cold, hot]) if both else [conductor.pattern(hot)]
        else:
            load = conductor.joule_load(combined(patterns, point.c), rise)
        source = load + given - leaving.at(rise)
        answer = heat.solve_steady(source[: heat.free])
        before, moved = moved, _largest(answer - start) / (_largest(answer) or 1.0)
        if converged(moved, before, accuracy) or (point.folded and moved < FOLD_KNOWN):
            break
        # Where a given current has its limit the rise has none, and only the limit itself settles.
        limit, known = point.fraction, limit
        if point.folded and conductor.by_current and abs(limit - known) < FOLD_KNOWN * limit:
            break
        fields = np.column_stack([fields, answer - start])
    else:
        unit = "A" if conductor.by_current else "V"
        raise ConvergenceError(
            f"the coupled steady state does not converge at {voltage:g} {unit}: after {most} steps one still "
            f"changes the rise by {moved:.1g} of itself, as rounding does where lengths of a scene are far apart"
        )
    if point.folded:
        what, unit, why = ("current", "A", "rises") if conductor.by_current else ("voltage", "V", "falls")
        limit = point.fraction * abs(voltage)
        raise RunawayError(
            f"thermal runaway: at {voltage:g} {unit} no steady state exists, because the resistance {why} as it heats",
            limit, f"the largest {what} with a steady state is {limit:.4g} {unit}",
        )  # fmt: skip
    # A pattern that isn't followed is the cold one, at the current that the warmer resistance lets through.
    scale = 1.0 if follows else float(point.c[0])
    density, last = scale * latest.density, conductor.pattern(latest)
    joule = conductor.joule(density, rise)
    rise = heat.improve(lift + heat.whole(answer), source)
    about, off = leaving.about(rise, accuracy)
    return SteadyState(
        about, conductor, rise, source, joule,
        {name: scale * current for name, current in last.currents.items()},
        float(sum(joule.values())), latest.potential, np.column_stack([fields, answer]),
        independent(conductor, [cold, latest]) if follows else [last], change, follows, step,
        unsettled=moved + off + (0.0 if follows else 2 * change), density=density,
    )  # fmt: skip


def _apart(hot: Pattern, cold: Pattern, scale: float) -> float:
    """The largest relative difference between the current of an electrode and ``scale`` times that of the cold
    conductor: several conductors that get warm differently have patterns of their own."""
    pairs = ((current, scale * cold.currents[name]) for name, current in hot.currents.items())
    return max((abs(a - b) / abs(a) for a, b in pairs if a), default=0.0)


def first_guess(heat: HeatProblem, conductor: Conductor) -> tuple[Potential, np.ndarray]:
    """The current at the given temperatures, and as the first field (free nodes, 1) the rise that it and all other
    sources make. Raises NumericsError where the resistivity is not positive at those temperatures."""
    if not conductor.conducts(heat.lifts[0]):
        raise NumericsError("the resistivity is not positive at the given temperatures")
    cold = conductor.solve(heat.lifts[0], conductor.voltages[0])
    source = conductor.joule_load(cold.density, heat.lifts[0]) + heat.loads[0]
    return cold, heat.solve_steady(source[: heat.free])[:, None]


def converged(moved: float, before: float, accuracy: float) -> bool:
    """Whether a step that changed the rise by ``moved`` of itself, the one ``before`` it by that, is the last."""
    stalled = moved < max(SETTLED * accuracy, ROUNDED) and moved > before / 2
    return moved < CONVERGED * accuracy or stalled


def _within_the_law(heat: HeatProblem, conductor: Conductor, start: np.ndarray) -> np.ndarray:
    """A rise (free nodes) at which the resistivity is positive everywhere: a state of few fields may lie beyond that,
    and the full step then brings it back."""
    while not conductor.conducts(heat.lifts[0] + heat.whole(start)):
        start = BACK * start
    return start


def _largest(field: np.ndarray) -> float:
    return float(np.abs(field).max(initial=0.0))


def _currents_alone(heat: HeatProblem, conductor: Conductor) -> SteadyState:
    """The currents at the initial temperature, where nothing thermal is asked for."""
    still = np.zeros(heat.size)
    cold = conductor.solve(still, conductor.voltages[0])
    pattern, power = conductor.pattern(cold), float(cold.potential @ cold.reaction)
    joule = conductor.joule(cold.density, still)
    return SteadyState(
        heat, conductor, still, heat.loads[0], joule, pattern.currents, power, cold.potential,
        np.empty((heat.free, 0)), [pattern], 0.0, False, 1, density=cold.density,
    )  # fmt: skip


def _heat_alone(heat: HeatProblem, accuracy: float, check: bool) -> SteadyState:
    """The temperature where no current flows: K u = f, linear but for what leaves by faces."""
    given, lift = heat.loads[0], heat.lifts[0]
    fields, source, moved, steps = heat.solve_steady(given[: heat.free])[:, None], given, 0.0, 1
    leaving = Leaving(heat, lift + heat.whole(fields[:, 0]), check)
    while heat.terms:
        reduced = leaving.beside(project(heat, None, fields))
        start, steps = reduced.basis @ np.linalg.solve(reduced.stiffness, reduced.source[0]), steps + 1
        source = given - leaving.at(lift + heat.whole(start))
        answer = heat.solve_steady(source[: heat.free])
        before, moved = moved or np.inf, _largest(answer - start) / (_largest(answer) or 1.0)
        fields = np.column_stack([fields, answer])
        if converged(moved, before, accuracy):
            break
        if steps > MOST_STEPS:
            raise ConvergenceError("the steady state of faces that radiate does not converge")
    rise = heat.improve(lift + heat.whole(fields[:, -1]), source)
    fields[:, -1], (known, off) = (rise - lift)[: heat.free], leaving.about(rise, accuracy)
    return SteadyState(
        known, None, rise, source, {}, {}, 0.0, None, fields, [], 0.0, False, steps, unsettled=moved + off
    )
