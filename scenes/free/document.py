"""Build a scene from the values of a file; refuse missing and contradictory values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from scenes import functions, laws, physics
from scenes import model as m
from scenes.errors import SceneError, quoted, unknown
from scenes.free.tables import CONDITIONS, RADIATION, RESISTANCES, TOTALS, UNUSED, schema_of_scene
from scenes.physics import HEAT_KEYS
from scenes.schema import CONDUCTIVITY, HOW_LONG, RESISTIVITY, Item

Values = Mapping[str, Any]
S = TypeVar("S", m.Scene, m.MeshScene)

MOST_BOXES = 2_000  # a row of this many takes 1.2 GB, 10 s of processor time, and a file of 0.2 MB


def of_boxes(values: Values, name: str, folder: str = "") -> m.Scene:
    """Build the scene of boxes; ``name`` is for one that has none, ``folder`` where its file lies."""
    if (count := len(values.get("box", ()))) > MOST_BOXES:
        raise SceneError(f"the scene has {count:,} boxes, and {MOST_BOXES:,} are the most: join some, or give a mesh")
    materials = {item.name: _material(item.values) for item in values.get("material", ())}
    boxes = []
    for item in values.get("box", ()):
        if item.values["material"] not in materials:
            raise unknown(f"{item.label}.material is no material of the scene:", item.values["material"], materials)
        boxes.append(m.Box(**{**item.values, "name": item.name, "material": materials[item.values["material"]]}))
    if not boxes:
        raise SceneError("the scene has no [[box]]: give at least one, with material, lower and upper")
    probes = tuple(_probe(item, boxes) for item in values.get("probe", ()))
    return _complete(m.Scene(name, tuple(boxes), (), probes), values, folder)


def on_mesh(values: Values, name: str, folder: str) -> m.MeshScene:
    """Build the scene on a mesh; ``name`` is for one that has none, ``folder`` where its file lies.

    Raises SceneError.
    """
    if "mesh.file" not in values:
        raise SceneError('mesh.file is missing: give the path of a mesh, relative to the scene, such as "chip.msh"')
    bodies = tuple(
        m.Body(_material({key: v for key, v in item.values.items() if key != "groups"}), groups)
        for item in values.get("material", ())
        for groups in [item.values.get("groups", (item.name,))]
    )
    if not bodies:
        raise SceneError("the scene has no [[material]]: give one for every volume group of the mesh")
    sources = tuple(m.Source(**{**item.values, "name": item.name}) for item in values.get("source", ()))
    probes = tuple(_group_probe(item, bodies) for item in values.get("probe", ()))
    return _complete(m.MeshScene(name, "", 1.0, bodies, sources, (), probes, folder=folder), values, folder)


def _complete(scene: S, values: Values, folder: str) -> S:
    """The scene with its boundaries, its contacts and its sections."""
    boundary: Any = m.GroupBoundary if isinstance(scene, m.MeshScene) else m.Boundary
    boundaries = []
    for item in _separate_radiation(values.get("boundary", ())):
        place = {key: item.values[key] for key in ("lower", "upper", "group") if key in item.values}
        boundaries.append(boundary(item.name, **place, **_condition(item)))
    contacts = []
    for item in values.get("contact", ()):
        resistances = {key: item.values[key] for key in RESISTANCES if key in item.values}
        if not resistances:
            raise SceneError(f"{item.label} has no resistance: give {' or '.join(RESISTANCES)}, or leave it out")
        contacts.append(m.Contact(item.name, item.values["between"], **resistances))
    _check_names(values)
    if any(path.startswith("model.") for path in values):
        scene = replace(scene, model=m.OwnModel(folder=folder))
    schema = schema_of_scene(scene)
    keys = {path: value for path, value in values.items() if path not in schema.lists}
    scene = schema.apply(
        keys | _end_time(values), replace(scene, boundaries=tuple(boundaries), contacts=tuple(contacts))
    )
    _check_steady(scene)
    needed, used = physics.needed(scene), {material.name for material in physics.materials(scene)}
    for item in values.get("material", ()):
        missing = [key for key in needed if key not in item.values]
        if item.name in used and missing:
            why = "a transient of temperature needs" if len(needed) > 1 else "heat conduction needs"
            raise SceneError(f"{item.label}.{missing[0]} is missing: {why} {' and '.join(missing)} of every material")
    return scene


def _check_names(values: Values) -> None:
    """Refuse outputs and checks that name no probe."""
    probes = [item.name for item in values.get("probe", ())]
    checks = [*probes, m.SLOPES, *(f"{name}{m.OVER_TIME}" for name in probes), *(f"against_{name}" for name in probes)]
    for path, what, known in (
        ("model.outputs", "probe", probes),
        ("checks.tolerances", "check", checks),
        ("checks.expect_differs", "check", checks),
    ):
        for name in values.get(path) or ():
            if name not in known:
                raise unknown(f"{path} names no {what}", name, known)


def _check_steady(scene: m.AnyScene) -> None:
    """Refuse values that vary in a steady state."""
    driving = [(f"{what}.heat_source", value) for what, value in physics.heat_sources(scene)]
    for b in scene.boundaries:
        path = f"boundary {quoted(b.name)}.{b.key}"
        driving += [(path, b.value), (path + ".ambient" * (b.key == "convection"), b.ambient)]
    for path, value in driving if scene.steady else ():
        if isinstance(value, m.Schedule):
            raise SceneError(f"{path} varies in time, and run.steady = true: give one value, or run.end_time")


def _end_time(values: Values) -> dict[str, float]:
    """The end of a transient, by its key; none in a steady state."""
    times: tuple[float, ...] = values.get("run.output_times", ())
    if values.get("run.steady"):
        for key in [each for each in HOW_LONG if each in values]:
            raise SceneError(f"run.steady = true and {key} contradict each other: give one of them")
        return {}
    last = times[-1] if times else 0.0
    if "run.end_time" not in values and not last > 0:
        raise SceneError('[run] says neither how long nor steady: give steady = true, or end_time = "10 ms"')
    end = values.get("run.end_time", last)
    if math.isclose(last, end, rel_tol=1e-12):
        end = last  # one time, reckoned in two ways
    if last > end:
        raise SceneError(f"run.end_time = {end:.12g} s is before the last of run.output_times, {last:.12g} s")
    return {"run.end_time": end}


def _material(properties: dict[str, Any]) -> m.Material:
    """The material, with a stand-in for missing properties."""
    if CONDUCTIVITY in properties:
        properties = {**properties, RESISTIVITY: laws.inverse(properties[CONDUCTIVITY])}
    material = m.Material(**{**dict.fromkeys(HEAT_KEYS, UNUSED), **properties})
    physics.check_law(f"material {quoted(material.name)}", material)
    return material


def _separate_radiation(items: Sequence[Item]) -> Iterator[Item]:
    """The boundaries of a file; a convection with radiation makes two."""
    names = {item.name for item in items}
    for item in items:
        if not {"convection", "radiation"} <= set(item.values):
            yield item
            continue
        radiating = f"{item.name}{RADIATION}"
        if radiating in names:
            raise SceneError(f"{item.label} has radiation, which is called {quoted(radiating)}: rename the other one")
        yield replace(item, values={key: v for key, v in item.values.items() if key != "radiation"})
        yield replace(item, name=radiating, values={key: v for key, v in item.values.items() if key != "convection"})


def _condition(item: Item) -> dict[str, Any]:
    """The kind and the values of a boundary's one condition.

    A temperature behind a contact resistance is a film of its inverse; a voltage behind one keeps it.
    """
    kinds = [kind for kind in CONDITIONS if kind in item.values]
    if len(kinds) != 1:
        has = f"has {' and '.join(kinds)}" if kinds else "has no condition"
        one = f"give exactly one of {', '.join(CONDITIONS)} (convection and radiation go together)"
        raise SceneError(f"{item.label} {has}: {one}")
    (kind,) = kinds
    of_film = isinstance(CONDITIONS[kind], functions.Surroundings)
    value, ambient = item.values[kind] if of_film else (item.values[kind], 293.0)
    condition = {"kind": kind, "value": value, "ambient": ambient}
    series, contact = item.values.get("series_resistance"), item.values.get("contact_resistance")
    for key, given, unit, fits in (
        ("series_resistance", series, " ohm", ["voltage"]),
        ("contact_resistance", contact, "", ["temperature", "voltage"]),
    ):
        if given is not None and kind not in fits:
            where = f"give it beside a {' or a '.join(fits)}, or leave it out"
            raise SceneError(f"{item.label}.{key} = {given:g}{unit} stands beside a {kind}: {where}")
    if kind == "current":
        return {"kind": "voltage", "value": value, "series_resistance": math.inf}
    if series:
        condition["series_resistance"] = series
    if not contact:
        return condition
    if kind == "temperature":
        condition |= {"kind": "convection", "value": 1 / contact, "ambient": value}
    return condition | {"contact_resistance": contact}


def _reading(item: Item) -> dict[str, Any]:
    """The quantity of a probe, and how it is reduced to one number."""
    given = item.values
    quantity, reduce = given.get("quantity", "temperature"), given.get("reduce", "mean")
    if item.name == "time_s":
        raise SceneError('probe.name = "time_s" is the name of the column of times: give another')
    for key in ("reduce", "box", "side") if quantity in TOTALS else ():
        if given.get(key, "mean") != "mean":
            why = f"says nothing about a {quantity}, which is a total over a place: leave it out"
            raise SceneError(f"{item.label}.{key} = {quoted(given[key])} {why}")
    return {"quantity": quantity, "reduce": reduce}


def _region(
    item: Item, parts: Mapping[str, tuple[str, ...]], several: str, *places: list[str]
) -> tuple[str, ...] | None:
    """The boxes or volume groups of a probe without a place: a list, all of a material, or all; None for a probe with
    one of the ``places``. ``parts`` are the names for each material."""
    given = item.values
    place = [key for key in ("at", "lower", "upper", "group") if key in given]
    sides = [key for key in ("box", "side") if key in given]
    regions = [key for key in (several, "material") if key in given]
    if not regions and (place or sides or "reduce" not in given):
        if place not in places:
            one = " or ".join(" and ".join(each) for each in places)
            raise SceneError(f"{item.label} has {' and '.join(place) or 'no place'}: give {one}")
        return None
    if place or sides or len(regions) > 1:
        raise SceneError(f"{item.label} has {' and '.join([*place, *sides, *regions])}: give one of them")
    if given.get("quantity", "temperature") != "temperature":
        raise SceneError(f"{item.label}.quantity = {quoted(given['quantity'])} needs a place: give one")
    known = [name for names in parts.values() for name in names]
    for name in given.get(several, ()):
        if name not in known:
            raise unknown(f"{item.label}.{several} names", name, known)
    if "material" in given and given["material"] not in parts:
        raise unknown(f"{item.label}.material is of no part:", given["material"], parts)
    if several in given:
        return tuple(dict.fromkeys(given[several]))
    return parts[given["material"]] if "material" in given else tuple(known)


def _probe(item: Item, boxes: Sequence[m.Box]) -> m.Probe:
    parts: dict[str, tuple[str, ...]] = {}
    for box in boxes:
        parts[box.material.name] = (*parts.get(box.material.name, ()), box.name)
    reading, region, given = _reading(item), _region(item, parts, "boxes", ["at"], ["lower", "upper"]), item.values
    if region is not None:
        chosen = [box for box in boxes if box.name in region]
        x, y, z = (min(box.lower[axis] for box in chosen) for axis in range(3))
        u, v, w = (max(box.upper[axis] for box in chosen) for axis in range(3))
        return m.Probe(item.name, (x, y, z), (u, v, w), **reading, boxes=region)
    side = (given["box"],) if "box" in given else ()
    if side and side[0] not in (names := [box.name for box in boxes]):
        raise unknown(f"{item.label}.box is no box:", side[0], names)
    lower, upper = (given["at"], given["at"]) if "at" in given else (given["lower"], given["upper"])
    return m.Probe(item.name, lower, upper, **reading, boxes=side)


def _group_probe(item: Item, bodies: Sequence[m.Body]) -> m.GroupProbe:
    reading, given = _reading(item), item.values
    region = _region(item, {b.material.name: b.groups for b in bodies}, "groups", ["at"], ["group"])
    if region is not None:
        return m.GroupProbe(item.name, **reading, groups=region)
    at, group = given.get("at"), given.get("group")
    if at is not None and (quantity := reading["quantity"]) in TOTALS:
        needs = "a volume" if quantity == "power" else "a surface"
        raise SceneError(f"{item.label}.quantity = {quoted(quantity)} needs {needs}: give group in place of at")
    return m.GroupProbe(item.name, at, group, **reading, side=given.get("side", ""))
