"""A schema: the table of the keys that one type of scene file may have, and reading and writing by it.

A *path* is a key's full name, section and all: "materials.silicon.density". A *flat* scene maps paths to what stands in
the file, and the name of a table that a file may have many of, "box", to the list of them; its *values* map the same to
what has been read from that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from operator import attrgetter
from typing import Any, TypeVar

from scenes.errors import SceneError, did_you_mean, nearest, printable, quoted
from scenes.kinds import Kind

T = TypeVar("T")


@dataclass(frozen=True)
class Key:
    """One key: its path in a file, the kind of its value and the (dotted) attribute of the scene that holds it.

    ``physical`` is false for what does not change the thing that is solved.
    """

    path: str
    attribute: str
    kind: Kind
    physical: bool = True


@dataclass(frozen=True)
class Item:
    """One [[table]]: its name, what messages call it, and the values of the keys that it has."""

    name: str
    label: str
    values: dict[str, Any]


@dataclass(frozen=True)
class Schema:
    """The keys of one type of scene, in the order in which they are written, and those of the ``lists``, tables that a
    file may have many of, with those of them that are ``required``. ``called`` names the type in messages, for which
    ``example`` is a setting."""

    keys: tuple[Key, ...]
    lists: Mapping[str, Mapping[str, Kind]] = field(default_factory=dict)
    required: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    called: str = "a scene file"
    example: str = "sink.width=20um"

    @cached_property
    def paths(self) -> dict[str, Key]:
        """The keys by path."""
        return {key.path: key for key in self.keys}

    @cached_property
    def sections(self) -> dict[str, tuple[str, ...]]:
        """What every section takes, keys, sections or tables, by the section's path; "" is the whole file."""
        found: dict[str, dict[str, None]] = {}
        for path in self.paths:
            while path:
                parent, _, name = path.rpartition(".")
                found.setdefault(parent, {})[name] = None
                path = parent
        found[""] |= dict.fromkeys(self.lists)
        return {section: tuple(names) for section, names in found.items()}

    def flatten(self, document: Mapping[str, object], section: str = "") -> dict[str, object]:
        """What a (nested) document says, by path; raises SceneError for an unknown key or section."""
        flat: dict[str, object] = {}
        for name, given in document.items():
            path = f"{section}.{name}" if section else str(name)
            if path in self.paths or path in self.lists:
                flat[path] = given
            elif path not in self.sections:
                raise self.unknown(path, given)
            elif isinstance(given, Mapping):
                flat |= self.flatten(given, path)
            else:
                raise SceneError(f"{path} = {quoted(given)} must be a section: {self._takes(path)}")
        return flat

    def read(self, flat: Mapping[str, object]) -> dict[str, Any]:
        """The values of a flat scene in SI units, tables as tuples of items.

        Raises SceneError for what is missing, of the wrong type or out of bounds, and for a name that is given twice.
        """
        return {
            path: self._items(path, given) if path in self.lists else self.paths[path].kind.read(path, given)
            for path, given in flat.items()
        }

    def _items(self, table: str, given: object) -> tuple[Item, ...]:
        if not isinstance(given, (list, tuple)) or not all(isinstance(item, Mapping) for item in given):
            raise SceneError(f"{table} must be a list of tables: start each with [[{table}]]")
        kinds, found = self.lists[table], dict[str, Item]()
        for number, item in enumerate(given, 1):
            name, label = label_of(table, number, item)
            for key, value in item.items():
                if key not in kinds:
                    raise SceneError(
                        f"unknown key {label}.{printable(str(key))} = {quoted(value)}: [[{table}]] takes "
                        f"{', '.join(kinds)}{did_you_mean(str(key), kinds)}"
                    )
            values = {key: kinds[key].read(f"{label}.{key}", value) for key, value in item.items()}
            for key in self.required[table]:
                if key not in values:
                    needs = " and ".join(self.required[table])
                    raise SceneError(f"{label}.{key} is missing: every [[{table}]] needs {needs}")
            if name in found:
                raise SceneError(
                    f"{table}[{number}].name = {quoted(name)} is taken: give every {table} a name of its own"
                )
            found[name] = Item(name, label, values)
        return tuple(found.values())

    def apply(self, values: Mapping[str, Any], default: T) -> T:
        """The default scene (a frozen dataclass) with the values put in its attributes."""
        return _replaced(default, {self.paths[path].attribute: value for path, value in values.items()})

    def write(self, scene: object) -> dict[str, Any]:
        """Every key of a scene as a flat scene that reads back equal: SI numbers and plain JSON types."""
        return {path: key.kind.write(attrgetter(key.attribute)(scene)) for path, key in self.paths.items()}

    def unknown(self, path: str, given: object) -> SceneError:
        """The error for a path that is neither a key nor a section, with the nearest that is."""
        section = path
        while section not in self.sections:
            section = section.rpartition(".")[0]
        first, _, rest = path.removeprefix(section).lstrip(".").partition(".")
        candidates = {} if rest else {p.rpartition(".")[2]: p for p in self.paths}
        candidates |= {name: f"{section}.{name}".lstrip(".") for name in self.sections[section]}
        near = nearest(first, candidates)
        hint = f', did you mean "{candidates[near]}"?' if near else ""
        if isinstance(given, Mapping):
            what = f"section [{printable(path)}]"
        elif self.lists and isinstance(given, list):
            what = f"table {printable(path)}"
        else:
            what = f"key {printable(path)} = {quoted(given)}"
        return SceneError(f"unknown {what}: {self._takes(section)}{hint}")

    def _takes(self, section: str) -> str:
        name = f"[{section}]" if section else self.called
        taken = (f"[[{n}]]" if not section and n in self.lists else n for n in self.sections[section])
        return f"{name} takes {', '.join(taken)}"


def label_of(table: str, number: int, given: Mapping[str, object]) -> tuple[str, str]:
    """The name of an item and what messages call it: box "arm", or box[2] where it has no name."""
    name = given.get("name")
    if isinstance(name, str):
        return name, f"{table} {quoted(name)}"
    return f"{table}-{number}", f"{table}[{number}]"


def _replaced(default: T, attributes: Mapping[str, Any]) -> T:
    """A frozen dataclass with new values for attributes of it and, where there are dots, of its parts."""
    own: dict[str, Any] = {}
    parts: dict[str, dict[str, Any]] = {}
    for attribute, value in attributes.items():
        head, _, tail = attribute.partition(".")
        if tail:
            parts.setdefault(head, {})[tail] = value
        else:
            own[head] = value
    own |= {head: _replaced(getattr(default, head), part) for head, part in parts.items()}
    return replace(default, **own)  # type: ignore[type-var]


def nest(flat: Mapping[str, Any]) -> dict[str, Any]:
    """A flat scene as nested sections."""
    nested: dict[str, Any] = {}
    for path, value in flat.items():
        *sections, name = path.split(".")
        inner = nested
        for section in sections:
            inner = inner.setdefault(section, {})
        inner[name] = value
    return nested


def section(values: Mapping[str, Any], name: str) -> dict[str, Any]:
    """The values of one section, by key."""
    return {key.removeprefix(f"{name}."): value for key, value in values.items() if key.startswith(f"{name}.")}
