"""One key of a scene varied by a factor: the keys that have a logarithmic derivative, and the scenes beside one.

Those of a free scene are of materials, sources and conditions, and the planes of its boxes. A plane is a coordinate of
a box with all else that lies there: boxes, conditions and probes go along, so that nothing tears. It is named after the
thinnest box with a face in it, of whose size a part says how far it moves: unlike a part of the coordinate that doesn't
depend on where the origin is. A value over time is varied as a whole. A parameter takes all along that is made of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import inf
from operator import attrgetter
from typing import Any, TypeVar

from scenes import laws, physics
from scenes.condition_kinds import Surroundings, Varying
from scenes.following import number_of
from scenes.free.tables import CURRENT_CONTACT, HEAT_CONTACT, HEAT_SOURCE, LISTS, SERIES
from scenes.keys import TYPES, type_of
from scenes.kinds import KELVIN, Quantity
from scenes.model import AnyScene, Material, Scene, Schedule, Value, values
from scenes.moved import transferred
from scenes.parameters import SECTION, Parameters
from scenes.units import LENGTH, NUMBER, dimension_of

T = TypeVar("T")

SETTINGS = ("run.", "control.", "external.step_time")
"""Keys of how a scene is run, not of what it is made of: there is nothing to measure of them."""
MEANT = {"oxide_offset": "anchor_distance"}
"""Attributes that may be a word, and the property that has their number then."""
EXPONENT = ".exponent"
"""How keys of exponents end."""
PLANE = 1e-9  # Coordinates closer than this part of a scene's extent are in one plane.
_SIZE = Quantity(LENGTH, 0.0, 1e4)
_POWER = Quantity(NUMBER, 0.0, inf, signed=True)


def is_free(scene: object) -> bool:
    """Whether a scene is one of boxes or on a mesh, and none of the parametric ones."""
    return getattr(scene, "kind", "") not in TYPES


def numbers(scene: Any) -> dict[str, float]:
    """The physical keys of a scene whose values are numbers other than zero, with these (SI units): what a
    logarithmic derivative can be taken by; of a plane of a free scene it is the size of its box. An insulator's
    resistivity law says nothing, and is left out. Of parameters those that are plain numbers and move something."""
    by_key = {f"{SECTION}.{name}": value for name, value in _parameters(scene).items()}
    if is_free(scene):
        return by_key | {path: number.value for path, number in of_free(scene).items() if number.value}
    for path, key in type_of(scene).schema.paths.items():
        skipped = (*SETTINGS, *getattr(scene, "sink", scene).absent)
        if not key.physical or number_of(key.kind) is None or path.startswith(skipped):
            continue
        given = _value(scene, key.attribute)
        if not given:
            continue
        owner = key.attribute.rpartition(".")[0]
        if path.endswith(".resistivity") and getattr(attrgetter(owner)(scene), "electrical_conductivity", None):
            continue
        of_line = path.endswith((".temperature_coefficient", ".reference_temperature"))
        if of_line and ((resistivity := attrgetter(owner)(scene).resistivity) is None or laws.varies(resistivity)):
            continue
        by_key |= {path + name: float(value) for name, value, _ in laws.numbers(given) if value}
    return by_key


def zeros(scene: Any) -> tuple[str, ...]:
    return tuple(path for path, number in of_free(scene).items() if not number.value)


def _parameters(scene: Any) -> dict[str, float]:
    parameters: Parameters | None = scene.parameters
    if parameters is None:
        return {}
    return {name: value for name in parameters.free if (value := parameters.values[name])}


def kind_of(scene: Any, path: str) -> Quantity:
    parameters: Parameters | None = scene.parameters
    if parameters is not None and (name := parameters.key(path)):
        return Quantity(dimension_of(parameters.powers[name]), 0.0, inf, signed=True)
    if is_free(scene):
        return of_free(scene)[path].kind
    if path.endswith(EXPONENT):
        return _POWER
    kind = number_of(type_of(scene).schema.paths[_of_law(scene, path)[0]].kind)
    assert kind is not None
    return kind


def varied(scene: T, path: str, factor: float) -> T:
    """The scene with one key multiplied by a factor; a plane of a free scene moves by ``factor - 1`` times the size of
    its box. It is checked only where the key is a parameter: raises SceneError then."""
    given: Any = scene
    if given.parameters is not None and (name := given.parameters.key(path)):
        after = _rebuilt(given, name, factor)
        changed = transferred(given, _rebuilt(given, name, 1.0), after)
        return replace(changed, parameters=after.parameters)  # type: ignore[no-any-return]
    if is_free(scene):
        return of_free(given)[path].more(factor - 1)  # type: ignore[return-value]
    schema = type_of(scene).schema
    key, name = _of_law(scene, path)
    times = {part: change for part, _, change in laws.numbers(_value(scene, schema.paths[key].attribute))}[name]
    return schema.apply({key: times(factor)}, scene)


def _of_law(scene: Any, path: str) -> tuple[str, str]:
    """The key of a sink or device, and the name behind it of a number of its law (`scenes.laws.numbers`)."""
    paths = type_of(scene).schema.paths
    key = path if path in paths else path.removesuffix(EXPONENT).partition("[")[0]
    return key, path[len(key) :]


def neighbour(scene: T, path: str, step: float) -> T:
    """The scene whose numbers differ by ``step`` times their derivatives by the logarithm of a key: what is made of a
    parameter need not be in proportion to it, and is to first order here. How a scene is run does not change. Raises
    SceneError where parts come apart, as faces that touch do of which a parameter moves one alone."""
    given: Any = scene
    if given.parameters is None or not (name := given.parameters.key(path)):
        return varied(scene, path, 1 + step)
    less, more = (_rebuilt(given, name, 1 + sign * abs(step)) for sign in (-1, 1))
    part = 0.5 if step > 0 else -0.5
    moved: Any = transferred(given, less, more, part)
    # What the parameters themselves are then, for models that are made of them.
    ends = [other.parameters.values for other in (less, more)]
    values = {n: v + part * (ends[1][n] - ends[0][n]) for n, v in given.parameters.values.items()}
    beside: T = replace(moved, parameters=replace(given.parameters, values=values))
    return _run_as(beside, given)


def _run_as(scene: T, other: Any) -> T:
    """The scene with all that says how another is run."""
    if is_free(scene):
        run = {name: getattr(other, name) for name in ("end_time", "output_times", "accuracy", "steady")}
        return replace(scene, **run)  # type: ignore[type-var]
    schema = type_of(scene).schema
    keys = {path: key.attribute for path, key in schema.paths.items() if path.startswith(SETTINGS)}
    return schema.apply({path: attrgetter(attribute)(other) for path, attribute in keys.items()}, scene)


def _rebuilt(scene: Any, name: str, factor: float) -> Any:
    """What the file of a scene says with a parameter multiplied by a factor."""
    flat = scene.parameters.moved({name: scene.parameters.values[name] * factor})
    if is_free(scene):
        from scenes import free

        return free.rebuilt(scene, flat)
    kind = type_of(scene)
    return kind.schema.apply(kind.schema.read(flat), kind.default)


def is_word(scene: object, path: str) -> bool:
    """Whether the value of a key is a word, which comes to a number."""
    return (
        path in type_of(scene).schema.paths and attrgetter(type_of(scene).schema.paths[path].attribute)(scene) is None
    )


def _value(scene: object, attribute: str) -> Any:
    """The value of a key; where it is a word, what that comes to."""
    value = attrgetter(attribute)(scene)
    owner, _, name = attribute.rpartition(".")
    if value is None and name in MEANT:
        return attrgetter(f"{owner}.{MEANT[name]}".lstrip("."))(scene)
    return value


@dataclass(frozen=True)
class Number:
    """A number of a scene: its ``value`` (SI units), parts of which it is varied by, its kind, and what makes the scene
    in which it is larger by a part of that."""

    value: float
    kind: Quantity
    more: Callable[[float], AnyScene]


def of_free(scene: AnyScene) -> dict[str, Number]:
    """The numbers by their keys, zeros among them, which no logarithmic derivative can be taken by."""
    by_key = dict([*_materials(scene), *_conditions(scene), *_contacts(scene), *_sources(scene)])
    if scene.parts == "boxes":
        boxes: Any = scene
        by_key |= dict(_planes(boxes))
    if not scene.steady or not physics.heat(scene):
        start = scene.initial_temperature
        by_key["scene.initial_temperature"] = Number(
            start, KELVIN, lambda part: replace(scene, initial_temperature=start * (1 + part))
        )
    return by_key


def _times(value: Value, factor: float) -> Value:
    if isinstance(value, Schedule):
        return Schedule(value.times, tuple(factor * v for v in value.values))
    return factor * value


def _largest(value: Value) -> float:
    return max(values(value), key=abs)


def _materials(scene: AnyScene) -> Iterator[tuple[str, Number]]:
    """What the physics that is asked for needs to know of each material."""
    for material in dict.fromkeys(physics.materials(scene)):
        keys = list(physics.needed(scene))
        if physics.electric(scene) and material.resistivity is not None:
            keys.append("resistivity" if material.electrical_conductivity is None else "electrical_conductivity")
            keys += [] if laws.varies(material.resistivity) else ["temperature_coefficient"]
            keys += ["reference_temperature"] if material.temperature_coefficient else []
        for key in keys:
            given = getattr(material, key)
            of_current = key in ("resistivity", "electrical_conductivity")
            for name, value, times in laws.in_proportion(given) if of_current else laws.numbers(given):
                kind: Any = _POWER if name.endswith(EXPONENT) else number_of(LISTS["material"][key])
                number = Number(float(value), kind, _with_material(scene, material, key, times))
                yield f"material.{material.name}.{key}{name}", number


def _with_material(
    scene: AnyScene, material: Material, key: str, times: Callable[[float], laws.Property]
) -> Callable[[float], AnyScene]:
    def more(part: float) -> AnyScene:
        changes = {key: times(1 + part)}
        if key == "electrical_conductivity":
            changes["resistivity"] = laws.inverse(changes[key])
        changed = replace(material, **changes)
        parts = [replace(p, material=changed) if p.material == material else p for p in getattr(scene, scene.parts)]
        return replace(scene, **{scene.parts: tuple(parts)})  # type: ignore[arg-type]

    return more


def _conditions(scene: AnyScene) -> Iterator[tuple[str, Number]]:
    boundaries: tuple[Any, ...] = scene.boundaries
    for i, boundary in enumerate(boundaries):
        kind, key = LISTS["boundary"][boundary.key], f"boundary.{boundary.name}.{boundary.key}"
        if boundary.contact_resistance:
            per_area = CURRENT_CONTACT if boundary.kind == "voltage" else HEAT_CONTACT
            resistance = Number(boundary.contact_resistance, per_area, _with_contact(scene, i))
            yield f"boundary.{boundary.name}.contact_resistance", resistance
        if boundary.kind == "convection" and boundary.contact_resistance:
            given = Number(_largest(boundary.ambient), KELVIN, _with_item(scene, "boundaries", i, "ambient"))
            yield f"boundary.{boundary.name}.{boundary.key}", given
            continue
        if isinstance(kind, Surroundings):
            ambient = Number(_largest(boundary.ambient), KELVIN, _with_item(scene, "boundaries", i, "ambient"))
            yield f"{key}.ambient", ambient
            key, quantity = f"{key}.{kind.name}", kind.quantity
        else:
            assert isinstance(kind, Varying)
            quantity = kind.quantity
        if laws.varies(boundary.value):
            for name, value, times in laws.numbers(boundary.value):
                of_law = _POWER if name.endswith(EXPONENT) else quantity
                yield key + name, Number(value, of_law, _with_law(scene, i, times))
        else:
            yield key, Number(_largest(boundary.value), quantity, _with_item(scene, "boundaries", i, "value"))
        if 0 < boundary.series_resistance < inf:
            more = _with_item(scene, "boundaries", i, "series_resistance")
            yield f"boundary.{boundary.name}.series_resistance", Number(boundary.series_resistance, SERIES, more)


def _with_law(scene: Any, number: int, times: Callable[[float], laws.Property]) -> Callable[[float], Any]:
    """What multiplies a number of the law of a boundary's coefficient by one and a part."""
    return _with_changes(scene, "boundaries", number, lambda _, part: {"value": times(1 + part)})


