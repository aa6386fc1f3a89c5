"""The coupled steady state on a mesh with groups, by the scheme of `fem3d.steady`: full steps, accelerated by the
reduced problem that they build, in which thermal runaway is a maximum along the current."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem3d import operating_point
from fem3d.errors import NumericsError, RunawayError
from fem3d.unstructured import patterns as pattern
from fem3d.unstructured.conductor import Conductor, Potential
from fem3d.unstructured.heat import Heat
from fem3d.unstructured.patterns import Pattern
from fem3d.unstructured.project import project

CONVERGED = 1e-3  # part of the accuracy that the last step may change the rise by
ROUNDED = 1e-9
MOST_STEPS = 60
SLOW = 15  # steps after which the reduced problem gets a second current pattern
BACK = 0.8


@dataclass(frozen=True, eq=False)
class SteadyState:
    """The converged state: ``rise`` (all nodes, K), the ``source`` that it answers (all nodes, W), the potential."""

    heat: Heat
    conductor: Conductor | None
    rise: np.ndarray
    source: np.ndarray
    potential: Potential | None
    steps: int

    @property
    def power(self) -> float:
        """What the electrodes supply (W)."""
        if self.conductor is None or self.potential is None:
            return 0.0
        return float(self.conductor.voltages[0] @ self.potential.reaction)


def solve(heat: Heat, conductor: Conductor | None, thermal: bool, accuracy: float) -> SteadyState:
    """The steady state. Raises RunawayError where there is none, NumericsError where the iteration fails."""
    n, given, lift = heat.free, heat.loads[0], heat.lifts[0]
    still = np.zeros(heat.size)
    if conductor is None:
        rise = lift + heat.whole(heat.solve_steady(given[:n]))
        return SteadyState(heat, None, rise, given, None, 0)
    if not thermal:
        return SteadyState(heat, conductor, still, given, conductor.solve(still, conductor.voltages[0]), 1)
    voltages = conductor.voltages[0]
    span = float(np.ptp(voltages[np.concatenate(list(conductor.electrodes.values()))]))
    if not conductor.conducts(lift):
        raise NumericsError("the resistivity is not positive at the given temperatures")
    cold = hot = conductor.solve(lift, voltages)
    load = pattern.joule_load(conductor, cold.density, cold.density, lift)
    answer = heat.solve_steady((given + load)[:n])
    if not conductor.warm.any() or not load.any():
        return SteadyState(heat, conductor, lift + heat.whole(answer), given + load, cold, 1)
    fields, used = answer[:, None], [Pattern.of(conductor, cold)]
    for step in range(1, MOST_STEPS + 1):
        reduced = project(heat, conductor, fields, used)
        point = operating_point.find(reduced)
        own = reduced.basis @ point.a
        while not conductor.conducts(lift + heat.whole(own)):
            own = BACK * own  # few fields may put the state beyond the law's reach; the full step then brings it back
        rise = lift + heat.whole(own)
        # At a fold the state is that of a smaller voltage.
        hot = conductor.solve(rise, voltages, hot.potential)
        load = point.fraction**2 * pattern.joule_load(conductor, hot.density, hot.density, rise)
        answer = heat.solve_steady((load + given)[:n])
        moved = float(np.abs(answer - own).max() / (np.abs(lift + heat.whole(answer)).max() or 1.0))
        if moved < max(CONVERGED * accuracy, ROUNDED) or (point.folded and moved < 1e-4):
            break
        both = point.folded or step > SLOW
        used = pattern.independent(conductor, [cold, hot]) if both else [Pattern.of(conductor, hot)]
        fields = np.column_stack([fields, answer - own])
    else:
        raise NumericsError(f"the coupled steady state does not converge at {span:g} V")
    if point.folded:
        raise RunawayError(span, point.fraction * span)
    rise = lift + heat.whole(answer)
    return SteadyState(heat, conductor, rise, load + given, hot, step)
