"""Reading a free scene: from a TOML file or one of the examples, with overrides, checked; and writing it back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from scenes import examples
from scenes.free import build
from scenes.free.tables import BOXES, ON_MESH
from scenes.free.validity import check
from scenes.free.write import as_dict
from scenes.loading import file_name, file_text, toml
from scenes.model import AnyScene
from scenes.overrides import override
from scenes.schema import Schema

__all__ = ["as_dict", "check", "from_dict", "load", "overridden"]


def load(source: str | Path, overrides: Sequence[str] = ()) -> AnyScene:
    """The scene of a file, with what "KEY=VALUE" overrides say put over it, checked.

    ``source`` is the name of an example or a path to a TOML file; a scene without a name is called after its file, and
    the mesh of one with a [mesh], which is not read here, lies beside it. Raises SceneError.
    """
    example = isinstance(source, str) and source in examples.names()
    text = examples.text(str(source)) if example else file_text(source, examples.names())
    found, folder = toml(text, source), "" if example else str(Path(source).parent)
    return from_dict(found, str(source) if example else file_name(Path(source)), folder, overrides)


def from_dict(
    given: Mapping[str, Any], name: str = "scene", folder: str = "", overrides: Sequence[str] = ()
) -> AnyScene:
    """The scene of nested tables such as `as_dict` returns, with overrides put over it, checked; raises SceneError."""
    found = values(given, overrides)
    if "mesh" in given:
        return build.on_mesh(found, name, folder)
    return check(build.of_boxes(found, name))


def overridden(scene: AnyScene, overrides: Sequence[str]) -> AnyScene:
    """A scene with "KEY=VALUE" overrides put over it as `load` puts them over a file's, checked; raises SceneError."""
    return from_dict(as_dict(scene), scene.name, getattr(scene, "folder", ""), overrides)


def values(given: Mapping[str, Any], overrides: Sequence[str] = ()) -> dict[str, Any]:
    """The values that nested tables and overrides say, each read by its kind, before anything is made of them; raises
    SceneError for what is unknown, of the wrong type or out of bounds."""
    schema = schema_of(given)
    return schema.read(override(schema.flatten(given), overrides, schema))


def schema_of(given: Mapping[str, Any]) -> Schema:
    """What a document may say: a [mesh] makes the difference."""
    return ON_MESH if "mesh" in given else BOXES
