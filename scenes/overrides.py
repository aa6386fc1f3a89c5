"""Overrides: "sink.width=20um", as given on a command line, put over what a scene file says."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence

from scenes.checks import Tolerances
from scenes.errors import SceneError, printable, quoted
from scenes.schema import Schema


def override(flat: Mapping[str, object], settings: Sequence[str], schema: Schema) -> dict[str, object]:
    """A flat scene with the settings put over it, in their order, so that a later one wins.

    The last parts of a path are enough where they name one key only. Raises SceneError for a setting without "=" or
    value, and for a key that is unknown or not the only one of that name.
    """
    result = dict(flat)
    for setting in settings:
        key, equals, text = (part.strip() for part in setting.partition("="))
        if not equals or not key or not text:
            raise SceneError(f"{quoted(setting)} sets nothing: give KEY=VALUE, such as sink.width=20um")
        value = toml_value(text)
        path, item = _locate(key, value, schema)
        if item:
            table = result.get(path)
            value = {**(table if isinstance(table, Mapping) else {}), item: value}
        result |= schema.flatten({path: value})
    return result


def _locate(key: str, value: object, schema: Schema) -> tuple[str, str]:
    """The path that a key stands for, and the item within it where that is a table of tolerances."""
    if key in schema.paths or key in schema.sections:
        return key, ""
    ends = [path for path in schema.paths if path.endswith(f".{key}")]
    if len(ends) > 1:
        raise SceneError(f"{printable(key)} = {quoted(value)} could mean any of {', '.join(ends)}: give one of these")
    if ends:
        return ends[0], ""
    head, _, item = key.rpartition(".")
    for path, entry in schema.paths.items():
        if isinstance(entry.kind, Tolerances) and head and (path == head or path.endswith(f".{head}")):
            return path, item
    raise schema.unknown(key, value)


def toml_value(text: str) -> object:
    """The text as a TOML value, or as it stands where it is none: 20um and pad-edge need no quotes."""
    try:
        document = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return document["value"] if len(document) == 1 else text
