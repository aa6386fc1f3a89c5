"""The device as two lumped elements between two conducting layers, its modes, and the steady state of its controllers.

Sink (eq 20) and sensor (eq 8) are each one temperature; insulator and polymer (eq 3) are slabs of the beam's area:

    C_sink   dT_sink/dt   = -q_insulator - G_sink (T_sink - T_room) + V_sink^2/R_sink(T_sink)
    C_sensor dT_sensor/dt = +q_insulator - q_polymer                + V_sensor^2/R_sensor(T_sensor)

Every array over the elements has the order (sink, sensor); temperatures are rises above room temperature, in K. All is
discretized together: the rise is u = w T_ext + v, with w the steady distribution of a unit outer temperature (exact:
straight lines), and v zero on the outer face. With v = sum_i b_i phi_i, where K phi = lambda M phi,

    db/dt = -lambda b + phi_sink P_sink + phi_sensor P_sensor,      b jumps by -jump dT_ext with the outer temperature.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy.linalg

from reduced1d.equations import (
    air_conductance,
    anchor_flow,
    anchor_series_resistance,
    gap_conductance,
    resistance,
    room_resistivity,
)
from reduced1d.ladder.few_states import modes as modes_of
from reduced1d.numerics import Elements
from scenes.device import Device, External
from statespace import stability as loop
from statespace.device_model import Inlet, Modal
from statespace.result import Steady
from statespace.stability import Plant, Shielding, Stability

DEGREE = 9
"""Degree of the layers' elements in questions about a steady state: stable gains are 7e-8 off those by degree 13."""


@dataclass(frozen=True)
class Slab:
    """A conducting layer: thickness in m, area in m2, conductivity in W/(m K), heat capacity in J/(m3 K)."""

    thickness: float
    area: float
    conductivity: float
    heat_capacity: float

    @property
    def conductance(self) -> float:
        return self.conductivity * self.area / self.thickness

    @property
    def diffusivity(self) -> float:
        """The paper's alpha = k/(rho C_p) in m2/s."""
        return self.conductivity / self.heat_capacity


