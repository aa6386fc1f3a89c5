"""Overrides, as given on a command line, put over what a scene file says: "sink.width=20um", "run.accuracy=1e-4", for
an item of a table by its name "boundary.left.voltage=2", and for one coordinate of a point "box.arm.upper.x=9um"."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

from scenes.dimensions import TIME
from scenes.errors import SceneError, did_you_mean, printable, quoted
from scenes.kinds import Instants, Numbers, Quantity
from scenes.schema import Schema, label_of

_COORDINATES = ("x", "y", "z")
_HOW_LONG = ("run.end_time", "run.output_times")


def override(flat: Mapping[str, object], settings: Sequence[str], schema: Schema) -> dict[str, object]:
    """A flat scene with the settings put over it, in their order, so that a later one wins.

    The last parts of a path are enough where they name one key only. How long a run of a free scene lasts is said in
    one way: a setting of it takes the place of what the file says of that, and of those output times that lie beyond.
    Raises SceneError for a setting without "=" or value, for a key that is unknown or not the only one of that name,
    and for an item that does not exist.
    """
    result = dict(flat)
    given: set[str] = set()
    for setting in settings:
        key, equals, text = (part.strip() for part in setting.partition("="))
        if not equals or not key or not text:
            raise SceneError(f"{quoted(setting)} sets nothing: give KEY=VALUE, such as {schema.example}")
        value = toml_value(text)
        table, _, rest = key.partition(".")
        if table in schema.lists:
            if "." not in rest:
                raise SceneError(f"{printable(key)} names no item of a [[{table}]]: give {table}.NAME.KEY")
            result[table] = _with_item(table, rest, value, result.get(table, []))
            continue
        path, item = locate(key, value, schema)
        given.add(path)
        if item:
            tolerances = result.get(path)
            value = {**(tolerances if isinstance(tolerances, Mapping) else {}), item: value}
        result |= schema.flatten({path: value})
    return _of_one_length(result, given) if "run.steady" in schema.paths else result


def _of_one_length(flat: dict[str, object], given: set[str]) -> dict[str, object]:
    """Without what contradicts a steady or an end_time that was ``given``; what else does is refused."""
    if {"run.steady", "run.end_time"} <= given:
        return flat
    if "run.steady" in given and flat["run.steady"] is True:
        return {path: value for path, value in flat.items() if path in given or path not in _HOW_LONG}
    if "run.end_time" in given:
        flat.pop("run.steady", None)
        if "run.output_times" in flat and "run.output_times" not in given:
            end = Quantity(TIME, 0.0, inf).read("run.end_time", flat["run.end_time"]) or 0.0
            times = Instants().read("run.output_times", flat.pop("run.output_times"))
            if within := [time for time in times if time <= end]:
                flat["run.output_times"] = within
    return flat


def locate(key: str, value: object, schema: Schema) -> tuple[str, str]:
    """The path that a key stands for, and the item within it where that is a table of tolerances. Raises SceneError."""
    if key in schema.paths or key in schema.sections:
        return key, ""
    ends = [path for path in schema.paths if path.endswith(f".{key}")]
    if len(ends) > 1:
        raise SceneError(f"{printable(key)} = {quoted(value)} could mean any of {', '.join(ends)}: give one of these")
    if ends:
        return ends[0], ""
    head, _, item = key.rpartition(".")
    for path, entry in schema.paths.items():
        if isinstance(entry.kind, Numbers) and head and (path == head or path.endswith(f".{head}")):
            return path, item
    raise schema.unknown(key, value)


def _with_item(table: str, rest: str, value: object, items: object) -> object:
    """The items of a table with one value in them set."""
    changed = copy.deepcopy(items)
    item, path = _find(table, rest, changed)
    _put(item, path, value)
    return changed


def _find(table: str, rest: str, items: object) -> tuple[dict[str, Any], list[str]]:
    """The item whose name ``rest`` starts with, and the key after it; names may have dots in them."""
    names: dict[str, dict[str, Any]] = {}
    for number, item in enumerate(items if isinstance(items, list) else [], 1):
        if isinstance(item, dict):
            names[label_of(table, number, item)[0]] = item
    for name in sorted(names, key=len, reverse=True):
        if rest.startswith(f"{name}."):
            return names[name], rest.removeprefix(f"{name}.").split(".")
    wanted = rest.rpartition(".")[0]
    known = f"give {', '.join(map(quoted, names))}" if names else "it has none"
    raise SceneError(f"the scene has no {table} {quoted(wanted)}: {known}{did_you_mean(wanted, names)}")


def _put(item: dict[str, Any], path: list[str], value: object) -> None:
    """Sets a key, one within a table such as convection, or a coordinate of a point; a condition given so takes the
    place of no other."""
    *tables, key = path
    for table in tables:
        point = item.get(table)
        if isinstance(point, list) and len(point) == 3 and key in _COORDINATES and table == tables[-1]:
            item[table] = [value if axis == key else old for axis, old in zip(_COORDINATES, point, strict=True)]
            return
        inner = item.get(table)
        item[table] = item = dict(inner) if isinstance(inner, Mapping) else {}
    item[key] = value


def toml_value(text: str) -> object:
    """The text as a TOML value, or as it stands where it is none: 20um and pad-edge need no quotes."""
    try:
        document = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return document["value"] if len(document) == 1 else text
