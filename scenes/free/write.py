"""A scene as a document that reads back equal, of SI numbers and plain JSON types, and as a TOML file."""

from __future__ import annotations

import json
from typing import Any

from scenes import physics
from scenes.free.build import UNUSED
from scenes.free.tables import CONDITIONS, HEAT_KEYS, HEAT_SOURCE, RESISTIVITY
from scenes.model import AnyScene, Boundary, Box, GroupBoundary, GroupProbe, Material, MeshScene, Probe, Value, is_zero


def as_dict(scene: AnyScene) -> dict[str, Any]:
    """What a file of the scene would say; what nothing is said about by default is left out."""
    run: dict[str, Any] = {"steady": True} if scene.steady else {"end_time": scene.end_time}
    if scene.output_times and not scene.steady:
        run["output_times"] = list(scene.output_times)
    needed = HEAT_KEYS if physics.capacity(scene) else HEAT_KEYS[:1] if physics.heat(scene) else ()
    head = {"scene": {"name": scene.name, "initial_temperature": scene.initial_temperature}}
    tail = {
        "boundary": [_boundary(b) for b in scene.boundaries],
        "probe": [_probe(p) for p in scene.probes],
        "run": {**run, "accuracy": scene.accuracy},
    }
    if isinstance(scene, MeshScene):
        return head | {
            "mesh": {"file": scene.file, "unit": scene.unit},
            "material": [_material(b.material, needed) | {"groups": list(b.groups)} for b in scene.bodies],
            "source": [{"name": s.name, "group": s.group, **_source(s.heat_source)} for s in scene.sources],
        } | tail  # fmt: skip
    materials = {box.material.name: box.material for box in scene.boxes}
    return head | {
        "material": [_material(m, needed) for m in materials.values()],
        "box": [_box(box) for box in scene.boxes],
    } | tail  # fmt: skip


def _material(material: Material, needed: tuple[str, ...]) -> dict[str, Any]:
    found: dict[str, Any] = {"name": material.name}
    for key in HEAT_KEYS:
        value = getattr(material, key)
        if key in needed or value != UNUSED:
            found[key] = value
    found["resistivity"] = RESISTIVITY.write(material.resistivity)
    if material.resistivity is not None:
        found |= {key: getattr(material, key) for key in ("temperature_coefficient", "reference_temperature")}
    return found if material.valid_to is None else found | {"valid_to": material.valid_to}


def _box(box: Box) -> dict[str, Any]:
    found = {"name": box.name, "material": box.material.name, "lower": list(box.lower), "upper": list(box.upper)}
    return found if is_zero(box.heat_source) else found | _source(box.heat_source)


def _source(value: Value) -> dict[str, Any]:
    return {"heat_source": HEAT_SOURCE.write(value)}


def _boundary(boundary: Boundary | GroupBoundary) -> dict[str, Any]:
    value: Any = boundary.value
    if boundary.kind == "convection":
        value = (boundary.value, boundary.ambient)
    found: dict[str, Any] = {"name": boundary.name}
    if isinstance(boundary, GroupBoundary):
        found["group"] = boundary.group
    else:
        found |= {"lower": list(boundary.lower), "upper": list(boundary.upper)}
    return found | {boundary.kind: CONDITIONS[boundary.kind].write(value)}


def _probe(probe: Probe | GroupProbe) -> dict[str, Any]:
    found: dict[str, Any] = {"name": probe.name, "quantity": probe.quantity}
    if isinstance(probe, GroupProbe):
        found |= {"group": probe.group} if probe.at is None else {"at": list(probe.at)}
    elif probe.lower == probe.upper:
        found["at"] = list(probe.lower)
    else:
        found |= {"lower": list(probe.lower), "upper": list(probe.upper)}
    return found if probe.quantity in ("heat_flow", "current") else found | {"reduce": probe.reduce}


def as_toml(scene: AnyScene) -> str:
    """The file that reads back as an equal scene, in SI units."""
    lines: list[str] = []
    for table, given in as_dict(scene).items():
        for item in given if isinstance(given, list) else [given]:
            lines.append(f"[[{table}]]" if isinstance(given, list) else f"[{table}]")
            lines += [f"{key} = {_value(value)}" for key, value in item.items()]
            lines.append("")
    return "\n".join(lines)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    # JSON's strings, booleans and finite numbers are TOML's.
    return json.dumps(value, ensure_ascii=False)