def _with_contact(scene: Any, number: int) -> Callable[[float], Any]:
    """The same of a boundary's contact resistance."""

    def changes(boundary: Any, part: float) -> dict[str, float]:
        resistance = boundary.contact_resistance * (1 + part)
        film = {"value": 1 / resistance} if boundary.kind == "convection" else {}
        return {"contact_resistance": resistance, **film}

    return _with_changes(scene, "boundaries", number, changes)


def _contacts(scene: AnyScene) -> Iterator[tuple[str, Number]]:
    kinds = {"thermal_resistance": HEAT_CONTACT, "electrical_resistance": CURRENT_CONTACT}
    for i, contact in enumerate(scene.contacts):
        for key, kind in kinds.items():
            number = Number(getattr(contact, key), kind, _with_item(scene, "contacts", i, key))
            yield f"contact.{contact.name}.{key}", number


def _sources(scene: AnyScene) -> Iterator[tuple[str, Number]]:
    table, items = scene.heated
    for i, item in enumerate(getattr(scene, items)):
        if largest := _largest(item.heat_source):
            number = Number(largest, HEAT_SOURCE.quantity, _with_item(scene, items, i, "heat_source"))
            yield f"{table}.{item.name}.heat_source", number


def _with_item(scene: Any, items: str, number: int, name: str) -> Callable[[float], Any]:
    return _with_changes(scene, items, number, lambda item, part: {name: _times(getattr(item, name), 1 + part)})


