"""From the values of a file to the scene, with the refusal of what a file leaves out or says twice."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from scenes import functions as ck
from scenes import laws, physics
from scenes import model as m
from scenes import units as d
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.free.tables import CONDITIONS, RADIATION, RESISTANCES, TOTALS, UNUSED
from scenes.physics import HEAT_KEYS
from scenes.schema import Item, section

Values = Mapping[str, Any]
S = TypeVar("S", m.Scene, m.MeshScene)

MOST_BOXES = 2_000
"""The most boxes: a row of this many takes 1.2 GB, 10 s of processor time, and a file of 0.2 MB."""


def check_number(boxes: int) -> None:
    """Raises SceneError for more boxes than are solved."""
    if boxes > MOST_BOXES:
        raise SceneError(
            f"the scene has {boxes:,} boxes, and {MOST_BOXES:,} are the most: let one box stand for those of one "
            "material that touch, or give a mesh (mesh.file)"
        )


def of_boxes(values: Values, name: str, folder: str = "") -> m.Scene:
    """The scene of boxes; ``name`` is for one that has none, ``folder`` where its file lies. Raises SceneError."""
    check_number(len(values.get("box", ())))
    materials = {item.name: _material(item.values) for item in values.get("material", ())}
    boxes = tuple(_box(item, materials) for item in values.get("box", ()))
    if not boxes:
        raise SceneError("the scene has no [[box]]: give at least one, with material, lower and upper")
    boundaries = tuple(
        m.Boundary(item.name, lower=item.values["lower"], upper=item.values["upper"], **_condition(item))
        for item in _apart(values.get("boundary", ()))
    )
    probes = tuple(_probe(item, boxes) for item in values.get("probe", ()))
    contacts = tuple(_contact(item) for item in values.get("contact", ()))
    return _declared(_with_run(m.Scene(name, boxes, boundaries, probes, contacts=contacts), values), values, folder)


def on_mesh(values: Values, name: str, folder: str) -> m.MeshScene:
    """The scene on a mesh; ``name`` is for one that has none, ``folder`` where its file lies. Raises SceneError."""
    mesh = section(values, "mesh")
    if "file" not in mesh:
        raise SceneError('mesh.file is missing: give the path of a mesh, relative to the scene, such as "chip.msh"')
    bodies = tuple(
        m.Body(_material({key: value for key, value in item.values.items() if key != "groups"}), groups)
        for item in values.get("material", ())
        for groups in [item.values.get("groups", (item.name,))]
    )
    if not bodies:
        raise SceneError("the scene has no [[material]]: give one for every volume group of the mesh")
    sources = tuple(m.Source(**{**item.values, "name": item.name}) for item in values.get("source", ()))
    boundaries = tuple(
        m.GroupBoundary(item.name, group=item.values["group"], **_condition(item))
        for item in _apart(values.get("boundary", ()))
    )
    probes = tuple(_group_probe(item, bodies) for item in values.get("probe", ()))
    contacts = tuple(_contact(item) for item in values.get("contact", ()))
    scene = m.MeshScene(
        name, mesh["file"], mesh.get("unit", 1.0), bodies, sources, boundaries, probes, contacts=contacts, folder=folder
    )
    return _declared(_with_run(scene, values), values, folder)


def _declared(scene: S, values: Values, folder: str) -> S:
    """The scene with what [model] and [checks] say. Refuses what they say of a probe that the scene has not."""
    model_section, checks_section = section(values, "model"), section(values, "checks")
    probes: list[str] = [item.name for item in values.get("probe", ())]
    checks = [*probes, *(f"{name}{m.OVER_TIME}" for name in probes), *(f"against_{name}" for name in probes), *m.SLOPES]
    tolerances, differing = checks_section.get("tolerances", {}), checks_section.get("expect_differs")
    for path, names, allowed in (
        ("model.outputs", model_section.get("outputs", {}), probes),
        ("checks.tolerances", tolerances, checks),
        ("checks.expect_differs", differing or (), checks),
    ):
        for name in names:
            if name not in allowed:
                what = "a probe" if allowed is probes else "a check, which are called as the probes"
                listed = f"give {', '.join(map(quoted, probes))}" if probes else "the scene has no probe"
                raise SceneError(f"{path}: {quoted(name)} is not {what}: {listed}{did_you_mean(name, allowed)}")
    model = None
    if model_section:
        parameters, outputs = (tuple(model_section.get(name, {}).items()) for name in ("parameters", "outputs"))
        model = m.OwnModel(model_section.get("file", ""), parameters, outputs, folder)
    return replace(scene, model=model, tolerances=tolerances, expected_to_differ=differing)


def _with_run(scene: S, values: Values) -> S:
    """The scene with what [scene] and [run] say. Refuses values that vary in a steady state, and materials that are
    used without what the physics that is asked for needs to know of them."""
    run = _run_keys(section(values, "run"))
    scene = replace(scene, **section(values, "scene"), **run, parameters=values.get("parameters"))
    driving = [
        *((f"boundary {quoted(b.name)}.{b.key if b.kind == 'voltage' else b.kind}", b.value) for b in scene.boundaries),
        *(
            (f"boundary {quoted(b.name)}.{'convection.ambient' if b.key == 'convection' else b.key}", b.ambient)
            for b in scene.boundaries
        ),
        *((f"{what}.heat_source", value) for what, value in physics.heat_sources(scene)),
    ]
    for path, value in driving if scene.steady else ():
        if isinstance(value, m.Schedule):
            raise SceneError(
                f"{path} varies in time, and run.steady = true asks for no time: give one value, or run.end_time in "
                "place of steady"
            )
    needed, used = physics.needed(scene), {material.name for material in physics.materials(scene)}
    for item in values.get("material", ()):
        missing = [key for key in needed if key not in item.values]
        if item.name in used and missing:
            why = "a transient of temperature needs" if len(needed) > 1 else "heat conduction needs"
            raise SceneError(f"{item.label}.{missing[0]} is missing: {why} {' and '.join(missing)} of every material")
    return scene


def _run_keys(run: dict[str, Any]) -> dict[str, Any]:
    times: tuple[float, ...] = run.get("output_times", ())
    if run.get("steady"):
        for key in ("end_time", "output_times"):
            if key in run:
                raise SceneError(f"run.steady = true and run.{key} contradict each other: give one of them")
        return run
    if "end_time" not in run and not (times and times[-1] > 0):
        raise SceneError('[run] says neither how long nor steady: give steady = true, or end_time = "10 ms"')
    last = times[-1] if times else 0.0
    end = run.get("end_time", last)
    if math.isclose(last, end, rel_tol=1e-12):
        end = last  # one time, reckoned in two ways
    if last > end:
        raise SceneError(
            f"run.end_time = {end:.12g} s is before the last of run.output_times, {last:.12g} s: give more"
        )
    return {**run, "end_time": end}


def _material(properties: dict[str, Any]) -> m.Material:
    """The material, with a stand-in for what is not given."""
    if (given := properties.get("electrical_conductivity")) is not None:
        properties = {**properties, "resistivity": laws.inverse(given)}
    material = m.Material(**{**dict.fromkeys(HEAT_KEYS, UNUSED), **properties})
    physics.refuse_both(f"material {quoted(material.name)}", material)
    physics.refuse_unlike(f"material {quoted(material.name)}", material)
    return material


def _box(item: Item, materials: dict[str, m.Material]) -> m.Box:
    material = item.values["material"]
    if material not in materials:
        choices = f"give {' or '.join(map(quoted, materials))}" if materials else "add a [[material]] of that name"
        hint = did_you_mean(material, materials)
        raise SceneError(f"{item.label}.material = {quoted(material)} is not in the scene: {choices}{hint}")
    return m.Box(**{**item.values, "name": item.name, "material": materials[material]})


def _apart(items: Sequence[Item]) -> Iterator[Item]:
    """The boundaries of a file, of which one with a convection and radiation is two."""
    names = {item.name for item in items}
    for item in items:
        if not {"convection", "radiation"} <= set(item.values):
            yield item
            continue
        radiating = f"{item.name}{RADIATION}"
        if radiating in names:
            raise SceneError(
                f"{item.label} has radiation, which is called {quoted(radiating)}, as another: rename that"
            )
        yield replace(item, values={key: v for key, v in item.values.items() if key != "radiation"})
        yield replace(item, name=radiating, values={key: v for key, v in item.values.items() if key != "convection"})


def _condition(item: Item) -> dict[str, Any]:
    """The kind and the value of a boundary's one condition, with the ambient temperature where it has one."""
    kinds = [kind for kind in CONDITIONS if kind in item.values]
    if len(kinds) != 1:
        has = f"has {' and '.join(kinds)}" if kinds else "has no condition"
        raise SceneError(
            f"{item.label} {has}: give exactly one of {', '.join(CONDITIONS)} (convection and radiation go together)"
        )
    (kind,) = kinds
    of_film = isinstance(CONDITIONS[kind], ck.Surroundings)
    value, ambient = item.values[kind] if of_film else (item.values[kind], 293.0)
    condition = {"kind": kind, "value": value, "ambient": ambient}
    series = item.values.get("series_resistance")
    if series is not None and kind != "voltage":
        raise SceneError(
            f"{item.label}.series_resistance = {series:g} ohm stands beside a {kind}: give it beside a voltage, or "
            "leave it out"
        )
    if kind == "current":
        condition |= {"kind": "voltage", "series_resistance": math.inf}
    elif series:
        condition["series_resistance"] = series
    behind = item.values.get("contact_resistance")
    return condition if behind is None else condition | _behind(item.label, kind, value, behind)


