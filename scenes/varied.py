"""One key of a scene varied by a factor: the keys that have a logarithmic derivative, and the scenes beside one."""

from __future__ import annotations

from operator import attrgetter
from typing import Any, TypeVar

from scenes.keys import type_of
from scenes.kinds import Quantity

T = TypeVar("T")

SETTINGS = ("run.", "control.", "external.step_time")
"""What says how a scene is run and not what it is made of; there is nothing to measure of it."""


def numbers(scene: object) -> dict[str, float]:
    """The physical keys of a parametric scene whose values are numbers other than zero, with these (SI units): what a
    logarithmic derivative can be taken by. An insulator's resistivity law says nothing, and is left out."""
    found = {}
    for path, key in type_of(scene).schema.paths.items():
        if not key.physical or not isinstance(key.kind, Quantity) or path.startswith(SETTINGS):
            continue
        value = attrgetter(key.attribute)(scene)
        if not value:
            continue
        owner = key.attribute.rpartition(".")[0]
        of_law = path.endswith((".temperature_coefficient", ".reference_temperature"))
        if of_law and attrgetter(owner)(scene).resistivity is None:
            continue
        found[path] = float(value)
    return found


def varied(scene: T, path: str, factor: float) -> T:
    """The scene with one key multiplied by a factor, unchecked."""
    schema = type_of(scene).schema
    value: Any = attrgetter(schema.paths[path].attribute)(scene)
    return schema.apply({path: value * factor}, scene)
