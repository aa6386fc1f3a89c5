"""From the values of a file to the scene, with the refusal of what a file leaves out or says twice."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from scenes.errors import SceneError, did_you_mean, quoted
from scenes.free import asks
from scenes.free.asks import AnyScene
from scenes.free.document import Document, Item
from scenes.free.tables import CONDITIONS, HEAT_KEYS
from scenes.model import Boundary, Box, Material, Point, Probe, Scene, Schedule

UNUSED = 1.0
"""Stands in a Material for what the scene does not need and the file does not give."""


def build(document: Document, name: str) -> Scene:
    """The scene; ``name`` is for one that has none. Raises SceneError."""
    materials = {item.name: material(item) for item in document.items["material"]}
    boxes = tuple(_box(item, materials) for item in document.items["box"])
    if not boxes:
        raise SceneError("the scene has no [[box]]: give at least one, with material, lower and upper")
    boundaries = tuple(_boundary(item) for item in document.items["boundary"])
    probes = tuple(_probe(item) for item in document.items["probe"])
    given = {"name": name, **document.sections["scene"], **run_keys(document.sections["run"])}
    scene = replace(Scene(name, boxes, boundaries, probes), **given)
    refuse_schedules(scene)
    refuse_missing(scene, document, {box.material.name for box in boxes})
    return scene


def material(item: Item) -> Material:
    """The material of an item, with a stand-in for what is not given."""
    given = item.values
    return Material(**{**dict.fromkeys(HEAT_KEYS, UNUSED), **given})


def _box(item: Item, materials: dict[str, Material]) -> Box:
    given = dict(item.values)
    material = given.pop("material")
    if material not in materials:
        known = f"give {' or '.join(map(quoted, materials))}" if materials else "add a [[material]] of that name"
        hint = did_you_mean(material, materials)
        raise SceneError(f"{item.label}.material = {quoted(material)} is not in the scene: {known}{hint}")
    return Box(**{**given, "name": item.name, "material": materials[material]})


def _boundary(item: Item) -> Boundary:
    given = item.values
    kind, value = condition(item)
    if kind == "convection":
        return Boundary(item.name, kind, given["lower"], given["upper"], *value)
    return Boundary(item.name, kind, given["lower"], given["upper"], value)


def condition(item: Item) -> tuple[Any, Any]:
    """The kind and the value of a boundary's one condition."""
    given = item.values
    kinds = [kind for kind in CONDITIONS if kind in given]
    if len(kinds) != 1:
        has = f"has {' and '.join(kinds)}" if kinds else "has no condition"
        raise SceneError(f"{item.label} {has}: give exactly one of {', '.join(CONDITIONS)}")
    return kinds[0], given[kinds[0]]


def _probe(item: Item) -> Probe:
    lower, upper = _where(item)
    quantity, reduce = asked_of(item)
    return Probe(item.name, lower, upper, quantity, reduce)


def asked_of(item: Item) -> tuple[Any, Any]:
    """The quantity and the reduction of a probe."""
    quantity, reduce = item.values.get("quantity", "temperature"), item.values.get("reduce", "mean")
    if item.name == "time_s":
        raise SceneError('probe.name = "time_s" is the name of the column of times: give another')
    if reduce != "mean" and quantity in ("heat_flow", "current"):
        raise SceneError(
            f"{item.label}.reduce = {quoted(reduce)} says nothing about a {quantity}, which is a total: leave it out, "
            "or give quantity temperature or potential"
        )
    return quantity, reduce


def _where(item: Item) -> tuple[Point, Point]:
    given = item.values
    corners = [key for key in ("lower", "upper") if key in given]
    if "at" in given and not corners:
        return given["at"], given["at"]
    if "at" not in given and len(corners) == 2:
        return given["lower"], given["upper"]
    has = " and ".join([*(["at"] if "at" in given else []), *corners]) or "no place"
    raise SceneError(f"{item.label} has {has}: give at = [x, y, z], or lower and upper")


def run_keys(given: dict[str, Any]) -> dict[str, Any]:
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


def refuse_schedules(scene: AnyScene) -> None:
    """Refuses values that vary in a steady state."""
    if not scene.steady:
        return
    for path, value in (
        *((f"boundary {quoted(b.name)}.{b.kind}", b.value) for b in scene.boundaries),
        *((f"boundary {quoted(b.name)}.convection.ambient", b.ambient) for b in scene.boundaries),
        *((f"{what}.heat_source", value) for what, value in asks.heat_sources(scene)),
    ):
        if isinstance(value, Schedule):
            raise SceneError(
                f"{path} varies in time, and run.steady = true asks for no time: give one value, or run.end_time in "
                "place of steady"
            )


def refuse_missing(scene: AnyScene, document: Document, used: set[str]) -> None:
    """What the physics that the scene asks for needs to know of the materials that are used."""
    needed = HEAT_KEYS if asks.capacity(scene) else HEAT_KEYS[:1] if asks.heat(scene) else ()
    for item in document.items["material"]:
        missing = [key for key in needed if key not in item.values]
        if item.name in used and missing:
            why = "a transient of temperature needs" if len(needed) > 1 else "heat conduction needs"
            raise SceneError(f"{item.label}.{missing[0]} is missing: {why} {' and '.join(missing)} of every material")
