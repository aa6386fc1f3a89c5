"""The types of scene file that there are: each a schema, the scene whose values are its defaults, and a leading key."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from scenes import keys
from scenes.device import Device
from scenes.schema import Schema
from scenes.sink import Sink

T = TypeVar("T")


@dataclass(frozen=True)
class SceneType(Generic[T]):
    """A type of scene, by the ``name`` of its built-in one; ``leading`` is the key that its folders start with."""

    name: str
    schema: Schema
    default: T
    leading: str


SINK = SceneType("sink", keys.SINK, Sink(), "drive.voltage")
DEVICE = SceneType("device", keys.DEVICE, Device(), "external.final_temperature")

TYPES: dict[str, SceneType[Any]] = {found.name: found for found in (SINK, DEVICE)}
"""All types by name."""


def type_of(scene: object) -> SceneType[Any]:
    """The type of a scene; TypeError for what is none."""
    for found in TYPES.values():
        if isinstance(scene, type(found.default)):
            return found
    raise TypeError(f"{type(scene).__name__} is not a scene")
