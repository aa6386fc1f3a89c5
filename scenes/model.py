"""The value types of a scene: what is to be solved, without any numerics.

A *scene* is a union of axis-parallel boxes of materials with conditions on flat boxes (one extent zero), SI units
throughout. Where nothing is said a surface is adiabatic and electrically insulated; of overlapping boxes the later one
wins. The z axis points up, y runs along a beam.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """A material: conductivity in W/(m K), density in kg/m3, specific heat in J/(kg K), resistivity in ohm m.

    The resistivity is ``resistivity * (1 + temperature_coefficient * (T - reference_temperature))`` (the paper's
    eq 7); ``None`` is an electrical insulator.
    """

    name: str
    thermal_conductivity: float
    density: float
    specific_heat: float
    resistivity: float | None = None
    temperature_coefficient: float = 0.0
    reference_temperature: float = 293.0

    @property
    def heat_capacity(self) -> float:
        """Volumetric heat capacity, density times specific heat, in J/(m3 K)."""
        return self.density * self.specific_heat


@dataclass(frozen=True)
class Box:
    """A brick of one material between two corners (m), with an optional volumetric heat source (W/m3)."""

    name: str
    material: Material
    lower: Point
    upper: Point
    heat_source: float = 0.0


@dataclass(frozen=True)
class Boundary:
    """A condition on a flat box (one extent zero), on the surface or, for an electrode, inside the solid.

    ``kind`` and ``value``: "temperature" in K, "heat_flux" in W/m2 into the solid, "convection" the coefficient in
    W/(m2 K) towards ``ambient`` in K, "voltage" in V.
    """

    name: str
    kind: Literal["temperature", "heat_flux", "convection", "voltage"]
    lower: Point
    upper: Point
    value: float
    ambient: float = 293.0


@dataclass(frozen=True)
class Probe:
    """Where a temperature is reported: its mean over the box between two corners, whatever that box's dimension, a
    point, a line, a flat box or a volume. Heat flows and currents are reported for every boundary, without a probe.
    """

    name: str
    lower: Point
    upper: Point


@dataclass(frozen=True)
class Scene:
    """A 3D scene: boxes, conditions, probes, the uniform initial temperature (K), end time (s) and accuracy (-)."""

    name: str
    boxes: tuple[Box, ...]
    boundaries: tuple[Boundary, ...]
    probes: tuple[Probe, ...]
    initial_temperature: float = 293.0
    end_time: float = 0.02
    accuracy: float = 1e-3
