"""The tables and keys that the file of a free scene may have; and a scene written as a document or as a TOML file.

The bounds are wide, for textbook cases have unreal round numbers; a value outside is a slip of the unit.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from scenes import functions as ck
from scenes import kinds as k
from scenes import laws, physics
from scenes import model as m
from scenes import units as d
from scenes.checks import Differing, tolerances
from scenes.functions import Following
from scenes.keys import ACCURACY, VALID_TO
from scenes.physics import HEAT_KEYS
from scenes.schema import HOW_LONG, Key, Schema, nest

UNUSED = 1.0
"""The value of a material's property that the scene does not need and the file does not give."""
TOTALS = m.FLOWS | m.DERIVED
"""Quantities that are totals over a surface or volume: no mean, maximum or minimum of them."""
RESISTANCES = "thermal_resistance", "electrical_resistance"

POINT = k.Items(k.Quantity(d.LENGTH, 0.0, 1e4, signed=True), "coordinates", '[0, "-50 um", 2e-6]', 3)

CONDITIONS: dict[str, ck.Varying | ck.Surroundings] = {
    "temperature": ck.Varying(k.KELVIN),
    "heat_flux": ck.Varying(k.Quantity(d.HEAT_FLUX, 0.0, 1e15, signed=True)),
    "convection": ck.Surroundings(
        "coefficient",
        Following(k.Quantity(d.CONVECTION_COEFFICIENT, 0.0, 1e12)),
        ck.Varying(k.KELVIN),
        '"10 W/(m2 K)"',
    ),
    "radiation": ck.Surroundings("emissivity", k.Quantity(d.NUMBER, 1e-6, 1.0), k.KELVIN, "0.8"),
    "voltage": ck.Varying(k.Quantity(d.VOLTAGE, 0.0, 1e6, signed=True)),
    "current": ck.Varying(k.Quantity(d.CURRENT, 0.0, 1e6, signed=True)),
}
"""A boundary has one of these, or a convection and radiation."""
RADIATION = " radiation"
"""The radiation beside a convection becomes a boundary of its own, whose name ends so."""
# The least are found at interfaces within a crystal, or of metals in one another (kapitza resistances are from 1e-9
# m2 K/W on, contacts of silicides from 1e-13 ohm m2 on), far below; the largest pass nothing that matters.
_PERFECT = ", or 0 for a perfect contact"
HEAT_CONTACT = k.Quantity(d.THERMAL_CONTACT, 1e-12, 1e6, note=_PERFECT, or_zero=True)
CURRENT_CONTACT = k.Quantity(d.ELECTRICAL_CONTACT, 1e-18, 1e6, note=_PERFECT, or_zero=True)
_BESIDE_VOLTAGE = {"contact_resistance": CURRENT_CONTACT}
SERIES = k.Quantity(d.RESISTANCE, 1e-9, 1e15)  # a larger one is a given current
_BESIDE: dict[str, k.Kind] = {
    "contact_resistance": replace(HEAT_CONTACT, note=f"{_PERFECT}; in ohm m2 beside a voltage"),
    "series_resistance": SERIES,
}
"""The keys beside a boundary's temperature or voltage."""
RESISTIVITY = Following(k.Quantity(d.RESISTIVITY, 1e-12, 1e9, word="insulator"), axes=True, proportional=True)
CONDUCTIVITY = Following(k.Quantity(d.ELECTRICAL_CONDUCTIVITY, 1e-9, 1e12), axes=True, proportional=True)
HEAT_SOURCE = ck.Varying(k.Quantity(d.HEAT_SOURCE, 0.0, 1e20, signed=True))


_NAMED = k.Numbers(k.NUMBER_OR_TEXT, (), "parameter", 'a table such as {R0 = "300 ohm"}')
_NAMED_TEXTS = k.Numbers(k.MODEL_FILE, (), "probe", 'a table such as {middle = "v(mid)"}')

_SCENE_AND_RUN = (
    Key("scene.name", "name", k.LABEL),
    Key("scene.initial_temperature", "initial_temperature", k.KELVIN),
    Key("run.steady", "steady", k.SWITCH),
    Key("run.end_time", "end_time", k.Quantity(d.TIME, 1e-12, 1e9)),
    Key("run.output_times", "output_times", k.Items(k.INSTANT, "times", '[0.1, "200 ms"]', ascending=True)),
    Key("run.accuracy", "accuracy", ACCURACY),
    Key("run.memory", "memory", k.MEMORY, physical=False),
    Key("model.file", "model.file", k.MODEL_FILE, physical=False),
    Key("model.parameters", "model.parameters", _NAMED, physical=False),
    Key("model.outputs", "model.outputs", _NAMED_TEXTS, physical=False),
    Key("checks.tolerances", "tolerances", tolerances(()), physical=False),
    Key("checks.expect_differs", "expected_to_differ", Differing(()), physical=False),
)

