"""A scene's 3D problem on a few fields as a `statespace.reduction.StateSpace`: its loads, outputs and inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from fem3d.problems.heat import HeatProblem
from fem3d.results.probes import Voltmeter, reading
from fem3d.solution.reduced import Reduced
from fem3d.solution.transient import Base
from meshes.symmetry import Symmetry
from scenes.model import UNITS, AnyProbe
from statespace.channels import Channel
from statespace.reduction import Row, StateSpace


def joule_loads(base: Base) -> list[np.ndarray]:
    """Return the Joule heat (W, all dofs) of every pair of current fields, and its changes by temperature: by the rise
    that it makes, and by each given temperature."""
    heat, conductor, loads, none = base.heat, base.conductor, list[np.ndarray](), np.zeros(base.heat.size)
    if conductor is None:
        return loads
    for a, b in combinations_with_replacement([p.density for p in base.patterns], 2):
        cold = conductor.joule_load(a, none, b)
        loads.append(cold)
        if conductor.warms:
            rises = [heat.whole(heat.solve_steady(cold[: heat.free])), *heat.lifts[1:]]
            loads += [conductor.joule_load(a, rise, b) - cold for rise in rises if rise.any()]
    return loads


@dataclass(frozen=True, eq=False)
class Projection:
    """The problem of the solved part, on some fields.

    Attributes
    ----------
    base, reduced : the problem with its current fields, and its projection
    part : the solved part of the scene
    channels : the scene's inputs
    steady : whether the model is of the steady state
    """

    base: Base
    reduced: Reduced
    part: Symmetry
    channels: tuple[Channel, ...]
    steady: bool

    @property
    def heat(self) -> HeatProblem:
        return self.base.heat

    def rises(self, a: np.ndarray, g: np.ndarray) -> np.ndarray:
        """(times, all dofs): the rises (K) for states (times, n) and inputs (times, inputs)."""
        lifts = self.heat.lifts
        return self.heat.whole(a @ self.reduced.basis.T) + g @ lifts[1:] + lifts[0]

    def state_space(self, places: Mapping[str, np.ndarray]) -> StateSpace:
        """Write the projection as a state space; ``places`` (places, all dofs) read the possible extremes by probe."""
        heat, reduced = self.heat, self.reduced
        fields, channels = reduced.supply.shape[1], heat.inputs.count
        system = {
            "A": reduced.resistance,
            "S": np.concatenate([reduced.supply.T, np.zeros((fields, reduced.states))], axis=1),
            "F": np.concatenate([reduced.source.T, -reduced.stiffness], axis=1),
            "Q": _of_pairs(reduced.heating),
            "I": np.zeros((reduced.states, channels)) if self.steady else reduced.inertia.T,
        }
        outputs = {}
        for probe in heat.domain.scene.probes:
            factor, at = self.part.probes[probe.name][0], places.get(probe.name)
            rows = [self._probe(probe)] if at is None else [self._along(row) for row in at]
            how = "mean" if at is None else probe.reduce
            outputs[probe.name] = [factor * row for row in rows], how, UNITS[probe.quantity]
        ports = [self._port(number, channel) for number, channel in enumerate(self.channels, 1)]
        capacity = float(heat.unit @ (heat.mass @ heat.unit))
        return StateSpace.of_rows(system, outputs, ports, 1 / np.sqrt(capacity))

    def _along(self, row: np.ndarray) -> Row:
        """The value of a row (all dofs) of the rise."""
        return Row(np.concatenate([self.heat.lifts @ row, row[: self.heat.free] @ self.reduced.basis]))

    def _given(self, values: np.ndarray) -> Row:
        """A number for each channel (channels,)."""
        return Row(np.concatenate([values, np.zeros(self.reduced.states)]))

    def _drawn(self, boundaries: Sequence[str]) -> Row:
        """The current at some boundaries."""
        u = np.zeros((len(self.base.patterns), self.heat.inputs.count + self.reduced.states))
        u[:, 0] = [sum(p.currents.get(name, 0.0) for name in boundaries) for p in self.base.patterns]
        return Row(u=u)

    def _probe(self, probe: AnyProbe) -> Row:
        """The row of a probe of no extreme."""
        if probe.quantity == "potential":
            if probe.name in self.reduced.potentials:
                shares, drop = self.reduced.potentials[probe.name]
                return self._given(shares) + Row(u=-drop)
            # No current passes: it is the voltage of the electrodes that its conductors touch.
            meter = Voltmeter(self.heat.domain, probe)
            still = (meter.value(unit) * self.heat.inputs.split(voltage) for unit, voltage in meter.still)
            return self._given(sum(still, np.zeros(self.heat.inputs.count)))
        how = reading(self.heat, probe)
        if probe.quantity == "current":
            return how.sign * self._drawn(how.boundaries or (f"through:{probe.name}",))
        flows = (self._entering(name) for name in how.boundaries)
        return sum(flows, self._along(how.row) + self._given(how.entering))

    def _port(self, number: int, channel: Channel) -> tuple[Row, str, float]:
        """The row of an input, its unit, and the watts of one unit of the input."""
        heat, part = self.heat, self.part
        if channel.kind in ("heat_flux", "heat_source"):
            load = heat.loads[number]
            power = float(load @ heat.unit)
            source = channel.kind == "heat_source"
            times = part.box_copies.get(channel.item, 1.0) if source else part.flows[channel.item].heat
            return self._along(load / power), "K", times * power
        flow = part.flows[channel.item]
        if channel.kind == "voltage":
            return flow.current * self._drawn([flow.boundary]), "A", 1.0
        if channel.kind == "temperature":
            return flow.heat * self._entering(flow.boundary), "W", 1.0
        of_face = heat.face_flows[flow.boundary]
        return flow.heat * (self._along(of_face.per_kelvin) + self._given(of_face.entering)), "W", 1.0

    def _entering(self, name: str) -> Row:
        """The heat that enters at a boundary of given temperature."""
        heat, reduced = self.heat, self.reduced
        per_rise, per_rate = heat.reaction_rows[name]
        row = self._along(per_rise) + self._given(-heat.loads @ heat.shares[name])
        if not self.steady:
            row += Row(w=(heat.lifts @ per_rate)[1:], r=per_rate[: heat.free] @ reduced.basis)
        return row + Row(p=-_of_pairs(reduced.at_given[name])) if name in reduced.at_given else row


def _of_pairs(heat: np.ndarray) -> np.ndarray:
    """(pairs, ...): a Joule heat (m, m, ...) of pairs of current fields."""
    return heat[np.triu_indices(len(heat))]
