"""A scene file as tables of values: what stands in it, each key known and each value read by its kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scenes.errors import SceneError, did_you_mean, printable, quoted
from scenes.kinds import Readable


@dataclass(frozen=True)
class Item:
    """One [[table]]: its name, what messages call it, and the values of the keys that it has."""

    name: str
    label: str
    values: dict[str, Any]


@dataclass(frozen=True)
class Document:
    """The values of a file: those of the single tables by table and key, and the items of the repeated ones."""

    sections: dict[str, dict[str, Any]]
    items: dict[str, tuple[Item, ...]]


@dataclass(frozen=True)
class Tables:
    """What a kind of file may say: the keys of the tables that it has once and of those it may have many of, with those
    of the latter that have no default. ``called`` names the kind in messages."""

    called: str
    sections: dict[str, dict[str, Readable]]
    lists: dict[str, dict[str, Readable]]
    required: dict[str, tuple[str, ...]]


def read(document: Mapping[str, object], tables: Tables) -> Document:
    """The values of a nested document; raises SceneError for what is unknown, missing, of the wrong type or out of
    bounds, and for a name that is given twice."""
    for name, given in document.items():
        if name not in tables.sections and name not in tables.lists:
            known = [*(f"[{s}]" for s in tables.sections), *(f"[[{t}]]" for t in tables.lists)]
            kind = "table" if isinstance(given, (Mapping, list)) else "key"
            hint = did_you_mean(str(name), (*tables.sections, *tables.lists))
            raise SceneError(f"unknown {kind} {printable(str(name))}: {tables.called} takes {', '.join(known)}{hint}")
    sections = {}
    for section, kinds in tables.sections.items():
        table = document.get(section, {})
        if not isinstance(table, Mapping):
            raise SceneError(f"{section} = {quoted(table)} must be a section: [{section}] takes {', '.join(kinds)}")
        sections[section] = _values(section, f"[{section}]", table, kinds)
    return Document(sections, {name: _items(name, document.get(name, []), tables) for name in tables.lists})


def label_of(table: str, number: int, given: object) -> tuple[str, str]:
    """The name of an item and what messages call it: box "arm", or box[2] where it has no name."""
    named = isinstance(given, Mapping) and isinstance(given.get("name"), str)
    name = str(given["name"]) if named and isinstance(given, Mapping) else f"{table}-{number}"
    return name, f"{table} {quoted(name)}" if named else f"{table}[{number}]"


def _items(table: str, given: object, tables: Tables) -> tuple[Item, ...]:
    if not isinstance(given, (list, tuple)) or not all(isinstance(item, Mapping) for item in given):
        raise SceneError(f"{table} must be a list of tables: start each with [[{table}]]")
    found: dict[str, Item] = {}
    for number, item in enumerate(given, 1):
        name, label = label_of(table, number, item)
        values = _values(label, f"[[{table}]]", item, tables.lists[table])
        for key in tables.required[table]:
            if key not in values:
                needs = " and ".join(tables.required[table])
                raise SceneError(f"{label}.{key} is missing: every [[{table}]] needs {needs}")
        if name in found:
            raise SceneError(f"{table}[{number}].name = {quoted(name)} is taken: give every {table} a name of its own")
        found[name] = Item(name, label, values)
    return tuple(found.values())


def _values(path: str, table: str, given: Mapping[Any, object], kinds: Mapping[str, Readable]) -> dict[str, Any]:
    found = {}
    for key, value in given.items():
        if key not in kinds:
            raise SceneError(
                f"unknown key {path}.{printable(str(key))} = {quoted(value)}: {table} takes {', '.join(kinds)}"
                f"{did_you_mean(str(key), kinds)}"
            )
        found[key] = kinds[key].read(f"{path}.{key}", value)
    return found