def _behind(label: str, kind: str, value: m.Value, contact: ck.Resistance) -> dict[str, Any]:
    """A temperature behind a contact resistance is a film of its inverse; a voltage behind one keeps it."""
    path, resistance = f"{label}.contact_resistance = {contact.value:g}", contact.value
    dimension = {"temperature": d.THERMAL_CONTACT, "voltage": d.ELECTRICAL_CONTACT}.get(kind)
    if dimension is None:
        raise SceneError(f"{path} stands beside a {kind}: give it beside a temperature or a voltage, or leave it out")
    if contact.dimension not in (None, dimension):
        raise SceneError(
            f"{path} {contact.dimension.unit} is {contact.dimension.name} beside a {kind}: give {dimension.name} such "
            f'as "{dimension.example}"'
        )
    if not resistance:
        return {}
    if kind == "voltage":
        return {"contact_resistance": resistance}
    return {"kind": "convection", "value": 1 / resistance, "ambient": value, "contact_resistance": resistance}


def _reading(item: Item) -> dict[str, Any]:
    quantity, reduce = item.values.get("quantity", "temperature"), item.values.get("reduce", "mean")
    if item.name == "time_s":
        raise SceneError('probe.name = "time_s" is the name of the column of times: give another')
    if reduce != "mean" and quantity in TOTALS:
        raise SceneError(
            f"{item.label}.reduce = {quoted(reduce)} says nothing about a {quantity}, which is a total: leave it out, "
            "or give quantity temperature or potential"
        )
    for key in ("box", "side") if quantity in TOTALS else ():
        if key in item.values:
            raise SceneError(
                f"{item.label}.{key} = {quoted(item.values[key])} says nothing about a {quantity}, which is no value "
                "of one side: leave it out"
            )
    return {"quantity": quantity, "reduce": reduce}


