"""From the values of a file to the scene, with the refusal of what a file leaves out or says twice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from scenes import physics
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.free.tables import CONDITIONS, HEAT_KEYS
from scenes.model import (
    AnyScene,
    Body,
    Boundary,
    Box,
    GroupBoundary,
    GroupProbe,
    Material,
    MeshScene,
    Point,
    Probe,
    Scene,
    Schedule,
    Source,
)
from scenes.schema import Item, section

Values = Mapping[str, Any]
S = TypeVar("S", Scene, MeshScene)

UNUSED = 1.0
"""Stands in a Material for what the scene does not need and the file does not give."""


def of_boxes(values: Values, name: str) -> Scene:
    """The scene of boxes; ``name`` is for one that has none. Raises SceneError."""
    materials = {item.name: _material(item.values) for item in values.get("material", ())}
    boxes = tuple(_box(item, materials) for item in values.get("box", ()))
    if not boxes:
        raise SceneError("the scene has no [[box]]: give at least one, with material, lower and upper")
    boundaries = tuple(
        Boundary(item.name, lower=item.values["lower"], upper=item.values["upper"], **_condition(item))
        for item in values.get("boundary", ())
    )
    probes = tuple(Probe(item.name, *_corners(item), **_reading(item)) for item in values.get("probe", ()))
    return _with_run(Scene(name, boxes, boundaries, probes), values, {box.material.name for box in boxes})


def on_mesh(values: Values, name: str, folder: str) -> MeshScene:
    """The scene on a mesh; ``name`` is for one that has none, ``folder`` where its file lies. Raises SceneError."""
    mesh = section(values, "mesh")
    if "file" not in mesh:
        raise SceneError('mesh.file is missing: give the path of a mesh, relative to the scene, such as "chip.msh"')
    bodies = tuple(_body(item) for item in values.get("material", ()))
    if not bodies:
        raise SceneError("the scene has no [[material]]: give one for every volume group of the mesh")
    sources = tuple(
        Source(item.name, item.values["group"], item.values["heat_source"]) for item in values.get("source", ())
    )
    boundaries = tuple(
        GroupBoundary(item.name, group=item.values["group"], **_condition(item)) for item in values.get("boundary", ())
    )
    probes = tuple(GroupProbe(item.name, *_place(item), **_reading(item)) for item in values.get("probe", ()))
    scene = MeshScene(name, mesh["file"], mesh.get("unit", 1.0), bodies, sources, boundaries, probes, folder=folder)
    return _with_run(scene, values, {body.material.name for body in bodies})


def _with_run(scene: S, values: Values, used: set[str]) -> S:
    """The scene with what [scene] and [run] say; ``used`` are the names of its materials."""
    scene = replace(scene, **section(values, "scene"), **_run_keys(section(values, "run")))
    _refuse_schedules(scene)
    _refuse_missing(scene, values, used)
    return scene


def _material(given: dict[str, Any]) -> Material:
    """The material, with a stand-in for what is not given."""
    return Material(**{**dict.fromkeys(HEAT_KEYS, UNUSED), **given})


def _box(item: Item, materials: dict[str, Material]) -> Box:
    given = dict(item.values)
    material = given.pop("material")
    if material not in materials:
        known = f"give {' or '.join(map(quoted, materials))}" if materials else "add a [[material]] of that name"
        hint = did_you_mean(material, materials)
        raise SceneError(f"{item.label}.material = {quoted(material)} is not in the scene: {known}{hint}")
    return Box(**{**given, "name": item.name, "material": materials[material]})


def _body(item: Item) -> Body:
    given = dict(item.values)
    groups = given.pop("groups", (item.name,))
    return Body(_material(given), groups)


def _condition(item: Item) -> dict[str, Any]:
    """The kind and the value of a boundary's one condition, with the ambient temperature where it has one."""
    given = item.values
    kinds = [kind for kind in CONDITIONS if kind in given]
    if len(kinds) != 1:
        has = f"has {' and '.join(kinds)}" if kinds else "has no condition"
        raise SceneError(f"{item.label} {has}: give exactly one of {', '.join(CONDITIONS)}")
    (kind,) = kinds
    if kind == "convection":
        coefficient, ambient = given[kind]
        return {"kind": kind, "value": coefficient, "ambient": ambient}
    return {"kind": kind, "value": given[kind]}