LISTS: dict[str, dict[str, k.Kind]] = {
    "material": {
        "name": k.LABEL,
        "thermal_conductivity": Following(k.Quantity(d.THERMAL_CONDUCTIVITY, 1e-9, 1e9), axes=True),
        "density": k.Quantity(d.DENSITY, 1e-6, 1e9),
        "specific_heat": Following(k.Quantity(d.SPECIFIC_HEAT, 1e-6, 1e9)),
        "resistivity": RESISTIVITY,
        "electrical_conductivity": CONDUCTIVITY,
        "temperature_coefficient": k.Quantity(d.TEMPERATURE_COEFFICIENT, 0.0, 1.0, signed=True),
        "reference_temperature": k.KELVIN,
        "valid_to": VALID_TO,
    },
    "box": {"name": k.LABEL, "material": k.LABEL, "lower": POINT, "upper": POINT, "heat_source": HEAT_SOURCE},
    "boundary": {"name": k.LABEL, "lower": POINT, "upper": POINT, **CONDITIONS, **_BESIDE},
    "probe": {
        "name": k.LABEL,
        "quantity": k.Choice(tuple(m.UNITS)),
        "at": POINT,
        "lower": POINT,
        "upper": POINT,
        "reduce": k.Choice(("mean", "max", "min")),
        "box": k.LABEL,
        "boxes": k.Items(k.LABEL, "boxes", '["left pad", "right pad"]'),
        "material": k.LABEL,
    },
    "contact": {
        "name": k.LABEL,
        "between": k.Items(k.LABEL, "boxes", '["a", "b"]', 2),
        "thermal_resistance": HEAT_CONTACT,
        "electrical_resistance": CURRENT_CONTACT,
    },
}
"""The tables that a file may have several of, such as [[material]]."""

BOXES = Schema(
    (*_SCENE_AND_RUN, Key("run.mesh", "mesh", k.Choice(("bricks", "tetrahedra")), physical=False)),
    LISTS,
    {
        "material": ("name",), "box": ("material", "lower", "upper"), "boundary": ("lower", "upper"),
        "probe": ("name",), "contact": ("between",),
    },
    "a free scene", beside_voltage=_BESIDE_VOLTAGE,
)  # fmt: skip
"""The schema of a free scene of boxes; a box or boundary without a name is called box-1, boundary-1 and so on."""

ON_MESH = Schema(
    (*_SCENE_AND_RUN, Key("mesh.file", "file", k.MESH_FILE), Key("mesh.unit", "unit", k.LENGTH_UNIT)),
    {
        "material": {**LISTS["material"], "groups": k.Items(k.GROUP, "groups", '["silicon"]')},
        "source": {"name": k.LABEL, "group": k.GROUP, "heat_source": HEAT_SOURCE},
        "boundary": {"name": k.LABEL, "group": k.GROUP, **CONDITIONS, **_BESIDE},
        "probe": {key: kind for key, kind in LISTS["probe"].items() if key not in ("lower", "upper", "box", "boxes")}
        | {"group": k.GROUP, "groups": k.Items(k.GROUP, "groups", '["silicon"]'), "side": k.GROUP},
        "contact": {**LISTS["contact"], "between": k.Items(k.GROUP, "volume groups", '["a", "b"]', 2)},
    },
    {
        "material": ("name",), "source": ("group", "heat_source"), "boundary": ("group",), "probe": ("name",),
        "contact": ("between",),
    },
    "a scene on a mesh", beside_voltage=_BESIDE_VOLTAGE,
)  # fmt: skip
"""The schema of a scene with a [mesh]: groups in place of boxes and corners."""


def schema_of_scene(scene: m.AnyScene) -> Schema:
    """Return the schema of boxes, or of groups on a mesh."""
    return ON_MESH if isinstance(scene, m.MeshScene) else BOXES


