"""What is read off a solution on a mesh with groups, under the names of `fem3d.outputs`: ``probe:``, ``flow:``,
``current:``, ``power`` and ``generated``."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fem3d.outputs import Outputs, joule
from fem3d.steady import SteadyState
from fem3d.transient import Transient
from fem3d.unstructured.probes import Reading, reading

POTENTIALS = 24  # instants at which potentials are solved; per volt they move as slowly as the temperature


def of_steady(state: SteadyState) -> Outputs:
    """The outputs of a steady state."""
    heat, currents = state.heat, state.currents
    reaction = heat.reaction(state.rise, np.zeros(heat.size), state.source)
    flows = {name: part @ reaction for name, part in heat.held.items()}
    flows |= {name: film.entering[0] + film.per_kelvin @ state.rise for name, film in heat.films.items()}
    found: Outputs = {f"flow:{name}": np.array(v) for name, v in flows.items()}
    found |= {f"current:{name}": np.array(v) for name, v in currents.items() if not name.startswith("through:")}
    for probe in heat.placed.scene.probes:
        read = reading(heat, probe)
        field = state.rise
        if probe.quantity == "potential":
            field = np.zeros(heat.size) if state.conductor is None else state.hot_potential
        if probe.quantity == "current":
            names = read.boundaries or (f"through:{probe.name}",)
            value = sum(currents.get(name, 0.0) for name in names)
        elif read.extreme is not None:
            value = float(read.extreme(field[None], np.ones((1, 1)))[0])
        else:
            value = 0.0 if read.row is None else float(read.row @ field)
            value += sum(float(flows[name]) for name in read.boundaries)
        found[f"probe:{probe.name}"] = np.array(value)
    return found | {"power": np.array(state.power), "generated": np.array(heat.generated[0])}


class Response:
    """A transient with what its outputs need, worked out once."""

    def __init__(self, transient: Transient, like: Response | None = None) -> None:
        """``like`` is a response so near that its potentials serve again."""
        self.base, self.transient = transient.base, transient
        self._instants: list[np.ndarray] = like._instants if like is not None else []
        self._fields: list[np.ndarray] = like._fields if like is not None else []
        self._readings = {p.name: reading(self.base.heat, p) for p in self.base.heat.placed.scene.probes}

    def __call__(self, times: np.ndarray) -> Outputs:
        """The outputs at some times (s)."""
        heat, reduced, drive = self.base.heat, self.transient.reduced, self.base.heat.inputs
        g, changing = drive.at(times), drive.rates(times)
        a, sources = self.transient.trajectory(times)
        rates = sources - a * self.transient.trajectory.rates
        basis, lifts, n = reduced.basis, heat.lifts, heat.free
        c = reduced.currents(a, g) if self.base.patterns else np.zeros((len(times), 0))

        def along(row: np.ndarray, states: np.ndarray, inputs_now: np.ndarray) -> np.ndarray:
            found: np.ndarray = states @ (row[:n] @ basis) + inputs_now @ (lifts @ row)
            return found

        flows: Outputs = {}
        for name, (per_rise, per_rate) in heat.held_rows.items():
            given = g @ (heat.loads @ heat.held_fields[name])
            flows[name] = along(per_rise, a, g) + along(per_rate, rates, changing) - given
            if name in reduced.at_held:
                flows[name] -= joule(reduced.at_held[name], c, a, g)
        for name, film in heat.films.items():
            flows[name] = g @ film.entering + along(film.per_kelvin, a, g)
        names = self.base.patterns[0].currents if self.base.patterns else {}
        currents = {name: c @ np.array([p.currents[name] for p in self.base.patterns]) for name in names}
        found: Outputs = {f"flow:{name}": value for name, value in flows.items()}
        found |= {f"current:{name}": value for name, value in currents.items() if not name.startswith("through:")}
        zero = np.zeros(len(times))
        for probe in heat.placed.scene.probes:
            read = self._readings[probe.name]
            if probe.quantity == "current":
                value = sum((currents.get(name, zero) for name in read.boundaries or (f"through:{probe.name}",)), zero)
            elif probe.quantity == "potential":
                value = self._potential(read, times, g)
            elif read.extreme is not None:
                fields = np.concatenate([heat.whole(basis.T), lifts])
                value = read.extreme(fields, np.concatenate([a, g], axis=1))
            else:
                value = zero if read.row is None else along(read.row, a, g)
                value = sum((flows[name] for name in read.boundaries), value)
            found[f"probe:{probe.name}"] = value
        power = np.einsum("tm,tm->t", c, g @ reduced.supply) if self.base.patterns else zero
        return found | {"power": power, "generated": g @ heat.generated}

    def stored(self, times: np.ndarray) -> np.ndarray:
        """(times,): heat stored above the initial temperature (J)."""
        heat = self.base.heat
        capacity = heat.mass @ np.ones(heat.size)
        a = self.transient.trajectory(times)[0]
        found: np.ndarray = a @ (capacity[: heat.free] @ self.transient.reduced.basis)
        return found + heat.inputs.at(times) @ (heat.lifts @ capacity)

    def _potential(self, read: Reading, times: np.ndarray, g: np.ndarray) -> np.ndarray:
        """What a probe reads is a sum over the channels of their values times a factor that follows the temperature."""
        if self.base.conductor is None:
            return np.zeros(len(times))
        if not self._instants:
            self._solve_potentials()
        instants, fields = self._instants[0], self._fields[0]  # (instants, channels, all nodes)
        after = np.clip(np.searchsorted(instants, times, side="right"), 1, max(len(instants) - 1, 1))
        if len(instants) == 1:
            weights = np.ones((len(times), 1))
        else:
            part = np.clip((times - instants[after - 1]) / (instants[after] - instants[after - 1]), 0, 1)
            weights = np.zeros((len(times), len(instants)))
            weights[np.arange(len(times)), after - 1], weights[np.arange(len(times)), after] = 1 - part, part
        if read.row is not None:
            found: np.ndarray = np.einsum("ti,tc,ic->t", weights, g, fields @ read.row)
            return found
        assert read.extreme is not None
        mixed = (weights[:, :, None] * g[:, None, :]).reshape(len(times), -1)
        return read.extreme(fields.reshape(-1, fields.shape[-1]), mixed)

    def _solve_potentials(self) -> None:
        """Potentials per value of each channel, at instants between which they are as good as linear."""
        conductor, end = self.base.conductor, self.transient.end
        assert conductor is not None
        knots = [0.0, *conductor.heat.inputs.knots(end), end]
        each = max(2, POTENTIALS // (len(knots) - 1))
        inner = [s + (e - s) * np.linspace(0, 1, each + 1)[:-1] ** 2 for s, e in pairwise(knots)]
        instants = np.concatenate([*inner, [end]]) if conductor.warm.any() else np.zeros(1)
        found = np.zeros((len(instants), *conductor.voltages.shape))
        for i, rise in enumerate(self.transient.rises(instants)):
            for channel, v in enumerate(conductor.voltages):
                if v.any():
                    guess = found[i - 1, channel] if i else None
                    found[i, channel] = conductor.solve(rise, v, guess).potential
        self._instants.append(instants)
        self._fields.append(found)


def imbalance(out: Outputs) -> float:
    """|what enters| over what passes, of a steady state."""
    flows = [float(v) for name, v in out.items() if name.startswith("flow:")]
    power, generated = float(out["power"]), float(out["generated"])
    if not flows:
        currents = [float(v) for name, v in out.items() if name.startswith("current:")]
        return abs(sum(currents)) / (sum(map(abs, currents)) / 2) if any(currents) else 0.0
    passing = (sum(map(abs, flows)) + abs(power) + abs(generated)) / 2
    return abs(sum(flows) + power + generated) / passing if passing else 0.0
