"""The resistivity of a material over temperature."""

from __future__ import annotations

from scenes.model import Material


def law(material: Material, initial: float) -> tuple[float, float]:
    """The resistivity at the initial temperature (ohm m) and its change per kelvin (ohm m/K), eq 7; ValueError for a
    material that doesn't conduct."""
    if material.resistivity is None:
        raise ValueError(f"{material.name} doesn't conduct")
    a = material.temperature_coefficient
    return material.resistivity * (1 + a * (initial - material.reference_temperature)), material.resistivity * a