def _region(item: Item, parts: Mapping[str, tuple[str, ...]], several: str) -> tuple[str, ...] | None:
    """The boxes or volume groups over which a probe without a place is read: the listed ones, those of a material, or
    all; None for a probe with a place. ``parts`` are those of each material."""
    given = item.values
    places = [key for key in ("at", "lower", "upper", "group", "box", "side") if key in given]
    regions = [key for key in (several, "material") if key in given]
    if not regions and (places or "reduce" not in given):
        return None
    if places or len(regions) > 1:
        raise SceneError(f"{item.label} has {' and '.join([*places, *regions])}: give one of them")
    if given.get("quantity", "temperature") != "temperature":
        raise SceneError(f"{item.label}.quantity = {quoted(given['quantity'])} needs a place: give one")
    known = [name for names in parts.values() for name in names]
    if several in given:
        for name in given[several]:
            if name not in known:
                listed = ", ".join(map(quoted, known[:20]))
                hint = did_you_mean(name, known)
                raise SceneError(f"{item.label}.{several} names {quoted(name)}: give some of {listed}{hint}")
        return tuple(dict.fromkeys(given[several]))
    if "material" in given and given["material"] not in parts:
        hint = did_you_mean(given["material"], parts)
        raise SceneError(
            f"{item.label}.material = {quoted(given['material'])} is of no part: give {' or '.join(map(quoted, parts))}"
            f"{hint}"
        )
    return parts[given["material"]] if "material" in given else tuple(known)


