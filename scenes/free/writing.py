"""Write a free scene as a document of SI numbers and plain JSON types that reads back equal, or as a TOML file."""

from __future__ import annotations

import json
import math
import re
from typing import Any

from scenes import laws, physics
from scenes import model as m
from scenes.free.tables import CONDITIONS, CONDUCTIVITY, HEAT_SOURCE, LISTS, RESISTANCES, RESISTIVITY, TOTALS, UNUSED
from scenes.physics import HEAT_KEYS


def as_dict(scene: m.AnyScene) -> dict[str, Any]:
    """Return the document of a scene without its default values."""
    run: dict[str, Any] = {"steady": True} if scene.steady else {"end_time": scene.end_time}
    if scene.output_times and not scene.steady:
        run["output_times"] = list(scene.output_times)
    needed = physics.needed(scene)
    document: dict[str, Any] = {"scene": {"name": scene.name, "initial_temperature": scene.initial_temperature}}
    if scene.parameters is not None:
        document["parameters"] = dict(scene.parameters.values)
    if isinstance(scene, m.MeshScene):
        document["mesh"] = {"file": scene.file, "unit": scene.unit}
        document["material"] = [_of_material(b.material, needed) | {"groups": list(b.groups)} for b in scene.bodies]
        document["source"] = [
            {"name": s.name, "group": s.group, "heat_source": HEAT_SOURCE.write(s.heat_source)} for s in scene.sources
        ]
    else:
        materials = {box.material.name: box.material for box in scene.boxes}
        document["material"] = [_of_material(each, needed) for each in materials.values()]
        document["box"] = [
            {"name": box.name, "material": box.material.name, **_where(box)}
            | ({} if m.is_zero(box.heat_source) else {"heat_source": HEAT_SOURCE.write(box.heat_source)})
            for box in scene.boxes
        ]
    document["boundary"] = [{"name": b.name, **_where(b)} | _of_condition(b) for b in scene.boundaries]
    document["probe"] = [
        {"name": p.name, "quantity": p.quantity, **_where(p)}
        | ({} if p.quantity in TOTALS else {"reduce": p.reduce})
        | _parts(p)
        for p in scene.probes
    ]
    if scene.contacts:
        document["contact"] = [
            {"name": c.name, "between": list(c.between)}
            | {key: v for key in RESISTANCES if (v := getattr(c, key)) or c.perfect}
            for c in scene.contacts
        ]
    if isinstance(scene, m.Scene) and scene.mesh:
        run["mesh"] = scene.mesh
    if scene.memory:
        run["memory"] = scene.memory
    document |= {"run": {**run, "accuracy": scene.accuracy}}
    if scene.model is not None:
        model = scene.model
        listed = {"file": model.file, "parameters": dict(model.parameters), "outputs": dict(model.outputs)}
        document["model"] = {key: value for key, value in listed.items() if value}
    checks: dict[str, Any] = {"tolerances": dict(scene.tolerances)} if scene.tolerances else {}
    if scene.expected_to_differ is not None:
        checks["expect_differs"] = list(scene.expected_to_differ)
    return document | ({"checks": checks} if checks else {})


def _of_material(material: m.Material, needed: tuple[str, ...]) -> dict[str, Any]:
    table: dict[str, Any] = {"name": material.name}
    kinds = LISTS["material"]
    table |= {key: kinds[key].write(v) for key in HEAT_KEYS if (v := getattr(material, key)) != UNUSED or key in needed}
    if material.electrical_conductivity is None:
        table["resistivity"] = RESISTIVITY.write(material.resistivity)
    else:
        table["electrical_conductivity"] = CONDUCTIVITY.write(material.electrical_conductivity)
    if material.resistivity is not None and not laws.varies(material.resistivity):
        table |= {key: getattr(material, key) for key in ("temperature_coefficient", "reference_temperature")}
    return table if material.valid_to is None else table | {"valid_to": material.valid_to}


def _of_condition(b: m.Boundary | m.GroupBoundary) -> dict[str, Any]:
    """The condition of a boundary as a file has it."""
    if b.key in ("convection", "radiation"):
        return {b.key: CONDITIONS[b.key].write((b.value, b.ambient))}
    value = b.ambient if b.kind == "convection" else b.value
    beside = {"contact_resistance": b.contact_resistance} if b.contact_resistance else {}
    if 0 < b.series_resistance < math.inf:
        beside["series_resistance"] = b.series_resistance
    return {b.key: CONDITIONS[b.key].write(value)} | beside


def _where(item: m.Box | m.Boundary | m.Probe | m.GroupBoundary | m.GroupProbe) -> dict[str, Any]:
    """The place of a part: corners, a point or a group."""
    if isinstance(item, (m.GroupBoundary, m.GroupProbe)):
        at = getattr(item, "at", None)
        if groups := getattr(item, "groups", ()):
            return {"groups": list(groups)}
        return {"group": item.group} if at is None else {"at": list(at)}
    if isinstance(item, m.Probe) and len(item.boxes) > 1:
        return {"boxes": list(item.boxes)}
    if isinstance(item, m.Probe) and item.lower == item.upper:
        return {"at": list(item.lower)}
    return {"lower": list(item.lower), "upper": list(item.upper)}


def _parts(probe: m.Probe | m.GroupProbe) -> dict[str, Any]:
    """The parts in which a probe is read."""
    if isinstance(probe, m.GroupProbe):
        return {"side": probe.side} if probe.side else {}
    return {"box": probe.boxes[0]} if len(probe.boxes) == 1 else {}


def as_toml(scene: m.AnyScene) -> str:
    """The file that reads back as an equal scene, in SI units."""
    lines: list[str] = []
    for table, content in as_dict(scene).items():
        for item in content if isinstance(content, list) else [content]:
            lines.append(f"[[{table}]]" if isinstance(content, list) else f"[{table}]")
            lines += [f"{key} = {_value(value)}" for key, value in item.items()]
            lines.append("")
    return "\n".join(lines)


def _key(name: str) -> str:
    """A key as TOML has it: in quotes where it is more than a word."""
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else json.dumps(name, ensure_ascii=False)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    # JSON's strings, booleans and finite numbers are TOML's.
    return json.dumps(value, ensure_ascii=False)
