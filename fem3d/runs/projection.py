"""The fields of a compact model, and a reduced problem as the matrices of `statespace.runtime`.

The matrices are affine maps of z = (1, inputs, states).

With given temperatures the reduced states a obey da/dt = -K a + ... - I dg/dt, I being the inertia of their lifts; the
states here are b = a + I g, so that no input is differentiated, except in the heat flow of a boundary whose
temperature changes.

The fields of a compact model are rational Krylov fields of all loads. A field (M + g K)^-1 F for every load F, at g =
infinity (the steady response) and at shifts g between the earliest time and the slowest response, which are added where
the residual is large. Source: Ruhe, Linear Algebra Appl. 58, 1984; Antoulas, Approximation of Large-Scale Dynamical
Systems, 2005, chapter 11.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.probes import Voltmeter, reading
from fem3d.solution.reduced import Reduced, orthonormal
from fem3d.solution.transient import Base
from meshes.symmetry import Symmetry
from statespace.channels import Channel
from statespace.document import Matrices, Port

FIRST, MOST = 4, 16  # how many shifts to begin with, and at most
SOONER = 3.0  # the first shift of the Krylov fields is the earliest time over this


def slowest(heat: HeatProblem) -> float:
    """Return the relaxation time (s) of a uniformly heated structure."""
    n = heat.free
    load = (heat.mass @ heat.unit)[:n]
    return float(heat.unit[:n] @ (heat.inner_mass @ heat.solve_steady(load)) / max(heat.unit[:n] @ load, 1e-300))


def jumps_of(heat: HeatProblem, steps: np.ndarray) -> list[np.ndarray]:
    """Return the heat (J, all nodes) that a step of each given temperature, of size ``steps`` (channels,), takes at
    once; as a state, it decays from then on."""
    return [s * (heat.mass @ lift) for s, lift in zip(steps[1:], heat.lifts[1:], strict=True) if lift.any()]


def loads_of(base: Base, steps: np.ndarray) -> list[np.ndarray]:
    """Return the loads (W, all nodes) of a model, scaled by the inputs' steps (channels,): the load of every channel,
    the Joule heat of every pair of current fields, and its change by temperature."""
    heat, conductor = base.heat, base.conductor
    loads = [s * v for s, v in zip(steps[1:], heat.loads[1:], strict=True) if v.any()]
    if not heat.anchored:
        loads += [s * (heat.stiffness @ v) for s, v in zip(steps[1:], heat.lifts[1:], strict=True) if v.any()]
    if conductor is not None:
        loads += _joule(heat, conductor, base, steps)
    return loads


def _joule(heat: HeatProblem, conductor: Conductor, base: Base, steps: np.ndarray) -> list[np.ndarray]:
    n, none = heat.free, np.zeros(heat.size)
    driven = [c for c, v in enumerate(conductor.voltages) if c and v.any()]
    size = max((float(steps[c]) for c in driven), default=0.0) ** 2
    lifts = [s * lift for s, lift in zip(steps[1:], heat.lifts[1:], strict=True) if lift.any()]
    loads = []
    for i, a in enumerate(base.patterns):
        for b in base.patterns[: i + 1]:
            cold = size * conductor.joule_load(a.density, none, b.density)
            loads.append(cold)
            if conductor.warms:
                warmed = [heat.whole(heat.solve_steady(cold[:n])), *lifts]
                loads += [size * conductor.joule_load(a.density, u, b.density) - cold for u in warmed]
    return [load for load in loads if load.any()]


def rational(heat: HeatProblem, loads: list[np.ndarray], times: tuple[float, float] | None, enough: float) -> Any:
    """(free nodes, fields): the fields of some loads for times (s) from the earliest to the slowest, or of the steady
    state alone, until the residual at any shift between is below ``enough`` of its load."""
    n = heat.free
    each = [load[:n] for load in loads]
    fields = [heat.solve_steady(load) for load in each]
    if times is None or not each:
        return np.column_stack(fields) if fields else np.empty((n, 0))
    shifts = np.geomspace(times[0] / SOONER, max(times), FIRST).tolist()
    missing = shifts
    while True:
        for shift in missing:
            solve = heat.solve_shifted(shift)
            fields += [solve(load) for load in each]
        basis = orthonormal(heat, np.column_stack(fields))
        between = [float(np.sqrt(a * b)) for a, b in pairwise(shifts)]
        missing = [g for g in between if _residual(heat, basis, each, g) > enough]
        if not missing or len(shifts) >= MOST:
            return basis
        shifts = sorted([*shifts, *missing])


def _residual(heat: HeatProblem, basis: np.ndarray, loads: list[np.ndarray], shift: float) -> float:
    """Estimate the largest relative error of (M + g K) u = F in the fields, in the energy norm. The diagonal of
    the matrix suffices: the residual is orthogonal to the fields, hence rough."""
    mass, stiffness = heat.inner_mass, heat.inner_stiffness
    product = mass @ basis + shift * (stiffness @ basis)
    weight = 1 / (mass.diagonal() + shift * stiffness.diagonal())
    F = np.column_stack(loads)
    tested = basis.T @ F
    solution = np.linalg.solve(basis.T @ product, tested)
    residual = F - product @ solution
    return float(np.sqrt(((weight[:, None] * residual**2).sum(axis=0) / (tested * solution).sum(axis=0)).max()))


def responses(
    reduced: Reduced, loads: list[np.ndarray], jumps: list[np.ndarray], times: tuple[float, float] | None
) -> np.ndarray:
    """(states, any): the reduced responses to loads, at rest and over time, and to jumps."""
    n = len(reduced.basis)
    rates, modes = np.linalg.eigh((reduced.stiffness + reduced.stiffness.T) / 2)
    rates = np.maximum(rates, 1e-12 * rates[-1])

    def inner(vectors: list[np.ndarray]) -> np.ndarray:
        kept = np.column_stack([v[:n] for v in vectors]) if vectors else np.empty((n, 0))
        product: np.ndarray = modes.T @ (reduced.basis.T @ kept)
        return product

    heating, decaying = inner(loads), inner(jumps)
    responses = [heating / rates[:, None]]
    for g in [] if times is None else np.geomspace(times[0] / SOONER, max(times), 12):
        responses += [g * heating / (1 + g * rates)[:, None], decaying / (1 + g * rates)[:, None]]
    return np.asarray(modes @ np.column_stack(responses))


@dataclass(frozen=True, eq=False)
class Structure:
    """The parts of a model: the problem of the solved part, with its current fields, the scene's inputs, whether it
    has capacities, and for each probe of an extreme the rows (places, all nodes) of its possible places."""

    base: Base
    part: Symmetry
    channels: tuple[Channel, ...]
    steady: bool
    places: dict[str, np.ndarray]

    @property
    def heat(self) -> HeatProblem:
        """The heat problem."""
        return self.base.heat


@dataclass(frozen=True, eq=False)
class Projection(Matrices):
    """The matrices of a model on its fields.

    Attributes
    ----------
    basis : (free nodes, n) array
        Fields of the states.
    offset : (inputs + 1, n) array
        States that belong to given temperatures: the fields have the coefficients b - z offset.
    """

    basis: np.ndarray
    offset: np.ndarray

    def rise(self, heat: HeatProblem, g: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(all nodes,): the rise at inputs and states."""
        given = np.concatenate([[1.0], g])
        rise: np.ndarray = heat.whole(self.basis @ (b - given @ self.offset)) + given @ heat.lifts
        return rise


