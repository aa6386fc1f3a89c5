"""A schema: the table of the keys of one type of scene file, which reads and writes files and applies overrides.

Overrides come from a command line: "sink.width=20um", for an item of a table by its name "boundary.left.voltage=2",
and for one coordinate of a point "box.arm.upper.x=9um". A *path* is a key's full name: "materials.silicon.density". A
*flat* scene maps paths to the raw content of the file, and the name of a repeated table, "box", to the list of its
items; its *values* map the same names to the content that was read. Any file may have "parameters"
(`scenes.parameters`).
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from functools import cached_property
from operator import attrgetter
from typing import Any, TypeVar

from scenes import laws
from scenes.errors import SceneError, did_you_mean, parsed, printable, quoted, unknown
from scenes.kinds import Kind, Numbers, only
from scenes.parameters import SECTION, Names, Parameters, known, put

T = TypeVar("T")
HOW_LONG = "run.end_time", "run.output_times"  # keys of transients alone

RESISTIVITY, CONDUCTIVITY = "resistivity", "electrical_conductivity"


def twin(path: str) -> str:
    """Return the key of the inverse of a key's property, of resistivity and electrical_conductivity; or ""."""
    owner, dot, name = path.rpartition(".")
    other = {RESISTIVITY: CONDUCTIVITY, CONDUCTIVITY: RESISTIVITY}.get(name, "")
    return other and f"{owner}{dot}{other}"


@dataclass(frozen=True)
class Key:
    """One key: its path in a file, the kind of its value and the (dotted) attribute of the scene that holds it.

    ``physical`` is false where the key does not change the physical object.
    """

    path: str
    attribute: str
    kind: Kind
    physical: bool = True


@dataclass(frozen=True)
class Item:
    """One item of a [[table]]: its name, its label in messages, and the values of its keys."""

    name: str
    label: str
    values: dict[str, Any]


