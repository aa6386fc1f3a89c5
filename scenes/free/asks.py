"""Which physics a scene asks for: what it says nothing about is not solved, and needs no material data."""

from __future__ import annotations

from scenes.model import Material, Scene, Schedule, Value


def electric(scene: Scene) -> bool:
    """Whether potentials and currents are asked for: there is an electrode, or a probe of them."""
    return any(b.kind == "voltage" for b in scene.boundaries) or any(
        p.quantity in ("potential", "current") for p in scene.probes
    )


def heat(scene: Scene) -> bool:
    """Whether temperatures are asked for.

    That is so where the scene has a thermal condition, a heat source or a thermal probe, and in a transient with
    electrodes where a resistivity follows the temperature. An electric steady state without any of these has its
    resistivities at the initial temperature.
    """
    return (
        any(b.kind != "voltage" for b in scene.boundaries)
        or any(not is_zero(b.heat_source) for b in scene.boxes)
        or any(p.quantity in ("temperature", "heat_flow") for p in scene.probes)
        or (not scene.steady and electric(scene) and any(_varies(b.material) for b in scene.boxes))
        or not electric(scene)
    )


def capacity(scene: Scene) -> bool:
    """Whether density and specific heat matter."""
    return heat(scene) and not scene.steady


def values(value: Value) -> tuple[float, ...]:
    """Every value that a possibly varying one takes at its given times."""
    return value.values if isinstance(value, Schedule) else (value,)


def is_zero(value: Value) -> bool:
    """Whether a possibly varying value is zero throughout."""
    return not any(values(value))


def _varies(material: Material) -> bool:
    return material.resistivity is not None and material.temperature_coefficient != 0
