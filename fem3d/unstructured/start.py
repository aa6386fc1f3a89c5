"""What the space of a transient must hold, as in `fem3d.start`: the currents at the start and at hot instants of a
rough response, and the responses to every load."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem3d import transient
from fem3d.reduced import Reduced
from fem3d.transient import Krylov, Transient
from fem3d.unstructured import patterns as pattern
from fem3d.unstructured.conductor import Conductor, Potential
from fem3d.unstructured.heat import Heat
from fem3d.unstructured.patterns import Pattern
from fem3d.unstructured.project import project

ROUGH, GENERATIONS, ROUNDS = 1e-3, 6, 5
SAME = 5e-2  # part of the accuracy below which what heating does to the currents is left out


@dataclass(frozen=True, eq=False)
class Start:
    """The heat problem, its conductor, the current patterns, and the loads (W, all nodes) whose responses the space
    holds; what `fem3d.transient` knows as a base."""

    heat: Heat
    conductor: Conductor | None
    patterns: list[Pattern]
    loads: list[np.ndarray]
    fields: np.ndarray
    size: float | None = None

    def project(self, fields: np.ndarray) -> Reduced:
        """The reduced problem on some temperature fields (free nodes, r)."""
        return project(self.heat, self.conductor, fields, self.patterns)

    def krylov(self, shift: float) -> Krylov:
        """The growing space of its loads."""
        untyped: Any = self
        return Krylov(untyped, shift)

    def march(self, reduced: Reduced, end: float, accuracy: float, drop: int = 0) -> Transient:
        """The response of a reduced problem up to ``end`` (s), without its last ``drop`` fields."""
        untyped: Any = self
        return transient.march(untyped, reduced, end, accuracy, drop)


def start(heat: Heat, conductor: Conductor | None, shift: float, end: float, accuracy: float) -> Start:
    """The base of the response up to ``end`` (s)."""
    untyped: Any = heat
    found = Start(heat, conductor, [], transient.heat_loads(untyped), np.empty((heat.free, 0)))
    if conductor is None:
        return found
    lift = heat.inputs.at(np.zeros(1))[0] @ heat.lifts
    driven = [v for v in conductor.voltages if v.any()]
    cold = [conductor.solve(lift, v) for v in driven]
    used = pattern.independent(conductor, cold)
    loads = [
        pattern.joule_load(conductor, a.density, b.density, lift) for i, a in enumerate(used) for b in used[: i + 1]
    ]
    found = replace(found, patterns=used, loads=[*found.loads, *loads])
    return _followed(found, cold, shift, end, accuracy) if conductor.warm.any() and driven else found


def _followed(found: Start, potentials: list[Potential], shift: float, end: float, accuracy: float) -> Start:
    """The base with the currents and loads that heating brings."""
    heat, conductor = found.heat, found.conductor
    assert conductor is not None
    drive = heat.inputs
    driven = [c for c, v in enumerate(conductor.voltages) if v.any()]
    knots = drive.knots(end)
    few = knots[np.unique(np.linspace(0, len(knots) - 1, 4).astype(int))] if len(knots) else knots
    times = np.unique(np.concatenate([np.geomspace(end / 100, end, 4), few * (1 - 1e-9)]))
    for turn in range(ROUNDS):
        answer = found.march(found.project(found.krylov(shift).fields(GENERATIONS)), end, ROUGH)
        states, g = answer.trajectory(times)[0], drive.at(times)
        rises, c = answer.rises(times), answer.reduced.currents(states, g)
        worst, size, hottest = 0.0, 1e-300, None
        for i, rise in enumerate(rises):
            if not (g[i] @ conductor.voltages).any():
                continue
            hot = [conductor.solve(rise, conductor.voltages[k]) for k in driven]
            true: np.ndarray = sum(f * h.density for f, h in zip(g[i][driven], hot, strict=True))  # type: ignore[assignment]
            load = pattern.joule_load(conductor, true, true, rise)
            reached = pattern.combined(found.patterns, c[i])
            change = float(np.abs(load - pattern.joule_load(conductor, reached, reached, rise)).sum())
            size = max(size, float(np.abs(load).sum()))
            if change >= worst:
                worst, hottest = change, (hot, load)
        if hottest is None or (turn > 0 and worst < SAME * accuracy * size):
            break
        potentials = [*potentials, *hottest[0]]
        more = worst >= SAME * accuracy * size
        used = pattern.independent(conductor, potentials) if more else found.patterns
        found = replace(found, patterns=used, loads=[*found.loads, hottest[1]])
    return found
