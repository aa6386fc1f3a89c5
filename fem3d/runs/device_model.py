"""The device in 3D as a `statespace.device_model.Modal`: the heat problem projected on a few fields, in its own modes.

Only one of ``copies`` symmetric parts is solved, with modal amplitudes a. Scaled as b = sqrt(copies) a, one vector for
each film both applies the film's power to the modes and reads its mean rise, because heat and resistance are weighted
by the same density rho J^2, at the current densities J of uniform temperature.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fem3d.adaptivity.nested import Problems
from fem3d.problems.conductors import linear_resistivity
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import CurrentField
from fem3d.solution.reduced import Reduced
from fem3d.solution.transient import Base, Krylov, slowest
from scenes.device import SUBSTRATE, Device
from scenes.model import Schedule
from statespace.device_model import FILMS, Inlet, Modal

DEPARTS = 0.1  # of the accuracy, for a film's local departures that are left out: a choice, which errors include


@dataclass(frozen=True, eq=False)
class Structure:
    """The heat problem and the conductor of the solved part of a device; the device has ``copies`` such parts."""

    device: Device
    heat: HeatProblem
    conductor: Conductor
    copies: int

    @cached_property
    def channels(self) -> tuple[int, int]:
        """The channels of the outer and of the substrate's temperature."""
        return self._channel("outside"), self._channel(SUBSTRATE)

    def _channel(self, boundary: str) -> int:
        # The substrate may be behind a contact or a gas: then its temperature is an ambient one.
        named = (b for b in self.heat.domain.scene.boundaries if b.name.startswith(boundary))
        value = next(v for b in named for v in (b.value, b.ambient) if isinstance(v, Schedule))
        return 1 + self.heat.inputs.schedules.index(value)

    @cached_property
    def patterns(self) -> list[CurrentField]:
        """The current fields of either film, by the cold conductor."""
        no_rise, conductor = np.zeros(self.heat.size), self.conductor
        voltages = (conductor.voltages[self._channel(f"{name}-0")] for name in FILMS)
        return [conductor.solve(no_rise, voltage) for voltage in voltages]

    def base(self) -> Base:
        """The base of the fields: responses to either film's power, to the outer and to the substrate's temperature,
        the steady responses exactly, with the local heat at each."""
        heat, conductor, n, patterns = self.heat, self.conductor, self.heat.free, self.patterns
        none = np.zeros(heat.size)
        lifts = [heat.lifts[channel] for channel in self.channels]
        below = heat.loads[self.channels[1]]
        loads = [conductor.joule_load(p.density, none) for p in patterns]
        steady = [heat.solve_steady(load[:n]) for load in loads]
        local = [
            conductor.joule_load(p.density, rise) - load
            for p, load in zip(patterns, loads, strict=True)
            for rise in (*(heat.whole(u) for u in steady), *lifts)
        ]
        if below.any():
            # Through a contact, or a gas in the gap.
            loads, steady = [*loads, below], [*steady, heat.solve_steady(below[:n])]
        fields = [*steady, *(heat.solve_steady(load[:n]) for load in local)]
        return Base(heat, conductor, patterns, np.column_stack(fields), [*loads, *(heat.mass @ lift for lift in lifts)])

    def modal(self, reduced: Reduced, patterns: Sequence[CurrentField], accuracy: float) -> Modal:
        """The model of some fields."""
        rates, modes = np.linalg.eigh((reduced.stiffness + reduced.stiffness.T) / 2)
        modal = reduced.changed(modes)
        device, heat, root = self.device, self.heat, np.sqrt(self.copies)
        channels, inputs = [*self.channels], heat.inputs.count
        resistance, coefficient, shape, covariance = [], [], [], []
        external: list[np.ndarray] = []
        for e, (pattern, material) in enumerate(zip(patterns, (device.sink.silicon, device.gold), strict=True)):
            power = self.conductor.product(pattern.density, pattern.density)
            cold, warm = linear_resistivity(material, heat.domain.scene.initial_temperature)
            a = warm / cold
            heating, by_rise = modal.heating[e, e] / (a * power), modal.resistance[e, e] / (a * power)
            mean, given = by_rise[inputs:], by_rise[channels]
            resistance.append(4 / (self.copies * power))  # 1 V is from an end to the middle
            coefficient.append(a)
            shape.append(mean / root)
            external.append(given)
            local = heating[:, inputs:] - np.outer(mean, mean)
            lifted = heating[:, channels].T - np.outer(given, mean)
            covariance.append((local / self.copies, lifted / root))
        jump = root * modal.inertia[channels]
        film, allowed = [0, 1], DEPARTS * accuracy
        excited = _excited(rates, np.array(shape), jump)
        for e, (local, lifted) in enumerate(covariance):
            departures = _departures(local, excited, np.array(shape[e]), allowed / (coefficient[e] * device.set_rise))
            shape += list(departures)
            external += list(np.linalg.lstsq(departures.T, lifted.T, rcond=None)[0]) if len(departures) else []
            film += [e] * len(departures)
        rows = self.polymer
        per_rise, per_rate = (self.copies / root * (r[:, : heat.free] @ modal.basis) for r in rows)
        inlets = np.array(shape)
        # A temperature acts by convection too, besides where it is given.
        convected = [root * modal.source[channel] / rates for channel in channels]
        outside, below = (
            Inlet(rises + inlets @ added, jumps + added, self.copies * rows[0] @ heat.lifts[channel] + per_rise @ added)
            for rises, jumps, channel, added in zip(np.array(external).T, jump, channels, convected, strict=True)
        )
        warmed = heat.lifts[self.channels[1]] + heat.whole(modal.basis @ (convected[1] / root))
        below = replace(below, taken=float(below.flux[0]) + self.to_air(warmed))
        return Modal(
            rates, inlets, np.array(film), np.array(resistance), np.array(coefficient), outside.external, outside.jump,
            per_rise - per_rate * rates, outside.flux, per_rate @ inlets.T, below,
        )  # fmt: skip

    def to_air(self, rise: np.ndarray) -> float:
        """The heat (W) that leaves through faces other than the substrate's at a rise (all dofs)."""
        to_air = (flow for name, flow in self.heat.face_flows.items() if not name.startswith(SUBSTRATE))
        return -self.copies * float(sum(flow.per_kelvin @ rise for flow in to_air))

    @cached_property
    def polymer(self) -> tuple[np.ndarray, np.ndarray]:
        """(2, all dofs) twice: the heat that enters the polymer from the gold, and that leaves it at its top, per rise
        and per its rate.

        The equations are tested with functions that are one at one face of the polymer and zero at the other, and
        linear between: together with its heat content, the two flows then balance exactly.
        """
        heat, domain, device = self.heat, self.heat.domain, self.device
        cells = np.flatnonzero(domain.body == domain.names.index("polymer"))
        mesh, on = domain.space.mesh, domain.space.on(cells)
        high, test = mesh.p[2, mesh.t[:, cells]], np.zeros(domain.space.size)
        test[domain.space.dofs[:8, cells]] = (high.max() - high) / device.polymer_thickness
        slope = np.zeros((3, *on.weights.shape))
        slope[2] = -device.pdms.thermal_conductivity / device.polymer_thickness
        conducted = heat.take(on.flow(slope))
        below, whole = (heat.take(on.load(device.pdms.heat_capacity * v)) for v in (on.value(test), slope[0] + 1.0))
        return np.array([conducted, conducted]), np.array([below, below - whole])


