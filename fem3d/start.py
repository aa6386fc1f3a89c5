"""The base of a transient whose steady state isn't known, or doesn't exist: what its space must hold.

It starts from the currents at the initial temperature and from every load of the scene. Where the resistivity depends
on the temperature, a rough response shows how far heating moves the currents; those at its hottest instants join, and
so do their Joule loads.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem3d import transient
from fem3d.conductor import Conductor, Potential, combined, independent
from fem3d.heat import HeatProblem
from fem3d.transient import Base, Krylov

ROUGH, GENERATIONS = 1e-3, 6  # accuracy and generations of fields of a response that only shows where to look
ROUNDS = 5
SAME = 5e-2  # part of the accuracy below which what heating does to the currents is left out


def of(heat: HeatProblem, conductor: Conductor | None, shift: float, end: float, accuracy: float) -> Base:
    """The base of the response of a heat problem and its conductor up to ``end`` (s)."""
    still = transient.stills(heat, end)
    loads = transient.heat_loads(heat)
    if conductor is None:
        return Base(heat, None, [], still, loads)
    lift = heat.inputs.at(np.zeros(1))[0] @ heat.lifts
    cold = [conductor.solve(lift, v) for v in conductor.voltages if v.any()]
    patterns = independent(conductor, cold)
    pairs = [(a, b) for i, a in enumerate(patterns) for b in patterns[: i + 1]]
    loads += [conductor.joule_load(a.density, lift, b.density) for a, b in pairs]
    found = Base(heat, conductor, patterns, still, loads)
    return _followed(found, conductor, cold, shift, end, accuracy) if conductor.warms and cold else found


def _followed(
    start: Base, conductor: Conductor, potentials: list[Potential], shift: float, end: float, accuracy: float
) -> Base:
    """The base with the currents and loads that heating brings."""
    drive = start.heat.inputs
    driven = [c for c, v in enumerate(conductor.voltages) if v.any()]
    for turn in range(ROUNDS):
        reduced = start.project(Krylov(start, shift).fields(GENERATIONS))
        answer = transient.march(start, reduced, end, ROUGH)
        times = _instants(drive.knots(end), end)
        states, g = answer.trajectory(times)[0], drive.at(times)
        rises, c = answer.rises(times), answer.reduced.currents(states, g)
        worst, size, found = 0.0, 1e-300, None
        for i, rise in enumerate(rises):
            if not (g[i] @ conductor.voltages).any():
                continue
            hot = [conductor.solve(rise, conductor.voltages[channel]) for channel in driven]
            true = combined(hot, g[i][driven])
            load = conductor.joule_load(true, rise)
            reached = conductor.joule_load(combined(start.patterns, c[i]), rise)
            size = max(size, float(np.abs(load).sum()))
            change = float(np.abs(load - reached).sum())
            if change >= worst:
                worst, found = change, (hot, load)
        if found is None or (turn > 0 and worst < SAME * accuracy * size):
            break
        potentials = [*potentials, *found[0]]
        patterns = independent(conductor, potentials) if worst >= SAME * accuracy * size else start.patterns
        start = replace(start, patterns=patterns, loads=[*start.loads, found[1]])
    return start


def _instants(knots: np.ndarray, end: float) -> np.ndarray:
    """A few times (s) spread over a run, among them those just before the inputs change."""
    few = knots[np.unique(np.linspace(0, len(knots) - 1, 4).astype(int))] if len(knots) else knots
    return np.unique(np.concatenate([np.geomspace(end / 100, end, 4), few * (1 - 1e-9)]))