def project(structure: Structure, reduced: Reduced) -> Projection:
    """Write a reduced problem as matrices, in its modes, each in units of its largest effect on the outputs."""
    return _Maker(structure, reduced).made()


class _Maker:
    def __init__(self, structure: Structure, reduced: Reduced) -> None:
        self.structure, self.heat = structure, structure.heat
        rates, modes = np.linalg.eigh((reduced.stiffness + reduced.stiffness.T) / 2)
        self.modal = reduced.changed(modes)
        self.rates = np.maximum(rates, 0.0)
        self.count = 1 + (self.heat.inputs.count - 1)
        self.n, self.m = reduced.states, reduced.supply.shape[1]
        self.inertia = np.zeros_like(self.modal.inertia) if structure.steady else self.modal.inertia
        self.i, self.j = np.triu_indices(self.m)
        self.rows: list[tuple[np.ndarray, ...]] = []
        self.F = np.concatenate([self.modal.source.T + (self.inertia * self.rates).T, -np.diag(self.rates)], axis=1)
        self.Q = self._tested(self.modal.cold_load, self.modal.warm_load)

    def _tested(self, cold: np.ndarray, warm: np.ndarray) -> np.ndarray:
        """(pairs, ..., z): a Joule heat of pairs of current fields, cold (channels, m, m, ...), warm (m, m, ..., n)."""
        by_states = warm[self.i, self.j]
        given = np.moveaxis(cold[:, self.i, self.j], 0, -1) - by_states @ self.inertia.T
        return np.concatenate([given, by_states], axis=-1)

    def along(self, row: np.ndarray, rates: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """(z,) and (inputs + 1,): how a row (all nodes) of the rise follows z, and inputs' rates; or of its rate."""
        states_row = row[: self.heat.free] @ self.modal.basis
        lifted = self.heat.lifts @ row - self.inertia @ states_row
        if rates:
            return states_row @ self.F, lifted
        return np.concatenate([lifted, states_row]), np.zeros_like(lifted)

    def made(self) -> Projection:
        heat, modal = self.heat, self.modal
        outputs = {}
        for probe in heat.domain.scene.probes:
            first = len(self.rows)
            how = "mean"
            factor, _ = self.structure.part.probes[probe.name]
            rows = self._probe(probe)
            if probe.name in self.structure.places:
                how = probe.reduce
            self.rows += [tuple(factor * part for part in row) for row in rows]
            outputs[probe.name] = (list(range(first, len(self.rows))), how)
        ports = [self._port(number, channel) for number, channel in enumerate(self.structure.channels, 1)]
        Y, W, U, P = (np.array([row[k] for row in self.rows]) for k in range(4))
        for probe in heat.domain.scene.probes:
            if probe.quantity == "temperature":
                Y[outputs[probe.name][0], 0] += heat.domain.scene.initial_temperature
        Y[[port.row for port in ports if port.unit == "K"], 0] += heat.domain.scene.initial_temperature
        A = np.concatenate([np.moveaxis(modal.cold, 0, -1) - modal.warm @ self.inertia.T, modal.warm], axis=-1)
        S = np.concatenate([modal.supply.T, np.zeros((self.m, self.n))], axis=1)
        matrices = {"A": A, "S": S, "F": self.F, "Q": self.Q, "Y": Y, "W": W[:, 1:],
                    "U": np.moveaxis(U, 0, 1), "P": np.moveaxis(P, 0, 1)}  # fmt: skip
        return self._scaled(Projection(matrices, outputs, ports, modal.basis, self.inertia))

    def _scaled(self, unscaled: Projection) -> Projection:
        """Scale each state to its largest effect on the probes of temperature, or to the mean of the part."""
        states = slice(self.count, None)
        thermal = [r for p in self.heat.domain.scene.probes if p.quantity == "temperature"
                   for r in unscaled.outputs[p.name][0]]  # fmt: skip
        size = np.abs(unscaled.matrices["Y"][thermal, states]).max(axis=0, initial=0.0)
        everywhere = 1 / np.sqrt(self.heat.unit @ (self.heat.mass @ self.heat.unit))
        unit = np.maximum(size, 0.1 * everywhere)
        m = {name: matrix.copy() for name, matrix in unscaled.matrices.items()}
        for name in "ASFQYUP":
            m[name][..., states] /= unit
        m["F"] *= unit[:, None]
        m["Q"] *= unit[:, None]
        return Projection(m, unscaled.outputs, unscaled.ports, unscaled.basis / unit, unscaled.offset * unit)

    def _probe(self, probe: Any) -> list[tuple[np.ndarray, ...]]:
        """The rows of a probe in Y, W, U and P."""
        nothing = np.zeros((self.m, self.count + self.n))
        no_pairs, no_rates = np.zeros((len(self.i), self.count + self.n)), np.zeros(self.count)
        if probe.name in self.structure.places:
            return [(*self.along(row), nothing, no_pairs) for row in self.structure.places[probe.name]]
        if probe.quantity == "potential" and probe.name not in self.modal.potentials:
            # No current passes: it is the voltage of the electrodes that its conductors touch.
            meter = Voltmeter(self.heat.domain, probe)
            value = np.zeros(self.count + self.n)
            value[: self.count] = sum(
                meter.mean(unit) * self.heat.inputs.split(voltage) for unit, voltage in meter.still
            )
            return [(value, no_rates, nothing, no_pairs)]
        if probe.quantity == "potential":
            shares, cold, warm = self.modal.potentials[probe.name]
            taken = np.concatenate([cold.T - warm @ self.inertia.T, warm], axis=1)
            return [(np.concatenate([shares, np.zeros(self.n)]), no_rates, -taken, no_pairs)]
        how = reading(self.heat, probe)
        if probe.quantity == "current":
            names = how.boundaries or (f"through:{probe.name}",)
            each = nothing.copy()
            each[:, 0] = [how.sign * sum(p.currents.get(name, 0.0) for name in names)
                          for p in self.structure.base.patterns]  # fmt: skip
            return [(np.zeros(self.count + self.n), no_rates, each, no_pairs)]
        value, moving = self.along(how.row)
        value[: self.count] += how.entering
        pairs = no_pairs
        for name in how.boundaries:
            flow, rate, joule = self._held(name)
            value, moving, pairs = value + flow, moving + rate, pairs + joule
        return [(value, moving, nothing, pairs)]

    def _port(self, number: int, channel: Channel) -> Port:
        """The port of an input, whose row is added to the others."""
        heat, part, first = self.heat, self.structure.part, len(self.rows)
        nothing = np.zeros((self.m, self.count + self.n)), np.zeros((len(self.i), self.count + self.n))
        if channel.kind in ("heat_flux", "heat_source"):
            load = heat.loads[number]
            power = float(load @ heat.unit)
            self.rows.append((*self.along(load / power), *nothing))
            source = channel.kind == "heat_source"
            times = part.box_copies.get(channel.item, 1.0) if source else part.flows[channel.item].heat
            return Port(first, "K", times * power)
        flow = part.flows[channel.item]
        if channel.kind == "voltage":
            each = nothing[0].copy()
            each[:, 0] = [flow.current * p.currents.get(flow.boundary, 0.0) for p in self.structure.base.patterns]
            self.rows.append((np.zeros(self.count + self.n), np.zeros(self.count), each, nothing[1]))
            return Port(first, "A")
        if channel.kind == "temperature":
            value, moving, pairs = self._held(flow.boundary)
        else:
            film = heat.films[flow.boundary]
            (value, moving), pairs = self.along(film.per_kelvin), nothing[1]
            value[: self.count] += film.entering
        self.rows.append((flow.heat * value, flow.heat * moving, nothing[0], flow.heat * pairs))
        return Port(first, "W")

    def _held(self, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The heat that enters at a boundary of given temperature: per z, per rate of the inputs, per pair."""
        heat = self.heat
        per_rise, per_rate = heat.held_rows[name]
        value, moving = self.along(per_rise)
        pairs = np.zeros((len(self.i), self.count + self.n))
        value[: self.count] -= heat.loads @ heat.held_fields[name]
        if not self.structure.steady:
            follows, moving = self.along(per_rate, rates=True)
            value = value + follows
            pairs += np.tensordot(self.Q, per_rate[: heat.free] @ self.modal.basis, ((1,), (0,)))
        if name in self.modal.at_held:
            pairs -= self._tested(*self.modal.at_held[name])
        return value, moving, pairs