@dataclass(frozen=True)
class Schema:
    """The keys of one type of scene in the order of writing, and the keys of repeated tables (``lists``).

    ``required`` are the keys without a default of each table. ``called`` names the type in messages. Among keys that
    end alike the key in the ``main`` section wins. ``beside_voltage`` has the keys of another kind in an item with a
    voltage.
    """

    keys: tuple[Key, ...]
    lists: Mapping[str, Mapping[str, Kind]] = field(default_factory=dict)
    required: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    called: str = "a scene file"
    main: str = ""
    beside_voltage: Mapping[str, Kind] = field(default_factory=dict)

    @cached_property
    def paths(self) -> dict[str, Key]:
        return {key.path: key for key in self.keys}

    @cached_property
    def sections(self) -> dict[str, tuple[str, ...]]:
        """The keys, sections or tables that every section takes, by the section's path; "" is the whole file."""
        sections: dict[str, dict[str, None]] = {}
        for path in self.paths:
            while path:
                parent, _, name = path.rpartition(".")
                sections.setdefault(parent, {})[name] = None
                path = parent
        sections[""] |= dict.fromkeys((*self.lists, SECTION))
        return {section: tuple(names) for section, names in sections.items()}

    def flatten(self, document: Mapping[str, object], section: str = "") -> dict[str, object]:
        """Return a nested document as a flat one; raises SceneError for an unknown key or section."""
        flat: dict[str, object] = {}
        for name, given in document.items():
            path = f"{section}.{name}" if section else str(name)
            if path in self.paths or path in self.lists or path == SECTION:
                flat[path] = given
            elif path not in self.sections:
                raise self.unknown(path, given)
            elif isinstance(given, Mapping):
                flat |= self.flatten(given, path)
            else:
                raise SceneError(f"{path} = {quoted(given)} must be a section: {self._takes(path)}")
        return flat

    def read(self, flat: Mapping[str, object]) -> dict[str, Any]:
        """Return the values of a flat scene in SI units, tables as tuples of items.

        Raises SceneError for a value that is missing, of the wrong type or out of bounds, and for a repeated name.
        """
        names = Names(flat.get(SECTION, {}))
        with known(names):
            values = {
                path: self._items(path, given) if path in self.lists else self.paths[path].kind.read(path, given)
                for path, given in flat.items()
                if path != SECTION
            }
        _refuse_twins(values)
        return values | {SECTION: Parameters(dict(names), names.free(), flat)} if names else values

    def kind(self, table: str, key: str, item: Mapping[str, object]) -> Kind:
        """Return the kind of a key of an item of a table."""
        kind = self.lists[table][key]
        return self.beside_voltage.get(key, kind) if "voltage" in item else kind

    def _items(self, table: str, given: object) -> tuple[Item, ...]:
        if not isinstance(given, (list, tuple)) or not all(isinstance(item, Mapping) for item in given):
            raise SceneError(f"{table} must be a list of tables: start each with [[{table}]]")
        kinds, items = self.lists[table], dict[str, Item]()
        for number, item in enumerate(given, 1):
            name, label = label_of(table, number, item)
            only(label, item, tuple(kinds))
            values = {key: self.kind(table, key, item).read(f"{label}.{key}", value) for key, value in item.items()}
            _refuse_twins(values, f"{label}.")
            for key in self.required[table]:
                if key not in values:
                    raise SceneError(f"{label}.{key} is missing: every [[{table}]] needs one")
            if name in items:
                raise SceneError(f"{table}[{number}].name = {quoted(name)} is taken: give it a name of its own")
            items[name] = Item(name, label, values)
        return tuple(items.values())

    def apply(self, values: Mapping[str, Any], default: T) -> T:
        """Return the default scene (a frozen dataclass) with the values in its attributes."""
        inverses = {twin(p): laws.inverse(value) for p, value in values.items() if p.endswith(CONDUCTIVITY)}
        every = {**values, **inverses}
        attributes = {p if p == SECTION else self.paths[p].attribute: value for p, value in every.items()}
        return _with(default, nest(attributes))

    def values(self, scene: object) -> dict[str, Any]:
        """Return the values of the keys of a scene, by their paths."""
        return {path: attrgetter(key.attribute)(scene) for path, key in self.paths.items()}

    def write(self, scene: object) -> dict[str, Any]:
        """Return a scene as a flat one that reads back equal: SI numbers and plain JSON types."""
        values = self.values(scene)
        left_out = [p if value is None else twin(p) for p, value in values.items() if p.endswith(CONDUCTIVITY)]
        return {path: self.paths[path].kind.write(value) for path, value in values.items() if path not in left_out}

    def unknown(self, path: str, given: object, flat: Mapping[str, object] | None = None) -> SceneError:
        """Return the error for a path that is neither a key nor a section, with the nearest one of these or, of a
        ``flat`` scene, of the keys of its items."""
        items = [(f"{t}.{name}", item) for t in self.lists for name, item in _named(t, (flat or {}).get(t)).items()]
        in_items = [f"{owner}.{key}" for owner, item in items for key in item if key != "name"]
        known = [*self.sections, *self.lists, *self.paths, *in_items]
        ends = [name for name in known if name.endswith(f".{path.rpartition('.')[2]}")]
        near = ends[:3] if len(ends) == 1 or "." not in path else []
        hint = f", did you mean {' or '.join(map(quoted, near))}?" if near else did_you_mean(path, known)
        section = path
        while section not in self.sections:
            section = section.rpartition(".")[0]
        value = "" if given is None else f" = {quoted(given)}"
        return SceneError(f"unknown key {printable(path)}{value}: {self._takes(section)}{hint}")

    def _takes(self, section: str) -> str:
        name = f"[{section}]" if section else self.called
        taken = (f"[[{n}]]" if not section and n in self.lists else n for n in self.sections[section])
        return f"{name} takes {', '.join(taken)}"


def _refuse_twins(values: Mapping[str, Any], owner: str = "") -> None:
    for path in values:
        if path.endswith(CONDUCTIVITY) and twin(path) in values:
            raise SceneError(f"{owner}{path} and {owner}{twin(path)} say the same: give one of them")


def label_of(table: str, number: int, given: Mapping[str, object]) -> tuple[str, str]:
    """Return the name of an item and its label in messages: box "arm", or box[2] without a name."""
    name = given.get("name")
    if isinstance(name, str):
        return name, f"{table} {quoted(name)}"
    return f"{table}-{number}", f"{table}[{number}]"


def _with(scene: Any, values: Mapping[str, Any]) -> Any:
    """A frozen dataclass with new values for its attributes and, in nested mappings, for attributes of its parts."""
    parts = {name: getattr(scene, name) for name in values}
    nested = {name for name, part in parts.items() if is_dataclass(part) and isinstance(values[name], Mapping)}
    return replace(scene, **{n: _with(parts[n], value) if n in nested else value for n, value in values.items()})


def nest(flat: Mapping[str, Any]) -> dict[str, Any]:
    nested: dict[str, Any] = {}
    for path, value in flat.items():
        *sections, name = path.split(".")
        inner = nested
        for section in sections:
            inner = inner.setdefault(section, {})
        inner[name] = value
    return nested


