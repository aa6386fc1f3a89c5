"""A free scene as a TOML file."""

from __future__ import annotations

import json
from typing import Any

from scenes.free.asks import AnyScene
from scenes.free.write import as_dict


def as_toml(scene: AnyScene) -> str:
    """The file that reads back as an equal scene, in SI units."""
    lines: list[str] = []
    for table, given in as_dict(scene).items():
        for item in given if isinstance(given, list) else [given]:
            lines.append(f"[[{table}]]" if isinstance(given, list) else f"[{table}]")
            lines += [f"{key} = {_value(value)}" for key, value in item.items()]
            lines.append("")
    return "\n".join(lines)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    # JSON's strings, booleans and finite numbers are TOML's.
    return json.dumps(value, ensure_ascii=False)
