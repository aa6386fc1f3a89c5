"""One key of a scene varied by a factor: the keys that have a logarithmic derivative, and the scenes beside one."""

from __future__ import annotations

from operator import attrgetter
from typing import Any, TypeVar

from scenes.keys import TYPES, type_of
from scenes.kinds import Quantity

T = TypeVar("T")

SETTINGS = ("run.", "control.", "external.step_time")
"""What says how a scene is run and not what it is made of; there is nothing to measure of it."""
MEANT = {"oxide_offset": "anchor_distance"}
"""The attributes that say what others come to where their value is a word."""


def is_free(scene: object) -> bool:
    """Whether a scene is one of boxes or on a mesh, and none of the parametric ones."""
    return not any(isinstance(scene, type(found.default)) for found in TYPES.values())


def numbers(scene: Any) -> dict[str, float]:
    """The physical keys of a scene whose values are numbers other than zero, with these (SI units): what a
    logarithmic derivative can be taken by; of a plane of a free scene it is the size of its box. An insulator's
    resistivity law says nothing, and is left out."""
    if is_free(scene):
        from scenes.free import varied as free

        return {path: number.value for path, number in free.numbers(scene).items() if number.value}
    found = {}
    for path, key in type_of(scene).schema.paths.items():
        if not key.physical or not isinstance(key.kind, Quantity) or path.startswith(SETTINGS):
            continue
        value = _value(scene, key.attribute)
        if not value:
            continue
        owner = key.attribute.rpartition(".")[0]
        of_law = path.endswith((".temperature_coefficient", ".reference_temperature"))
        if of_law and attrgetter(owner)(scene).resistivity is None:
            continue
        found[path] = float(value)
    return found


def zeros(scene: Any) -> tuple[str, ...]:
    from scenes.free import varied as free

    return tuple(path for path, number in free.numbers(scene).items() if not number.value)


def kind_of(scene: Any, path: str) -> Quantity:
    if is_free(scene):
        from scenes.free import varied as free

        return free.numbers(scene)[path].kind
    kind = type_of(scene).schema.paths[path].kind
    assert isinstance(kind, Quantity)
    return kind


def varied(scene: T, path: str, factor: float) -> T:
    """The scene with one key multiplied by a factor, unchecked; of a free scene with one of its numbers more by the
    factor less one."""
    if is_free(scene):
        from scenes.free import varied as free

        found: Any = free.numbers(scene)[path].more(factor - 1)  # type: ignore[arg-type]
        return found  # type: ignore[no-any-return]
    schema = type_of(scene).schema
    value: Any = _value(scene, schema.paths[path].attribute)
    return schema.apply({path: value * factor}, scene)


def is_word(scene: object, path: str) -> bool:
    """Whether the value of a key is a word, which comes to a number."""
    return attrgetter(type_of(scene).schema.paths[path].attribute)(scene) is None


def _value(scene: object, attribute: str) -> Any:
    """The value of a key; where it is a word, what that comes to."""
    value = attrgetter(attribute)(scene)
    owner, _, name = attribute.rpartition(".")
    if value is None and name in MEANT:
        return attrgetter(f"{owner}.{MEANT[name]}".lstrip("."))(scene)
    return value
