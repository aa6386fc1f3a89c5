"""What potential probes read: in parts that carry current the solution, in others the voltage of their electrodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d.results import probes
from fem3d.solution.transient import Base
from fem3d.spaces import channels
from fem3d.spaces.domain import Domain


class Voltmeter:
    """One probe on one mesh: what it reads is ``inside`` (cells,), where ``still`` functions have a voltage each."""

    def __init__(self, domain: Domain, probe: Any) -> None:
        self._domain = domain = domain.electric
        self.inside = inside = np.any([domain.live, *(part for part, _ in domain.still)], axis=0)
        self.still = []
        for cells, voltage in domain.still:
            if isinstance(voltage, str):  # the potential that is solved for knows it
                continue
            self.still.append((np.where(domain.space.of(cells), domain.space.unit, 0.0), voltage))
        self._row = domain.mean(probe, inside) if probe.reduce == "mean" else None
        self._extreme = None if probe.reduce == "mean" else probes.extreme(domain, probe, inside)

    def read(self, potential: np.ndarray | None, time: float) -> float:
        """The probe's value (V) for a potential (functions,) at a time (s)."""
        field = self.field(potential, time)
        if self._row is not None:
            return self.mean(field)
        assert self._extreme is not None
        return float(self._extreme(field[None], np.ones((1, 1)))[0][0])

    def mean(self, field: np.ndarray) -> float:
        """The mean (V) over a probe of a mean of a potential (functions,)."""
        assert self._row is not None
        return float(self._row @ field)

    def field(self, potential: np.ndarray | None, time: float) -> np.ndarray:
        """(functions,): the potential in parts that carry current and in those that don't."""
        field = np.zeros(self._domain.space.size) if potential is None else potential.copy()
        for functions, voltage in self.still:
            field = np.where(functions > 0, functions * channels.value(voltage, np.array([time]))[0], field)
        return field


def over_time(base: Base, rises: Callable[[], np.ndarray], probe: Any, times: np.ndarray) -> np.ndarray:
    """(times,): the potential (V) of a probe that the reduced problem knows nothing of, an extreme or in parts without
    current; the electric problem is solved at each time where it depends on it, at ``rises`` (times, all nodes)."""
    conductor, heat, g = base.conductor, base.heat, base.heat.inputs.at(times)
    meter = Voltmeter(heat.domain, probe)
    if conductor is None:
        return np.array([meter.read(None, float(t)) for t in times])
    if not conductor.warms:
        cold = np.zeros(heat.size)
        fields = np.stack([conductor.solve(cold, v).potential for v in conductor.voltages])
        return np.array([meter.read(x @ fields, float(t)) for x, t in zip(g, times, strict=True)])
    readings, guess = [], None
    for rise, voltage, time in zip(rises(), g @ conductor.voltages, times, strict=True):
        guess = conductor.solve(rise, voltage, guess).potential
        readings.append(meter.read(guess, float(time)))
    return np.array(readings)