@dataclass(frozen=True, eq=False)
class Lumped:
    """Sink and sensor, insulator and polymer of one device, and the rise that the controllers are set to (K).

    Of (sink, sensor), thermally thin heated films, (2,) each: ``capacity`` in J/K; R of eq 7 at room temperature,
    ``resistance`` in ohm, and its relative change per kelvin, ``coefficient``. ``conductance`` (W/K) is the sink's to
    room temperature, of which ``to_air`` goes to the air and the rest to the substrate.
    """

    capacity: np.ndarray
    conductance: float
    to_air: float
    resistance: np.ndarray
    coefficient: np.ndarray
    insulator: Slab
    polymer: Slab
    set_rise: float

    def power(self, voltage: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """Electrical power V^2/R(T) of (sink, sensor) in W; last axis of both arguments the elements (eqs 6, 7)."""
        return voltage**2 / (self.resistance * (1 + self.coefficient * rise))


def lump(device: Device) -> Lumped:
    """Capacities, conductances and resistances of a device; the sink has the constants of eqs 19 and 20."""
    sink, gold, area, pdms = device.sink, device.gold, device.contact_area, device.pdms
    L, A_c, air = sink.length, sink.cross_section, air_conductance(sink)
    anchors = anchor_flow(1.0, anchor_series_resistance(sink), sink.silicon.thermal_conductivity, A_c, L)
    films = ((sink.silicon, A_c), (gold, sink.width * device.sensor_thickness))
    laws = [room_resistivity(material, sink.room_temperature) for material, _ in films]
    return Lumped(
        np.array([material.heat_capacity * section * L for material, section in films]),
        anchors + air + gap_conductance(sink), air,
        np.array([resistance(0.0, *law, L, section) for law, (_, section) in zip(laws, films, strict=True)]),
        np.array([change for _, change in laws]),
        Slab(device.insulator_thickness, area, pdms.thermal_conductivity, pdms.heat_capacity),
        Slab(device.polymer_thickness, area, pdms.thermal_conductivity, pdms.heat_capacity),
        device.set_rise,
    )  # fmt: skip


def steady(device: Device, external: float | None = None) -> Steady:
    """The steady state at an outer temperature ``external`` (K; by default the final one).

    An element with power sits at the set temperature; then sink and sensor exchange nothing and the sensor's power is
    k A/t (T_set - T_external) of the polymer, whatever R(T) is. Where that asks for a negative power, the power is
    zero and the element's temperature follows from its neighbours. A gain of zero leaves an element without power.
    """
    return loop.steady(_modal(device), device, external)


def around(device: Device) -> dict[str, Steady]:
    """The steady states ``before`` the outer step and ``after`` it."""
    return {"before": steady(device, device.external.initial_temperature), "after": steady(device)}


def modes(lumped: Lumped, degree: int) -> Modal:
    """Modes of the device with one element in the insulator and three in the polymer, of a degree of at least 2;
    without local departures, and with one flow, that from the sensor into the polymer."""
    slabs = [lumped.insulator, *[lumped.polymer] * 3]
    heights = np.cumsum([0.0, *(s.thickness * part for s, part in zip(slabs, (1.0, 0.1, 0.4, 0.5), strict=True))])
    e, films, outer = Elements([heights], degree), np.array([0, 1]), 4
    capacity = np.array([slab.heat_capacity * slab.area for slab in slabs])
    conductivity = np.array([slab.conductivity * slab.area for slab in slabs])
    mass, stiffness = e.mass(capacity).toarray(), e.stiffness(conductivity).toarray()
    unit_step = _step(mass, e.dofs[:, -1], degree)
    mass[films, films] += lumped.capacity
    stiffness[0, 0] += lumped.conductance
    free = np.delete(np.arange(e.size), outer)
    K = stiffness[np.ix_(free, free)]
    w = np.eye(1, e.size, outer)[0]
    w[free] = -scipy.linalg.solve(K, stiffness[free, outer], assume_a="pos")
    below = np.zeros(e.size)
    down = lumped.conductance - lumped.to_air
    below[free] = scipy.linalg.solve(K, down * np.eye(e.size)[0][free], assume_a="pos")
    rates, phi = modes_of(mass[np.ix_(free, free)], K)
    into_polymer = -conductivity[-1] * e.at([0], heights[[1]])[1].toarray()[0]
    return Modal(
        rates, phi[films], np.array([0, 1]), lumped.resistance, lumped.coefficient, w[films],
        phi.T @ (mass[np.ix_(free, free)] @ (w - unit_step)[free]),
        (into_polymer[free] @ phi)[None], np.array([into_polymer @ w]), np.zeros((1, 2)),
        Inlet(
            below[films], phi.T @ (mass[np.ix_(free, free)] @ below[free]), np.array([into_polymer @ below]),
            down * (1 - float(below[0])),
        ),
    )  # fmt: skip


def _step(mass: np.ndarray, last: np.ndarray, degree: int) -> np.ndarray:
    """(n,): a unit step of the outer face's temperature an instant later: zero outside the ``last`` element's functions
    and, in it, orthogonal to all polynomials of a degree less that vanish at that face, so that the rest of the stack
    sees nothing yet. An L2 projection of the step would ring through it at once."""
    tests, inner, unit_step = last[np.r_[0, 2:degree]], last[2:], np.zeros(len(mass))
    unit_step[last[1]] = 1.0
    unit_step[inner] = -np.linalg.solve(mass[np.ix_(tests, inner)], mass[tests, last[1]])
    return unit_step


@lru_cache(maxsize=8)
def _modal(device: Device, degree: int = DEGREE) -> Modal:
    return modes(lump(device), degree)


def plant(device: Device, external: float | None = None) -> Plant:
    """Linearise a device about its steady state at an outer temperature (K; by default the final one)."""
    return loop.plant(_modal(device), device, external)


def stability(device: Device, external: float | None = None) -> Stability:
    """Stability of a device's controllers about the steady state at an outer temperature (K)."""
    outer = device.external.final_temperature if external is None else external
    # Neither what is outside at other times nor for how long matters, so that many runs share one answer.
    return _about(replace(device, external=External(outer, outer), end_time=1.0))


@lru_cache(maxsize=64)
def _about(device: Device) -> Stability:
    return loop.assess(plant(device), device)


def largest_eigenvalue(device: Device, external: float | None = None) -> complex:
    """The eigenvalue of ``stability`` alone, which takes a fraction of the time."""
    return plant(device, external).eigenvalue(loop.gains(device))


def at_sample_time(device: Device, sample_time: float) -> Device:
    return replace(device, control=replace(device.control, sample_time=sample_time))


@lru_cache(maxsize=8)
def shielding(device: Device) -> Shielding:
    """Change of both powers per kelvin of the substrate below a device."""
    return loop.shielding(_modal(device, 12), device)