def _with_changes(
    scene: Any, items: str, number: int, changes: Callable[[Any, float], dict[str, Any]]
) -> Callable[[float], Any]:  # fmt: skip
    """What gives the scene with an item changed by a part: by these attributes of it."""

    def more(part: float) -> Any:
        entries = list(getattr(scene, items))
        entries[number] = replace(entries[number], **changes(entries[number], part))
        return replace(scene, **{items: tuple(entries)})

    return more


def _planes(scene: Scene) -> Iterator[tuple[str, Number]]:
    """The planes across each axis, in the order of the boxes."""
    for axis, letter in enumerate("xyz"):
        ends = [c for box in scene.boxes for c in (box.lower[axis], box.upper[axis])]
        small = PLANE * (max(ends) - min(ends))
        taken: list[float] = []
        # Of the faces in one plane the thinnest box's gives the name.
        for box in sorted(scene.boxes, key=lambda b: b.upper[axis] - b.lower[axis]):
            for end in ("lower", "upper"):
                at = getattr(box, end)[axis]
                if not any(abs(at - other) <= small for other in taken):
                    taken.append(at)
                    size = box.upper[axis] - box.lower[axis]
                    number = Number(size, _SIZE, _with_plane(scene, axis, at, size, small))
                    yield f"box.{box.name}.{end}.{letter}", number


def _with_plane(scene: Scene, axis: int, at: float, size: float, small: float) -> Callable[[float], Scene]:
    def more(part: float) -> Scene:
        def moved(point: tuple[float, float, float]) -> tuple[float, ...]:
            return tuple(
                c + part * size if d == axis and abs(c - at) <= small else c for d, c in enumerate(point)
            )  # fmt: skip

        def together(items: tuple[Any, ...]) -> tuple[Any, ...]:
            return tuple(replace(item, lower=moved(item.lower), upper=moved(item.upper)) for item in items)

        return replace(
            scene, boxes=together(scene.boxes), boundaries=together(scene.boundaries), probes=together(scene.probes)
        )

    return more
