"""The scene that a sweep varies, as a document that can be sent to where it is solved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from scenes import examples, free
from scenes.any import type_of_file
from scenes.errors import SceneError, quoted
from scenes.free import schema_of
from scenes.keys import DEVICE, SINK, TYPES
from scenes.kinds import Count, Quantity
from scenes.loading import as_dict, builtin_text, check, file_name, file_text, toml
from scenes.model import AnyScene
from scenes.overrides import locate, override
from scenes.schema import Schema
from scenes.sink import Sink
from scenes.units import UnitError, parse_quantity

Value = float | str
VOLTAGE = "drive.voltage"
"""The key that points may differ in and still share their mesh and fields."""


@dataclass(frozen=True)
class Base:
    """What stands in a scene's file and the ``settings`` ("KEY=VALUE") over it; ``folder`` is where its mesh lies."""

    kind: Literal["sink", "free"]
    name: str
    document: Mapping[str, Any]
    folder: str = ""
    settings: tuple[str, ...] = ()

    @property
    def schema(self) -> Schema:
        """What the scene's file may say."""
        return SINK.schema if self.kind == "sink" else schema_of(self.document)

    def at(self, settings: Sequence[str]) -> Sink | AnyScene:
        """The scene with more settings, checked; raises SceneError."""
        if self.kind == "free":
            return free.from_dict(self.document, self.name, self.folder, (*self.settings, *settings))
        # What a scene expects of its checks is said of that scene alone.
        read = {"scene.name": self.name} | self._read(settings) | {"checks.expect_differs": None}
        return check(SINK.schema.apply(read, SINK.default))

    def read(self, key: str, text: str) -> tuple[str, Value]:
        """The key by its full name, and a value of it in SI units, or as it stands where it is no number; of keys that
        move together, joined by "+", all their names.

        Raises SceneError for a key that there isn't and a value that it can't have; whether the scene as a whole can
        is another matter.
        """
        if "+" in key:
            read = [self.read(part.strip(), text) for part in key.split("+")]
            return "+".join(name for name, _ in read), read[0][1]
        self._read([f"{key}={text}"])
        if key.partition(".")[0] not in self.schema.lists:
            key = ".".join(filter(None, locate(key, text, self.schema)))
        try:
            return key, parse_quantity(text)[0]
        except UnitError:
            return key, text

    def counts(self, key: str) -> bool:
        """Whether a key takes whole numbers only."""
        path = key.partition("+")[0]
        return path in self.schema.paths and isinstance(self.schema.paths[path].kind, Count)

    def unit(self, key: str) -> str:
        """The SI unit of a key's numbers, "" where that isn't known."""
        key = key.partition("+")[0]
        table, *inner, last = key.split(".")
        if key in self.schema.paths:
            kind: object = self.schema.paths[key].kind
        else:
            kinds = self.schema.lists.get(table, {})
            kind = kinds.get(last) or (kinds.get(inner[-1]) if inner and last in "xyz" else None)
        # Of a point its coordinates, of a value that may vary what varies.
        kind = getattr(kind, "coordinate", getattr(kind, "quantity", kind))
        return kind.dimension.unit if isinstance(kind, Quantity) else ""

    def _read(self, settings: Sequence[str]) -> dict[str, Any]:
        """The values of the document with all settings, by path."""
        flat = self.schema.flatten(self.document)
        return self.schema.read(override(flat, (*self.settings, *settings), self.schema))


def base(source: str | Path | Sink | AnyScene, settings: Sequence[str] = ()) -> Base:
    """What `scenes.load`, `scenes.free.load` or their names stand for. Raises SceneError."""
    if isinstance(source, Sink):
        return Base("sink", source.name, as_dict(source), settings=tuple(settings))
    if not isinstance(source, str | Path):
        return Base("free", source.name, free.as_dict(source), str(Path.cwd()), tuple(settings))
    name = str(source)
    known = name in (*TYPES, *examples.names())
    document = toml(builtin_text(name) if known else file_text(source, (SINK.name, *examples.names())), source)
    of = type_of_file(document)
    if of is DEVICE:
        raise SceneError(f"{quoted(name)} is a device, which has no 3D model to sweep: give a sink or a scene of boxes")
    folder = "" if known else str(Path(source).resolve().parent)
    kind: Literal["sink", "free"] = "free" if of is None else "sink"
    return Base(kind, name if known else file_name(Path(source)), document, folder, tuple(settings))
