"""The device as two lumped elements between two conducting layers: capacities, conductances and resistances, and the
steady state that the controllers bring it to, in closed form.

Sink (eq 20) and sensor (eq 8) are each one temperature; insulator and polymer (eq 3) are slabs of the beam's area.
Heat that leaves the sink through the insulator enters the sensor:

    C_sink   dT_sink/dt   = -q_insulator - G_sink (T_sink - T_room) + V_sink^2/R_sink(T_sink)
    C_sensor dT_sensor/dt = +q_insulator - q_polymer                + V_sensor^2/R_sensor(T_sensor)

Every array over the elements has the order (sink, sensor); temperatures are rises above room temperature, in K.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reduced1d.equations import resistance, room_resistivity
from reduced1d.sink import lump as lump_sink
from scenes.device import Device
from scenes.loop.result import Steady
from scenes.loop.stability import complementary


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
    room temperature.
    """

    capacity: np.ndarray
    conductance: float
    resistance: np.ndarray
    coefficient: np.ndarray
    insulator: Slab
    polymer: Slab
    set_rise: float

    def power(self, voltage: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """Electrical power V^2/R(T) of (sink, sensor) in W; last axis of both arguments the elements (eqs 6, 7)."""
        return voltage**2 / (self.resistance * (1 + self.coefficient * rise))


def lump(device: Device) -> Lumped:
    """Capacities, conductances and resistances of a device; the sink's are those of eq 20, of ``reduced1d.sink``."""
    sink, gold, area, pdms = device.sink, device.gold, device.contact_area, device.pdms
    alone = lump_sink(sink)
    resistivity, change = room_resistivity(gold, sink.room_temperature)
    section = sink.width * device.sensor_thickness
    film = resistance(0.0, resistivity, change, sink.length, section)
    return Lumped(
        np.array([alone.capacity, gold.heat_capacity * section * sink.length]), alone.conductance,
        np.array([alone.resistance, film]), np.array([alone.coefficient, change]),
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
    lumped, room = lump(device), device.sink.room_temperature
    outer = (device.external.final_temperature if external is None else external) - room
    sink, between, polymer = lumped.conductance, lumped.insulator.conductance, lumped.polymer.conductance
    K = np.array([[sink + between, -between], [-between, between + polymer]])
    load = np.array([0.0, polymer * outer])
    gains = np.array([device.control.sink_gain, device.control.sensor_gain])
    rise, power, held = complementary(K, load, lumped.set_rise, gains > 0)
    volts = np.sqrt(power * lumped.resistance * (1 + lumped.coefficient * rise))
    saturated = (gains > 0) & ~held
    return Steady(
        float(room + rise[0]), float(room + rise[1]), float(volts[0]), float(volts[1]), float(power[0]),
        float(power[1]), float(polymer * (rise[1] - outer)), bool(saturated[0]), bool(saturated[1]),
    )  # fmt: skip


def around(device: Device) -> dict[str, Steady]:
    """The steady states ``before`` the outer step and ``after`` it."""
    return {"before": steady(device, device.external.initial_temperature), "after": steady(device)}