def structures(device: Device, problems: Problems, copies: int) -> list[Structure]:
    """Return the structures of nested spaces, the finest one first."""
    pairs = zip(problems.heats[::-1], problems.conductors[::-1], strict=True)
    return [Structure(device, heat, conductor, copies) for heat, conductor in pairs if conductor is not None]


def _excited(rates: np.ndarray, shape: np.ndarray, jump: np.ndarray) -> np.ndarray:
    """(n, k): a root of the states' Gramian for both powers and the outer temperatures, each of the size that brings
    its film to a rise of 1 K. (Antoulas, Approximation of Large-Scale Dynamical Systems, 2005, section 4.3.)"""
    per_power = np.einsum("en,en->e", shape / rates, shape)
    inputs = np.vstack([shape / per_power[:, None], jump])
    gramian = (inputs.T @ inputs) / (rates[:, None] + rates)
    values, vectors = np.linalg.eigh(gramian)
    kept = values > 1e-14 * values[-1]
    return vectors[:, kept] * np.sqrt(values[kept])


def _departures(covariance: np.ndarray, excited: np.ndarray, mean: np.ndarray, least: float) -> np.ndarray:
    """(k, n): vectors d with sum d d^T approximately the covariance of a film's local temperatures. The omitted vectors
    are below ``least`` of the mean temperature's size in the excited states."""
    values, vectors = np.linalg.eigh(excited.T @ covariance @ excited)
    size = float(((mean @ excited) ** 2).sum())
    kept = values > least**2 * size
    return (covariance @ excited @ vectors[:, kept] / np.sqrt(values[kept])).T


def projected(structure: Structure, generations: int, accuracy: float) -> tuple[Modal, Modal]:
    """Return the model of a structure in some generations of fields of two shifts, the sample time and the slowest
    response, which take turns; and the model with two generations fewer."""
    base, earliest = structure.base(), structure.device.control.sample_time
    space = Krylov(base, earliest, max(earliest, slowest(structure.heat)))
    reduced = base.project(space.fields(generations))
    kept = reduced.states - min(space.dropped(generations, 2), reduced.states - 1)
    fewer = reduced.changed(np.eye(reduced.states, kept))
    modal, with_fewer = (structure.modal(r, base.patterns, accuracy) for r in (reduced, fewer))
    return modal, with_fewer
