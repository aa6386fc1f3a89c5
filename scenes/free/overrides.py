"""Overrides of a free scene: "run.accuracy=1e-4", "boundary.left.voltage=2" for an item by its name, and for one
coordinate of a point "box.arm.upper.x=9um"."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

from scenes.dimensions import TIME
from scenes.errors import SceneError, did_you_mean, printable, quoted
from scenes.free.document import Tables, label_of
from scenes.free.kinds import Instants
from scenes.kinds import Quantity
from scenes.overrides import toml_value

_COORDINATES = ("x", "y", "z")


def override(document: Mapping[str, Any], settings: Sequence[str], tables: Tables) -> dict[str, Any]:
    """A nested document with the settings put over it, in their order; the one that is given stays as it is.

    How long a run lasts is said in one way: a setting of it takes the place of what the document says of that, and of
    those output times that lie beyond. Raises SceneError for a setting without "=" or value, and for a table or an item
    that does not exist.
    """
    found = copy.deepcopy(dict(document))
    for setting in settings:
        key, equals, text = (part.strip() for part in setting.partition("="))
        if not equals or not key or not text:
            raise SceneError(f"{quoted(setting)} sets nothing: give KEY=VALUE, such as run.accuracy=1e-4")
        table, _, rest = key.partition(".")
        if table in tables.sections and rest:
            section = found.setdefault(table, {})
            if isinstance(section, dict):
                section[rest] = toml_value(text)
        elif table in tables.lists and "." in rest:
            item, path = _find(table, rest, found.get(table, []))
            _put(item, path, toml_value(text))
        else:
            known = [*(f"{s}.KEY" for s in tables.sections), *(f"{t}.NAME.KEY" for t in tables.lists)]
            raise SceneError(
                f"{printable(key)} = {quoted(text)} is not a key of {tables.called}: give {', '.join(known)}"
                f"{did_you_mean(table, (*tables.sections, *tables.lists))}"
            )
    _time(found, {setting.partition("=")[0].strip() for setting in settings})
    return found


def _time(found: dict[str, Any], given: set[str]) -> None:
    """Leaves out of [run] what contradicts a steady or an end_time that was ``given``; what else does is refused."""
    run = found.get("run")
    if not isinstance(run, dict) or {"run.steady", "run.end_time"} <= given:
        return
    if "run.steady" in given and run["steady"] is True:
        found["run"] = {
            key: v for key, v in run.items() if key not in ("end_time", "output_times") or f"run.{key}" in given
        }
    elif "run.end_time" in given:
        run.pop("steady", None)
        if "output_times" in run and "run.output_times" not in given:
            end = Quantity(TIME, 0.0, inf).read("run.end_time", run["end_time"]) or 0.0
            run["output_times"] = [t for t in Instants().read("run.output_times", run["output_times"]) if t <= end]
            if not run["output_times"]:
                del run["output_times"]


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
