"""What potential probes read: in parts that carry current the solution, in others the voltage of their electrodes."""

from __future__ import annotations

import numpy as np

from fem3d import inputs
from fem3d.conductor import Conductor
from fem3d.operators import HeatProblem
from fem3d.probes import Extreme
from fem3d.transient import Transient
from fem3d.weights import mean_row
from meshes import connected
from meshes.bricks import VOID, bricks_of
from scenes.model import Probe

LOOSE = 1e-6  # accuracy, in the energy norm, of the potential at the many instants of a trace


class Voltmeter:
    """One probe on one mesh."""

    def __init__(self, heat: HeatProblem, conductor: Conductor | None, probe: Probe) -> None:
        mesh, scene = heat.mesh, heat.scene
        self._conductor, self._size = conductor, int(np.prod(mesh.shape))
        blocks = [] if conductor is None else list(conductor.blocks)
        self._still = []
        for cells, voltage in connected.still(scene):
            own = tuple(bricks_of(np.where(connected.refined(scene, mesh, cells), mesh.owner, VOID)))
            self._still.append((np.flatnonzero(mesh.nodes_of(own)), voltage))
            blocks += own
        self._row = self._extreme = None
        if probe.reduce == "mean":
            self._row = mean_row(heat, probe, np.arange(self._size), self._size)
        else:
            self._extreme = Extreme(heat, probe, tuple(blocks), [mesh.numbers(b) for b in blocks])

    def read(self, potential: np.ndarray | None, time: float) -> float:
        """The probe's value (V) for a potential (all nodes of the conductor) at a time (s)."""
        grid = np.zeros(self._size)
        for nodes, voltage in self._still:
            grid[nodes] = inputs.value(voltage, np.array([time]))[0]
        if self._conductor is not None and potential is not None:
            live = self._conductor.number >= 0
            grid[live] = potential[self._conductor.number[live]]
        if self._row is not None:
            return float(self._row @ grid)
        assert self._extreme is not None
        return self._extreme.of(self._extreme.sampled(grid[:, None]), np.ones(1))


def over_time(transient: Transient, probe: Probe, times: np.ndarray) -> np.ndarray:
    """(times,): the potential (V) of a probe that the reduced problem knows nothing of, an extreme or in parts without
    current; the electric problem is solved at each time where it depends on it."""
    base = transient.base
    conductor, heat, g = base.conductor, base.heat, base.heat.inputs.at(times)
    meter = Voltmeter(heat, conductor, probe)
    if conductor is None:
        return np.array([meter.read(None, float(t)) for t in times])
    if not conductor.warms:
        cold = np.zeros(heat.size)
        fields = np.stack([conductor.solve(cold, v).potential for v in conductor.voltages])
        return np.array([meter.read(x @ fields, float(t)) for x, t in zip(g, times, strict=True)])
    found, guess = [], None
    for rise, voltage, time in zip(transient.rises(times), g @ conductor.voltages, times, strict=True):
        guess = conductor.solve(rise, voltage, guess, LOOSE).potential
        found.append(meter.read(guess, float(time)))
    return np.array(found)
