"""From the values of a file to a scene on a mesh, with the refusal of what a file leaves out or says twice."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from scenes.errors import SceneError, quoted
from scenes.free.build import asked_of, condition, material, refuse_missing, refuse_schedules, run_keys
from scenes.free.document import Document, Item
from scenes.meshed.model import Body, GroupBoundary, GroupProbe, MeshScene, Source


def build(document: Document, name: str, folder: str) -> MeshScene:
    """The scene; ``name`` is for one that has none, ``folder`` where its file lies. Raises SceneError."""
    mesh = document.sections["mesh"]
    if "file" not in mesh:
        raise SceneError('mesh.file is missing: give the path of a mesh, relative to the scene, such as "chip.msh"')
    bodies = tuple(_body(item) for item in document.items["material"])
    if not bodies:
        raise SceneError("the scene has no [[material]]: give one for every volume group of the mesh")
    sources = tuple(
        Source(item.name, item.values["group"], item.values["heat_source"]) for item in document.items["source"]
    )
    boundaries = tuple(_boundary(item) for item in document.items["boundary"])
    probes = tuple(_probe(item) for item in document.items["probe"])
    given = {"name": name, **document.sections["scene"], **run_keys(document.sections["run"])}
    scene = MeshScene(name, mesh["file"], mesh.get("unit", 1.0), bodies, sources, boundaries, probes, folder=folder)
    scene = replace(scene, **given)
    refuse_schedules(scene)
    refuse_missing(scene, document, {body.material.name for body in bodies})
    return scene


def _body(item: Item) -> Body:
    given = dict(item.values)
    groups = given.pop("groups", (item.name,))
    return Body(material(replace(item, values=given)), groups)


def _boundary(item: Item) -> GroupBoundary:
    kind, value = condition(item)
    if kind == "convection":
        return GroupBoundary(item.name, kind, item.values["group"], *value)
    return GroupBoundary(item.name, kind, item.values["group"], value)


def _probe(item: Item) -> GroupProbe:
    quantity, reduce = asked_of(item)
    given: dict[str, Any] = {key: item.values.get(key) for key in ("at", "group")}
    if (given["at"] is None) == (given["group"] is None):
        has = "no place" if given["at"] is None else "at and group"
        raise SceneError(f"{item.label} has {has}: give at = [x, y, z], or group")
    if given["at"] is not None and quantity in ("heat_flow", "current"):
        raise SceneError(f"{item.label}.quantity = {quoted(quantity)} needs a surface: give group in place of at")
    return GroupProbe(item.name, given["at"], given["group"], quantity, reduce)
