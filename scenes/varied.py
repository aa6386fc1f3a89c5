"""One key of a scene varied by a factor: the keys that have a logarithmic derivative, and the scenes beside one.

The keys of a free scene are of materials, sources and conditions, and the planes of its boxes. A plane is a coordinate
of a box with all else that lies there: boxes, conditions and probes move along, so that nothing tears. A plane is named
after the thinnest box with a face in it, and moves by parts of the size of this box, which unlike the coordinate does
not depend on the origin. A schedule is varied as a whole. A parameter moves everything that is made of it, and stands
for the keys that the file gives by it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from operator import attrgetter, eq
from typing import Any, TypeVar

from scenes import free, laws, physics
from scenes.expressions import Measure
from scenes.free import document
from scenes.free.tables import LISTS
from scenes.functions import EXPONENT, Following, Surroundings
from scenes.keys import TYPES, type_of
from scenes.kinds import KELVIN, Quantity
from scenes.laws import PowerLaw, Table
from scenes.loading import moved, rebuilt
from scenes.model import ROUNDING, AnyScene, Scene, Schedule
from scenes.parameters import SECTION, Parameters, transferred
from scenes.schema import CONDUCTIVITY, Item, label_of
from scenes.units import LENGTH, dimension_of

T = TypeVar("T")
Change = Callable[[float], Any]

SETTINGS = "run.", "control.", "external.step_time"
"""Keys that say how a scene is run, which nobody measures."""
_SIZE = Quantity(LENGTH, 0.0, 1e4)


def numbers(scene: Any) -> dict[str, float]:
    """Return the keys of a scene whose numbers are not zero, with these numbers (SI units): the inputs of which there
    are logarithmic derivatives.

    The number of a plane is the size of its box. Of parameters the plain numbers that move something count. An
    insulator's resistivity law is left out.
    """
    return {path: number.value for path, number in every_number(scene).items() if number.value}


def made_of_parameters(scene: Any) -> set[str]:
    """Return the keys that the file of a scene gives by parameters, which stand for them."""
    parameters: Parameters | None = scene.parameters
    if parameters is None:
        return set()

    def paths(path: str, given: Any) -> Iterator[str]:
        """The paths of the values that are made of parameters."""
        if isinstance(given, str) and set(re.findall(r"[A-Za-z_]\w*", given)) & set(parameters.measures):
            yield path
        elif isinstance(given, Mapping):
            for key, value in given.items():
                yield from paths(f"{path}.{key}", value)
        elif isinstance(given, (list, tuple)):
            for i, value in enumerate(given):
                point = f"{path}.{'xyz'[i]}" if path.endswith(("lower", "upper")) and i < 3 else f"{path}[]"
                yield from paths(f"{path}.{label_of(path, i + 1, value)[0]}" if path in LISTS else point, value)

    made = {p for key, value in parameters.flat.items() if key != SECTION for p in paths(key, value)}
    made |= {f"box.{faces[0]}" for faces, _ in _planes(scene) if made & {f"box.{face}" for face in faces}}
    parts = [re.split(r"[.[]", each) for each in made]
    # A value that is made of parameters is all or a part of a key's, or the other way round.
    return {path for path in every_number(scene) if any(all(map(eq, re.split(r"[.[]", path), each)) for each in parts)}


def zeros(scene: Any) -> tuple[str, ...]:
    """Return the keys of a free scene whose numbers are zero, of which there is no percent."""
    return tuple(path for path, number in of_free(scene).items() if not number.value)


def kind_of(scene: Any, path: str) -> Quantity:
    """Return the kind of number of a key."""
    return every_number(scene)[path].kind


def varied(scene: T, path: str, factor: float) -> T:
    """Return the scene with one key multiplied by a factor; a plane moves by ``factor - 1`` times the size of its box.

    Only a scene with another parameter is checked: raises SceneError.
    """
    return every_number(scene)[path].more(factor - 1)  # type: ignore[no-any-return]


def neighbour(scene: T, path: str, step: float) -> T:
    """Return the scene whose numbers differ by ``step`` times their derivatives by the logarithm of a key.

    Values that are made of a parameter change to first order only, and how the scene is run does not change. Raises
    SceneError where parts come apart, as touching faces do of which a parameter moves one alone.
    """
    given: Any = scene
    if given.parameters is None or not (name := given.parameters.key(path)):
        return varied(scene, path, 1 + step)
    less, more = (rebuilt(given, given.parameters.scaled(name, 1 + sign * abs(step))) for sign in (-1, 1))
    part = 0.5 if step > 0 else -0.5
    there: Any = transferred(given, less, more, part)
    # Models that are made of the parameters read their values.
    a, b, measures = less.parameters.values, more.parameters.values, given.parameters.measures
    measures = {n: Measure.from_float(float(m.value) + part * (b[n] - a[n]), m.powers) for n, m in measures.items()}
    beside: T = replace(there, parameters=replace(given.parameters, measures=measures))
    schema = type_of(given).schema if given.kind in TYPES else free.schema_of_scene(given)
    run = {p: attrgetter(key.attribute)(given) for p, key in schema.paths.items() if p.startswith(SETTINGS)}
    return schema.apply(run, beside)


def is_word(scene: object, path: str) -> bool:
    """Whether the value of a key is a word, which stands for a number."""
    return type_of(scene).schema.values(scene).get(path, path) is None


@dataclass(frozen=True)
class Number:
    """A number of a scene: its ``value`` (SI units), its kind, and the function that makes the scene in which it is
    larger by a part of the value."""

    value: float
    kind: Quantity
    more: Change


def parts(kind: Any, value: Any) -> Iterator[tuple[str, float, Quantity, Change]]:
    """Yield the numbers in a value of a kind: the end of the key, the number, its kind, and the value with this number
    times a factor. A schedule or a table is varied as a whole, by its largest value."""
    match value:
        case PowerLaw():
            yield "", value.value, kind.quantity, lambda factor: replace(value, value=factor * value.value)
            yield ".exponent", value.exponent, EXPONENT, lambda f: replace(value, exponent=f * value.exponent)
        case Schedule() | Table():
            largest = max(value.values, key=abs)
            yield "", largest, kind.quantity, lambda f: replace(value, values=tuple(f * v for v in value.values))
        case (coefficient, ambient) if isinstance(kind, Surroundings):
            for d, name, of, each in (
                (1, "ambient", kind.ambient, ambient),
                (0, kind.name, kind.coefficient, coefficient),
            ):
                for end, number, quantity, times in parts(of, each):
                    yield f".{name}{end}", number, quantity, _along(value, d, times)
        case (_, _, _) if isinstance(kind, Following):
            powers = [law for law in value if isinstance(law, PowerLaw)] if kind.proportional else []
            for d, each in enumerate(value):
                for end, number, quantity, times in parts(kind, each):
                    if not (powers and end):
                        yield f"[{'xyz'[d]}]{end}", number, quantity, _along(value, d, times)
            if powers:
                n = powers[0].exponent
                yield ".exponent", n, EXPONENT, lambda f: tuple(replace(law, exponent=f * n) for law in powers)
        case _ if value is not None and isinstance(quantity := getattr(kind, "quantity", kind), Quantity):
            yield "", value, quantity, lambda factor: factor * value


def _along(value: tuple[Any, ...], place: int, times: Change) -> Change:
    return lambda factor: (*value[:place], times(factor), *value[place + 1 :])


def every_number(scene: Any) -> dict[str, Number]:
    """Return the numbers of any scene by their keys, zeros, free parameters and keys made of parameters included."""
    return _of_parameters(scene) | (_of_parametric(scene) if scene.kind in TYPES else of_free(scene))


def _of_parameters(scene: Any) -> dict[str, Number]:
    """The free parameters of any scene."""

    def changed(name: str, part: float) -> Any:
        return moved(scene, rebuilt(scene, scene.parameters.scaled(name, 1 + part)))

    numbers = dict[str, Number]()
    for name in scene.parameters.free if scene.parameters else ():
        measure = scene.parameters.measures[name]
        kind = Quantity(dimension_of(measure.powers), 0.0, inf, signed=True)
        numbers[f"{SECTION}.{name}"] = Number(float(measure.value), kind, partial(changed, name))
    return numbers


def _of_parametric(scene: Any) -> dict[str, Number]:
    """The numbers of a sink or a device."""
    schema, numbers = type_of(scene).schema, dict[str, Number]()
    written = schema.write(scene)

    def changed(path: str, times: Change, part: float) -> Any:
        return schema.apply({path: times(1 + part)}, scene)

    for path, key in schema.paths.items():
        value, sink = attrgetter(key.attribute)(scene), getattr(scene, "sink", scene)
        if value is None and path == "anchor.oxide_offset":
            value = sink.anchor_distance
        if value is None or not key.physical or path not in written or path.startswith((*SETTINGS, *sink.absent)):
            continue
        if path.endswith((".temperature_coefficient", ".reference_temperature")):
            resistivity = attrgetter(key.attribute.rpartition(".")[0])(scene).resistivity
            if resistivity is None or laws.varies(resistivity):
                continue
        for end, number, quantity, times in parts(key.kind, value):
            numbers[path + end] = Number(float(number), quantity, partial(changed, path, times))
    return numbers


def of_free(scene: AnyScene) -> dict[str, Number]:
    """Return the numbers of a free scene by their keys, zeros among them."""
    schema, folder = free.schema_of_scene(scene), getattr(scene, "folder", "")
    given = {name: table for name, table in free.as_dict(scene).items() if name != SECTION}
    values = schema.read(schema.flatten(given))
    build = document.of_boxes if scene.parts == "boxes" else document.on_mesh

    def changed(table: str, number: int, key: str, times: Change, part: float) -> Any:
        """The scene, unchecked, with a number of a key of an item times ``1 + part``."""
        items = list(values[table])
        items[number] = replace(items[number], values={**items[number].values, key: times(1 + part)})
        after = build({**values, table: tuple(items)}, scene.name, folder)
        return replace(transferred(scene, start, after), parameters=scene.parameters)

    start, numbers = build(values, scene.name, folder), dict[str, Number]()
    for table in ("material", "boundary", "contact", scene.heated[0]):
        for n, item in enumerate(values.get(table, ())):
            for key, value in item.values.items():
                kind = schema.kind(table, key, item.values)
                if table == "material" and not _matters(scene, item, key):
                    continue
                for end, number, quantity, times in parts(kind, value):
                    name = f"{table}.{item.name}.{key}{end}"
                    numbers[name] = Number(float(number), quantity, partial(changed, table, n, key, times))
    numbers |= {f"box.{faces[0]}": number for faces, number in _planes(scene)}
    if not scene.steady or not physics.heat(scene):
        initial = scene.initial_temperature
        numbers["scene.initial_temperature"] = Number(
            initial, KELVIN, lambda part: replace(scene, initial_temperature=initial * (1 + part))
        )
    return numbers


def _matters(scene: AnyScene, material: Item, key: str) -> bool:
    """Whether the physics of the scene needs a property of a material."""
    if key in ("temperature_coefficient", "reference_temperature", "resistivity", CONDUCTIVITY):
        warms = key != "reference_temperature" or bool(material.values["temperature_coefficient"])
        return physics.electric(scene) and warms
    return key in physics.needed(scene)


def _planes(scene: Any) -> Iterator[tuple[list[str], Number]]:
    """The planes of a scene of boxes: the faces in each as "beam.upper.x", of which the first names it."""
    boxes = getattr(scene, "boxes", ())
    for axis, letter in enumerate("xyz"):
        ends = sorted(
            (box.upper[axis] - box.lower[axis], n, end, getattr(box, end)[axis])
            for n, box in enumerate(boxes) for end in ("lower", "upper")
        )  # fmt: skip
        coordinates = [c for *_, c in ends]
        small = ROUNDING * (max(coordinates, default=0.0) - min(coordinates, default=0.0))
        while ends:
            size, _, _, at = ends[0]
            faces = [f"{boxes[n].name}.{end}.{letter}" for _, n, end, c in ends if abs(c - at) <= small]
            yield faces, Number(size, _SIZE, partial(_with_plane, scene, axis, at, size, small))
            ends = [each for each in ends if abs(each[3] - at) > small]


def _with_plane(scene: Scene, axis: int, at: float, size: float, small: float, part: float) -> Scene:
    """The scene with a plane moved by a part of a size (m)."""

    def moved(point: tuple[float, float, float]) -> tuple[float, ...]:
        return tuple(c + part * size if d == axis and abs(c - at) <= small else c for d, c in enumerate(point))

    def together(items: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(replace(item, lower=moved(item.lower), upper=moved(item.upper)) for item in items)

    boxes, boundaries, probes = map(together, (scene.boxes, scene.boundaries, scene.probes))
    return replace(scene, boxes=boxes, boundaries=boundaries, probes=probes)
