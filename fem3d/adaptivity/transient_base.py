"""Basis of currents and loads for the reduced space of a transient without a solved steady state.

It starts from the currents at the initial temperature and from every load of the scene. If the resistivity depends on
temperature, a rough response shows how far heating changes the currents; the currents at its hottest instants and
their Joule loads join the basis.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fem3d.adaptivity.nested import Problems
from fem3d.problems.current import Conductor, Potential
from fem3d.problems.current_fields import combined, independent
from fem3d.problems.heat import HeatProblem
from fem3d.solution import transient
from fem3d.solution.transient import Base, Krylov, Transient
from scenes.errors import BeyondLawError, RunawayInTimeError

ROUGH, GENERATIONS = 1e-3, 6  # accuracy and generations of fields of a response that only locates hot instants
ROUNDS = 5
# Fields are made up to this fraction of the time at which the heating runs away: there its rate is still finite.
BEFORE = 0.95
SAME = 5e-2  # a change of the currents by heating is left out where it is below this fraction of the accuracy


class Hot(NamedTuple):
    """A state at which heating changes the currents most: the ``rise`` (all nodes), the inputs ``drive`` (channels,),
    and whether its currents join the basis, or only their Joule load."""

    rise: np.ndarray
    drive: np.ndarray
    joins: bool


def nested(given: Problems, shift: float, end: float, accuracy: float) -> list[Base]:
    """Return the base in each nested space, the highest first; hot states are searched in the lowest space alone."""
    lowest, hot = searched(given.heats[0], given.conductors[0], shift, end, accuracy)
    upper = [hold(*pair, hot, lowest.heat) for pair in zip(given.heats[1:], given.conductors[1:], strict=True)]
    return [*upper[::-1], lowest]


def hold(heat: HeatProblem, conductor: Conductor | None, hot: list[Hot], other: HeatProblem) -> Base:
    """Return the base that holds the currents of hot states of another problem, in a lower space or on a moved mesh."""
    base, potentials = cold(heat, conductor)
    for state in hot:
        assert conductor is not None
        mapped = state._replace(rise=heat.take(other.field(state.rise)))
        base, potentials = joined_by(base, potentials, mapped, *heated(conductor, mapped, potentials))
    return base


def cold(heat: HeatProblem, conductor: Conductor | None) -> tuple[Base, list[Potential]]:
    """Return the base at the initial temperature, and its potentials."""
    loads, still = transient.heat_loads(heat), transient.stills(heat)
    if conductor is None:
        return Base(heat, None, [], still, loads), []
    lift = heat.inputs.at(np.zeros(1))[0] @ heat.lifts
    potentials = [conductor.solve(lift, v) for v in conductor.voltages if v.any()]
    patterns = independent(conductor, potentials)
    pairs = [(a, b) for i, a in enumerate(patterns) for b in patterns[: i + 1]]
    loads += [conductor.joule_load(a.density, lift, b.density) for a, b in pairs]
    return Base(heat, conductor, patterns, still, loads), potentials


def heated(conductor: Conductor, state: Hot, cold: list[Potential]) -> tuple[list[Potential], np.ndarray]:
    """Return the potentials of each driven channel in a hot state, and the Joule load (all nodes) of its currents; the
    list ``cold`` begins with the initial guesses."""
    driven = [c for c, v in enumerate(conductor.voltages) if v.any()]
    hot = [conductor.solve(state.rise, conductor.voltages[c], cold[k].potential) for k, c in enumerate(driven)]
    return hot, conductor.joule_load(combined(hot, state.drive[driven]), state.rise)


def joined_by(
    base: Base, potentials: list[Potential], state: Hot, hot: list[Potential], load: np.ndarray
) -> tuple[Base, list[Potential]]:
    """Add the potentials and the load of a hot state to a base."""
    assert base.conductor is not None
    together = [*potentials, *hot]
    patterns = independent(base.conductor, together) if state.joins else base.patterns
    return replace(base, patterns=patterns, loads=[*base.loads, load]), together


def searched(
    heat: HeatProblem, conductor: Conductor | None, shift: float, end: float, accuracy: float
) -> tuple[Base, list[Hot]]:
    """Return the base with the currents and loads that heating brings, and their hot states."""
    base, potentials = cold(heat, conductor)
    joined: list[Hot] = []
    if conductor is None or not conductor.warms or not potentials:
        return base, joined
    drive = heat.inputs
    times, size = _instants(drive.knots(end), end), 1e-300
    for turn in range(ROUNDS):
        answer = _rough(base, shift, end)
        times = np.unique(np.minimum(times, answer.end))
        states, g = answer.trajectory(times)[0], drive.at(times)
        rises, c = answer.rises(times), answer.reduced.currents(states, g)
        worst, changes = None, np.zeros(len(times))
        for i, rise in enumerate(rises):
            if not ((g[i] @ conductor.voltages).any() and conductor.conducts(rise)):
                continue
            state = Hot(rise, g[i], False)
            hot, load = heated(conductor, state, potentials)
            reached = conductor.joule_load(combined(base.patterns, c[i]), rise)
            size = max(size, float(np.abs(load).sum()))
            changes[i] = np.abs(load - reached).sum()
            if changes[i] == changes.max():
                worst = state, hot, load
        matter = changes >= SAME * accuracy * size
        if worst is None or (turn > 0 and not matter.any()):
            break
        state, hot, load = worst
        joined.append(state._replace(joins=bool(matter.any())))
        base, potentials = joined_by(base, potentials, joined[-1], hot, load)
        # Sufficiently accurate currents stay so. One instant is always checked again, because its load has joined.
        times = times[matter | (changes == changes.max())]
    return base, joined


def _rough(base: Base, shift: float, end: float) -> Transient:
    """Return a rough response up to ``end`` (s), or until shortly before a runaway; only the accurate response decides
    whether there is a runaway."""
    reduced = base.project(Krylov(base, shift).fields(GENERATIONS))
    try:
        return transient.march(base, reduced, end, ROUGH)
    except (BeyondLawError, RunawayInTimeError) as stop:
        return transient.march(base, reduced, BEFORE * stop.time, ROUGH)


def _instants(knots: np.ndarray, end: float) -> np.ndarray:
    """Return a few times (s) spread over a run, some just before changes of the inputs."""
    few = knots[np.unique(np.linspace(0, len(knots) - 1, 4).astype(int))] if len(knots) else knots
    return np.unique(np.concatenate([np.geomspace(end / 100, end, 4), few * (1 - 1e-9)]))