def _probe(item: Item, boxes: Sequence[m.Box]) -> m.Probe:
    parts: dict[str, tuple[str, ...]] = {}
    for box in boxes:
        parts[box.material.name] = (*parts.get(box.material.name, ()), box.name)
    reading, region = _reading(item), _region(item, parts, "boxes")
    if region is None:
        side = (item.values["box"],) if "box" in item.values else ()
        return m.Probe(item.name, *_corners(item), **reading, boxes=side)
    chosen = [box for box in boxes if box.name in region]
    (x, y, z), (u, v, w) = ([f(getattr(b, end)[d] for b in chosen) for d in range(3)]
                            for f, end in ((min, "lower"), (max, "upper")))  # fmt: skip
    return m.Probe(item.name, (x, y, z), (u, v, w), **reading, boxes=region)


def _group_probe(item: Item, bodies: Sequence[m.Body]) -> m.GroupProbe:
    reading = _reading(item)
    region = _region(item, {b.material.name: b.groups for b in bodies}, "groups")
    if region is not None:
        return m.GroupProbe(item.name, **reading, groups=region)
    return m.GroupProbe(item.name, *_place(item), **reading, side=item.values.get("side", ""))


def _contact(item: Item) -> m.Contact:
    resistances = {key: item.values[key].value for key in RESISTANCES if key in item.values}
    if not resistances:
        raise SceneError(f"{item.label} has no resistance: give {' or '.join(RESISTANCES)}, or leave the contact out")
    return m.Contact(item.name, item.values["between"], **resistances)


def _corners(item: Item) -> tuple[m.Point, m.Point]:
    """The corners of a probe's box; of a point both are the same."""
    corners = item.values
    has = [key for key in ("at", "lower", "upper") if key in corners]
    if has == ["at"]:
        return corners["at"], corners["at"]
    if has == ["lower", "upper"]:
        return corners["lower"], corners["upper"]
    raise SceneError(f"{item.label} has {' and '.join(has) or 'no place'}: give at = [x, y, z], or lower and upper")


def _place(item: Item) -> tuple[m.Point | None, str | None]:
    at, group = item.values.get("at"), item.values.get("group")
    if (at is None) == (group is None):
        has = "no place" if at is None else "at and group"
        raise SceneError(f"{item.label} has {has}: give at = [x, y, z], or group")
    if at is not None and (quantity := item.values.get("quantity")) in TOTALS:
        needs = "a volume" if quantity == "power" else "a surface"
        raise SceneError(f"{item.label}.quantity = {quoted(quantity)} needs {needs}: give group in place of at")
    return at, group
