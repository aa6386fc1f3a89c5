"""What is to be solved: materials, boxes, boundaries, drive, probes. No numerics. Here any scene by its name or file: a
sink, a device, or a free scene of boxes or on a mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, overload

from scenes import loading
from scenes.device import Device
from scenes.keys import DEVICE, SINK, SceneType
from scenes.sink import Sink


@overload
def load(source: Literal["sink"], overrides: Sequence[str] = ()) -> Sink: ...
@overload
def load(source: Literal["device"], overrides: Sequence[str] = ()) -> Device: ...
@overload
def load(source: str | Path, overrides: Sequence[str] = ()) -> Any: ...
def load(source: str | Path, overrides: Sequence[str] = ()) -> Any:
    """The scene of a name ("sink", "device", "bridge", "plate", "hotplate") or a TOML file, with overrides such as
    "sink.width=20um" or "boundary.left.voltage=2" put over it, checked.

    Returns a Sink, a Device or a free scene, whichever the file describes. Raises SceneError.
    """
    from scenes import free

    document, name, folder = loading.document(source, loading.known_names())
    of = type_of_file(document)
    if of is None:
        return free.from_dict(document, name, folder, overrides)
    return loading.of_document(document, name, overrides, of)


def type_of_file(document: Mapping[str, Any]) -> SceneType[Any] | None:
    """Whether a document is of a sink or of a device; ``None`` for a free scene."""
    from scenes.free.document import LISTS

    if {*LISTS, "mesh"} & set(document):
        return None
    of_a_device = {path for path in DEVICE.schema.sections if path and path not in SINK.schema.sections}
    materials = document.get("materials")
    named = {f"materials.{name}" for name in materials} if isinstance(materials, Mapping) else set()
    return DEVICE if of_a_device & (set(document) | named) else SINK


def overridden(scene: Any, overrides: Sequence[str]) -> Any:
    """Any scene with overrides put over it, checked; raises SceneError."""
    if isinstance(scene, (Sink, Device)):
        return loading.overridden(scene, overrides) if overrides else loading.check(scene)
    if not overrides:
        return scene
    from scenes import free

    return free.overridden(scene, overrides)