def override(flat: Mapping[str, object], settings: Sequence[str], schema: Schema) -> dict[str, object]:
    """Return a flat scene with the settings applied in order, so that a later one wins.

    The last parts of a path are enough where they name one key. A setting of the duration of a free scene replaces the
    file's, and drops output times beyond it. Raises SceneError for a setting without "=" or value, for an unknown or
    ambiguous key, and for an unknown item.
    """
    result = dict(flat)
    given: set[str] = set()
    for setting in settings:
        key, equals, text = (part.strip() for part in setting.partition("="))
        if not equals or not key or not text:
            raise SceneError(f"{quoted(setting)} sets nothing: give KEY=VALUE")
        value = toml_value(text)
        table, _, rest = key.partition(".")
        if table in schema.lists:
            if "." not in rest:
                raise SceneError(f"{printable(key)} names no item of a [[{table}]]: give {table}.NAME.KEY")
            result[table] = copy.deepcopy(result.get(table, []))
            _put(*_find(table, rest, result[table]), value)
            continue
        path, item = locate(key, value, schema, result)
        given.add(path)
        if item and path == SECTION:
            value = put(result.get(path), item, value)
        elif item:
            tolerances = result.get(path)
            value = {**(tolerances if isinstance(tolerances, Mapping) else {}), item: value}
        result.pop(twin(path), None)
        result |= schema.flatten({path: value})
    return _of_one_length(result, given, schema) if "run.steady" in schema.paths else result


def _of_one_length(flat: dict[str, object], given: set[str], schema: Schema) -> dict[str, object]:
    """Drop the file's keys that contradict a steady or an end_time that was ``given``."""
    if {"run.steady", "run.end_time"} <= given:
        return flat
    if "run.steady" in given and flat["run.steady"] is True:
        return {path: value for path, value in flat.items() if path in given or path not in HOW_LONG}
    if "run.end_time" in given:
        flat.pop("run.steady", None)
        if "run.output_times" in flat and "run.output_times" not in given:
            with known(Names(flat.get(SECTION, {}))):
                end, times = (schema.paths[path].kind.read(path, flat[path]) for path in HOW_LONG)
            del flat["run.output_times"]
            if kept := [time for time in times if time <= end]:
                flat["run.output_times"] = kept
    return flat


def locate(key: str, value: object, schema: Schema, flat: Mapping[str, object] | None = None) -> tuple[str, str]:
    """Return the path of an abbreviated key, and the name within it for a table of tolerances or of parameters.

    Raises SceneError, with the nearest key of the sections or of the items of a ``flat`` scene.
    """
    section, _, name = key.partition(".")
    if section == SECTION:
        return section, name
    if key in schema.paths or key in schema.sections:
        return key, ""
    ends = [path for path in schema.paths if path.endswith(f".{key}")]
    ends = [path for path in ends if path == f"{schema.main}.{key}"] or ends
    if len(ends) > 1:
        raise SceneError(f"{printable(key)} could mean any of {', '.join(ends)}: give one of these")
    if ends:
        return ends[0], ""
    for path in [path for path, entry in schema.paths.items() if isinstance(entry.kind, Numbers)]:
        for start in (f"{path}.", f"{path.rpartition('.')[2]}."):
            if key.startswith(start):
                return path, key.removeprefix(start)
    parameters = (flat or {}).get(SECTION)
    if isinstance(parameters, dict) and key in parameters:
        return SECTION, key
    raise schema.unknown(key, value, flat)


def _named(table: str, items: object) -> dict[str, dict[str, Any]]:
    """The items of a table of a flat scene by their names."""
    tables = enumerate(items if isinstance(items, list) else [], 1)
    return {label_of(table, number, item)[0]: item for number, item in tables if isinstance(item, dict)}


def _find(table: str, rest: str, items: object) -> tuple[dict[str, Any], list[str]]:
    """The item whose name ``rest`` starts with, and the key after the name, which may have dots."""
    names = _named(table, items)
    for name in sorted(names, key=len, reverse=True):
        if rest.startswith(f"{name}."):
            return names[name], rest.removeprefix(f"{name}.").split(".")
    raise unknown(f"the scene has no {table}", rest.partition(".")[0], names)


def _put(item: dict[str, Any], path: list[str], value: object) -> None:
    """Set a key, an entry of a table or a coordinate of a point; a condition replaces no other."""
    *tables, key = path
    for table in tables:
        inner = item.get(table)
        if isinstance(inner, list) and len(inner) == 3 and key in ("x", "y", "z") and table == tables[-1]:
            item[table] = [value if axis == key else old for axis, old in zip("xyz", inner, strict=True)]
            return
        item[table] = item = dict(inner) if isinstance(inner, Mapping) else {}
    item.pop(twin(key), None)
    item[key] = value


def toml_value(text: str) -> object:
    """Return the text as a TOML value, or as it stands: 20um and pad-edge need no quotes."""
    try:
        document = parsed(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return document["value"] if len(document) == 1 else text