def _reading(item: Item) -> dict[str, Any]:
    """The quantity and the reduction of a probe."""
    quantity, reduce = item.values.get("quantity", "temperature"), item.values.get("reduce", "mean")
    if item.name == "time_s":
        raise SceneError('probe.name = "time_s" is the name of the column of times: give another')
    if reduce != "mean" and quantity in ("heat_flow", "current"):
        raise SceneError(
            f"{item.label}.reduce = {quoted(reduce)} says nothing about a {quantity}, which is a total: leave it out, "
            "or give quantity temperature or potential"
        )
    return {"quantity": quantity, "reduce": reduce}


def _corners(item: Item) -> tuple[Point, Point]:
    """The corners of a probe's box; of a point both are the same."""
    given = item.values
    corners = [key for key in ("lower", "upper") if key in given]
    if "at" in given and not corners:
        return given["at"], given["at"]
    if "at" not in given and len(corners) == 2:
        return given["lower"], given["upper"]
    has = " and ".join([*(["at"] if "at" in given else []), *corners]) or "no place"
    raise SceneError(f"{item.label} has {has}: give at = [x, y, z], or lower and upper")


def _place(item: Item) -> tuple[Point | None, str | None]:
    """The point or the group of a probe."""
    at, group = item.values.get("at"), item.values.get("group")
    if (at is None) == (group is None):
        has = "no place" if at is None else "at and group"
        raise SceneError(f"{item.label} has {has}: give at = [x, y, z], or group")
    if at is not None and item.values.get("quantity") in ("heat_flow", "current"):
        quantity = quoted(item.values["quantity"])
        raise SceneError(f"{item.label}.quantity = {quantity} needs a surface: give group in place of at")
    return at, group


def _run_keys(given: dict[str, Any]) -> dict[str, Any]:
    """The keys of [run] as attributes of a scene."""
    found = {key: value for key, value in given.items() if key in ("accuracy", "steady")}
    times: tuple[float, ...] = given.get("output_times", ())
    if given.get("steady"):
        for key in ("end_time", "output_times"):
            if key in given:
                raise SceneError(f"run.steady = true and run.{key} contradict each other: give one of them")
        return found
    if "end_time" not in given and not (times and times[-1] > 0):
        raise SceneError('[run] says neither how long nor steady: give steady = true, or end_time = "10 ms"')
    end = given.get("end_time", times[-1] if times else 0.0)
    if times and times[-1] > end:
        raise SceneError(f"run.end_time = {end:g} s is before the last of run.output_times, {times[-1]:g} s: give more")
    return {**found, "end_time": end, "output_times": times}


def _refuse_schedules(scene: AnyScene) -> None:
    """Refuses values that vary in a steady state."""
    if not scene.steady:
        return
    for path, value in (
        *((f"boundary {quoted(b.name)}.{b.kind}", b.value) for b in scene.boundaries),
        *((f"boundary {quoted(b.name)}.convection.ambient", b.ambient) for b in scene.boundaries),
        *((f"{what}.heat_source", value) for what, value in physics.heat_sources(scene)),
    ):
        if isinstance(value, Schedule):
            raise SceneError(
                f"{path} varies in time, and run.steady = true asks for no time: give one value, or run.end_time in "
                "place of steady"
            )


def _refuse_missing(scene: AnyScene, values: Values, used: set[str]) -> None:
    """What the physics that the scene asks for needs to know of the materials that are used."""
    needed = HEAT_KEYS if physics.capacity(scene) else HEAT_KEYS[:1] if physics.heat(scene) else ()
    for item in values.get("material", ()):
        missing = [key for key in needed if key not in item.values]
        if item.name in used and missing:
            why = "a transient of temperature needs" if len(needed) > 1 else "heat conduction needs"
            raise SceneError(f"{item.label}.{missing[0]} is missing: {why} {' and '.join(missing)} of every material")
