"""The coupled steady state: fixed-point steps in full, accelerated by the reduced problem that they build.

Each step solves the reduced problem on the fields found so far (which also finds runaway), then the full electric and
the full heat problem at that state. Their answer joins the fields, so the iteration converges like a Krylov method
instead of like Picard's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fem3d.problems.current import Conductor, Pattern, combined, independent
from fem3d.problems.heat import HeatProblem
from fem3d.solution import continuation
from fem3d.solution.reduced import project
from scenes.errors import ConvergenceError, NumericsError, RunawayError

CONVERGED = 1e-3  # part of the accuracy that the last step may change the rise by
ROUNDED = 1e-7  # what rounding may do to the rise on the worst meshes, relative
SETTLED = 1e-1  # part of the accuracy below which the iteration also ends where rounding keeps it from getting better
SLOW = 15  # steps after which the reduced problem gets a second current pattern
BACK = 0.8  # of a rise at which the resistivity is not positive
UNIFORM = 5e-2  # part of the accuracy below which a change of the current's pattern isn't followed


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


def _electric(heat: HeatProblem, conductor: Conductor) -> SteadyState:
    """The currents at the initial temperature, where nothing thermal is asked for."""
    still = np.zeros(heat.size)
    cold = conductor.solve(still, conductor.voltages[0])
    pattern = conductor.pattern(cold)
    joule = conductor.joule(cold.density, still)
    return SteadyState(
        heat, conductor, still, heat.loads[0], joule, pattern.currents, float(pattern.supply[0]), cold.potential,
        np.empty((heat.free, 0)), [pattern], 0.0, False, 1, density=cold.density,
    )  # fmt: skip


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

    Raises RunawayError where no steady state exists, ConvergenceError where the iteration fails.
    """
    if heat.inputs.schedules:
        raise NumericsError("a scene whose conditions vary in time has no steady state")
    if conductor is not None and not thermal:
        return _electric(heat, conductor)
    if not heat.anchored:
        raise NumericsError("a part of the scene has no exit for heat: it has no steady state")
    n, given, lift = heat.free, heat.loads[0], heat.lifts[0]
    if conductor is None:
        rise = heat.improve(lift + heat.whole(heat.solve_steady(given[:n])), given)
        return SteadyState(heat, None, rise, given, {}, {}, 0.0, None, (rise - lift)[:n, None], [], 0.0, False, 1)
    if not conductor.conducts(lift):
        raise NumericsError("the resistivity is not positive at the given temperatures")
    cold = conductor.solve(lift, conductor.voltages[0])
    potentials, patterns = [cold], [conductor.pattern(cold)]
    fields = heat.solve_steady((conductor.joule_load(cold.density, lift) + given)[:n])[:, None]
    follows, change, before = conductor.warms and follow is not False, 0.0, np.inf
    for step in range(1, 61):
        reduced = project(heat, conductor, fields, patterns)
        point = continuation.find(reduced)
        own = reduced.basis @ point.a
        while not conductor.conducts(lift + heat.whole(own)):
            own = BACK * own  # few fields may put the state beyond the law's reach; the full step then brings it back
        rise = lift + heat.whole(own)
        size = heat.norm(own) or 1.0
        if follows:
            hot = conductor.solve(rise, conductor.voltages[0], potentials[-1].potential)
            load = conductor.joule_load(hot.density, rise)
            expected = point.fraction**-2 * conductor.joule_load(combined(patterns, point.c), rise)
            if step == 1:
                change = heat.norm(heat.solve_steady((load - expected)[:n])) / size
            if step == 1 and follow is None and change < UNIFORM * accuracy:
                follows = False
            else:
                potentials = [hot]
                # Away from a fold the latest pattern is the right one in the end; where a fold lies also depends on
                # how the pattern changes along the way, and near it the iteration does.
                patterns = (
                    independent(conductor, [cold, hot]) if point.folded or step > SLOW else [conductor.pattern(hot)]
                )
                load *= point.fraction**2
        if not follows:
            load = conductor.joule_load(combined(patterns, point.c), rise)
        source = load + given
        answer = heat.solve_steady(source[:n])
        moved = float(np.abs(answer - own).max(initial=0.0) / (np.abs(answer).max(initial=0.0) or 1.0))
        stalled = moved < max(SETTLED * accuracy, ROUNDED) and moved > before / 2
        before = moved
        if moved < CONVERGED * accuracy or stalled or (point.folded and moved < 1e-4):
            break
        fields = np.column_stack([fields, answer - own])
    else:
        raise ConvergenceError(f"the coupled steady state does not converge at {voltage:g} V")
    if point.folded:
        limit = point.fraction * abs(voltage)
        raise RunawayError(
            f"thermal runaway: at {voltage:g} V no steady state exists, because the resistance falls as it heats; "
            f"the largest voltage with a steady state is {limit:.4g} V", limit,
        )  # fmt: skip
    final = potentials[-1]
    scale = 1.0 if follows else float(point.c[0])
    density = scale * final.density
    joule = conductor.joule(density, rise)
    last = conductor.pattern(final)
    return SteadyState(
        heat, conductor, heat.improve(lift + heat.whole(answer), source), source, joule,
        {name: scale * current for name, current in last.currents.items()},
        float(sum(joule.values())), final.potential, np.column_stack([fields, answer]),
        independent(conductor, [cold, final]) if follows else [last], change, follows, step,
        unsettled=moved + (0.0 if follows else 2 * change), density=density,
    )  # fmt: skip
