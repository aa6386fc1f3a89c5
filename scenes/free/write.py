"""A scene as a document that reads back equal: SI numbers and plain JSON types."""

from __future__ import annotations

from typing import Any

from scenes.free import asks
from scenes.free.build import UNUSED
from scenes.free.tables import CONDITIONS, HEAT_KEYS, LISTS
from scenes.model import Boundary, Box, Material, Probe, Scene


def as_dict(scene: Scene) -> dict[str, Any]:
    """What a file of the scene would say; what nothing is said about by default is left out."""
    run: dict[str, Any] = {"steady": True} if scene.steady else {"end_time": scene.end_time}
    if scene.output_times and not scene.steady:
        run["output_times"] = list(scene.output_times)
    needed = HEAT_KEYS if asks.capacity(scene) else HEAT_KEYS[:1] if asks.heat(scene) else ()
    materials = {box.material.name: box.material for box in scene.boxes}
    return {
        "scene": {"name": scene.name, "initial_temperature": scene.initial_temperature},
        "material": [_material(m, needed) for m in materials.values()],
        "box": [_box(box) for box in scene.boxes],
        "boundary": [_boundary(b) for b in scene.boundaries],
        "probe": [_probe(p) for p in scene.probes],
        "run": {**run, "accuracy": scene.accuracy},
    }


def _material(material: Material, needed: tuple[str, ...]) -> dict[str, Any]:
    found: dict[str, Any] = {"name": material.name}
    for key in HEAT_KEYS:
        value = getattr(material, key)
        if key in needed or value != UNUSED:
            found[key] = value
    found["resistivity"] = LISTS["material"]["resistivity"].write(material.resistivity)
    if material.resistivity is not None:
        found |= {key: getattr(material, key) for key in ("temperature_coefficient", "reference_temperature")}
    return found


def _box(box: Box) -> dict[str, Any]:
    found = {"name": box.name, "material": box.material.name, "lower": list(box.lower), "upper": list(box.upper)}
    if not asks.is_zero(box.heat_source):
        found["heat_source"] = LISTS["box"]["heat_source"].write(box.heat_source)
    return found


def _boundary(boundary: Boundary) -> dict[str, Any]:
    value: Any = boundary.value
    if boundary.kind == "convection":
        value = (boundary.value, boundary.ambient)
    found = {"name": boundary.name, "lower": list(boundary.lower), "upper": list(boundary.upper)}
    return found | {boundary.kind: CONDITIONS[boundary.kind].write(value)}


def _probe(probe: Probe) -> dict[str, Any]:
    found: dict[str, Any] = {"name": probe.name, "quantity": probe.quantity}
    if probe.lower == probe.upper:
        found["at"] = list(probe.lower)
    else:
        found |= {"lower": list(probe.lower), "upper": list(probe.upper)}
    return found if probe.quantity in ("heat_flow", "current") else found | {"reduce": probe.reduce}
