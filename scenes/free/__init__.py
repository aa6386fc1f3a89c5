"""Free 3D scenes: unions of boxes with conditions and probes, or meshes with groups, read from TOML and checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from scenes.free import document
from scenes.free.tables import BOXES, ON_MESH
from scenes.free.tables import as_dict as as_dict
from scenes.free.tables import schema_of_scene as schema_of_scene
from scenes.model import AnyScene
from scenes.schema import Schema, override


def from_dict(
    given: Mapping[str, Any], name: str = "scene", folder: str = "", overrides: Sequence[str] = ()
) -> AnyScene:
    """The scene of nested tables such as `as_dict` returns, with overrides put over it, checked; raises SceneError."""
    schema = schema_of(given)
    return built(override(schema.flatten(given), overrides, schema), schema, name, folder)


def built(flat: Mapping[str, Any], schema: Schema, name: str, folder: str) -> AnyScene:
    """The scene of a flat one whose files lie in a folder, checked; raises SceneError."""
    values = schema.read(flat)
    if schema is ON_MESH:
        return document.on_mesh(values, name, folder)
    from scenes.free import rules

    return rules.checked(document.of_boxes(values, name, folder))


def rebuilt(scene: AnyScene, flat: Mapping[str, Any]) -> AnyScene:
    """Return the scene of a flat one, of the kind and in the folder of another; raises SceneError."""
    folder = getattr(scene, "folder", "") or (scene.model.folder if scene.model else "")
    return built(flat, schema_of_scene(scene), scene.name, folder)


def schema_of(given: Mapping[str, Any]) -> Schema:
    """Return the schema of a document, by its [mesh]."""
    return ON_MESH if "mesh" in given else BOXES