def as_dict(scene: m.AnyScene) -> dict[str, Any]:
    """Return the document of a scene without its default values."""
    needed = physics.needed(scene)
    materials = {each.name: _of_material(each, needed) for each in physics.materials(scene)}
    if isinstance(scene, m.MeshScene):
        bodies = {body.material.name: {"groups": list(body.groups)} for body in scene.bodies}
        materials = {name: table | bodies[name] for name, table in materials.items()}
    sections = _sections(scene)
    document: dict[str, Any] = {
        "scene": sections["scene"],
        "parameters": dict(scene.parameters.values) if scene.parameters is not None else None,
        "mesh": sections.get("mesh"),
        "material": list(materials.values()),
        scene.heated[0]: [_of_part(part) for part in getattr(scene, scene.heated[1])],
        "boundary": [{"name": b.name, **_where(b)} | _of_condition(b) for b in scene.boundaries],
        "probe": [_of_probe(probe) for probe in scene.probes],
        "contact": [
            {"name": c.name, "between": list(c.between)}
            | {key: value for key in RESISTANCES if (value := getattr(c, key)) or c.perfect}
            for c in scene.contacts
        ] or None,
        "run": sections["run"],
        "model": sections.get("model"),
        "checks": sections.get("checks"),
    }  # fmt: skip
    return {table: content for table, content in document.items() if content is not None}


def _sections(scene: m.AnyScene) -> dict[str, Any]:
    """The sections of a scene without its default values."""
    schema = schema_of_scene(scene)
    values = schema.values(scene if scene.model else replace(scene, model=m.OwnModel()))
    left_out = [path for path, value in values.items() if value is None or value is False or value in ("", {})]
    left_out += [path for path in HOW_LONG if scene.steady or not values[path]]
    return nest({path: schema.paths[path].kind.write(value) for path, value in values.items() if path not in left_out})


def _of_material(material: m.Material, needed: tuple[str, ...]) -> dict[str, Any]:
    keys = [key for key in HEAT_KEYS if getattr(material, key) != UNUSED or key in needed]
    keys.append("resistivity" if material.electrical_conductivity is None else "electrical_conductivity")
    if material.resistivity is not None and not laws.varies(material.resistivity):
        keys += ["temperature_coefficient", "reference_temperature"]
    if material.valid_to is not None:
        keys.append("valid_to")
    return {"name": material.name} | {key: LISTS["material"][key].write(getattr(material, key)) for key in keys}


def _of_part(part: m.Box | m.Source) -> dict[str, Any]:
    """A box, or a heat source of a mesh."""
    heat = {} if isinstance(part, m.Box) and m.is_zero(part.heat_source) else {"heat_source": part.heat_source}
    material = {"material": part.material.name} if isinstance(part, m.Box) else {}
    return {"name": part.name, **material, **_where(part)} | {k: HEAT_SOURCE.write(v) for k, v in heat.items()}


def _of_condition(b: m.Boundary | m.GroupBoundary) -> dict[str, Any]:
    """The condition of a boundary as a file has it."""
    if b.key in ("convection", "radiation"):
        return {b.key: CONDITIONS[b.key].write((b.value, b.ambient))}
    beside = {key: value for key in _BESIDE if (value := getattr(b, key)) and b.key != "current"}
    return {b.key: CONDITIONS[b.key].write(b.ambient if b.kind == "convection" else b.value)} | beside


def _of_probe(p: m.Probe | m.GroupProbe) -> dict[str, Any]:
    side = {"side": p.side} if isinstance(p, m.GroupProbe) else {"box": p.boxes[0] if len(p.boxes) == 1 else ""}
    reduce = {} if p.quantity in TOTALS else {"reduce": p.reduce}
    return {"name": p.name, "quantity": p.quantity, **_where(p), **reduce} | {k: v for k, v in side.items() if v}


def _where(item: Any) -> dict[str, Any]:
    """The place of a part: boxes, groups, a group, a point or corners."""
    several = {"groups": getattr(item, "groups", ()), "boxes": getattr(item, "boxes", ())[1:] and item.boxes}
    if found := {key: list(names) for key, names in several.items() if names}:
        return found
    if group := getattr(item, "group", None):
        return {"group": group}
    at = getattr(item, "at", None) or item.lower
    return {"at": list(at)} if at == getattr(item, "upper", at) else {"lower": list(at), "upper": list(item.upper)}


def as_toml(scene: m.AnyScene) -> str:
    """The file that reads back as an equal scene, in SI units."""
    return toml(as_dict(scene))


def toml(document: Mapping[str, Any]) -> str:
    """Return a document of tables and lists of tables as a TOML file."""
    lines: list[str] = []
    for table, content in document.items():
        for item in content if isinstance(content, list) else [content]:
            lines.append(f"[[{table}]]" if isinstance(content, list) else f"[{table}]")
            lines += [f"{key} = {_value(value)}" for key, value in item.items()]
            lines.append("")
    return "\n".join(lines)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_value(key)} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    # JSON's strings, booleans and finite numbers are TOML's.
    return json.dumps(value, ensure_ascii=False)
