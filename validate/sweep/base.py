"""The scene that a sweep varies, as a document that can be sent to where it is solved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from scenes import examples, free
from scenes.errors import SceneError, quoted
from scenes.free.loading import values
from scenes.keys import SINK, TYPES
from scenes.loading import as_dict, builtin_text, check, file_name, file_text, toml
from scenes.overrides import override
from scenes.sink import Sink
from scenes.units import UnitError, parse_quantity

if TYPE_CHECKING:
    from scenes.model import AnyScene

Value = float | str
VOLTAGE = "drive.voltage"
"""The key that points may differ in and still share their mesh and fields."""

_DEVICE = {"device", "control", "external"}
_OF_A_FREE_SCENE = {"box", "boundary", "probe", "material", "mesh", "source"}


@dataclass(frozen=True)
class Base:
    """What stands in a scene's file and the ``settings`` ("KEY=VALUE") over it; ``folder`` is where its mesh lies."""

    kind: Literal["sink", "free"]
    name: str
    document: Mapping[str, Any]
    folder: str = ""
    settings: tuple[str, ...] = ()

    def at(self, settings: Sequence[str]) -> Sink | AnyScene:
        """The scene with more settings, checked; raises SceneError."""
        given = (*self.settings, *settings)
        if self.kind == "free":
            return free.from_dict(self.document, self.name, self.folder, given)
        read = SINK.schema.read(override(SINK.schema.flatten(self.document), given, SINK.schema))
        # What a scene expects of its checks is said of that scene alone.
        return check(SINK.schema.apply({"scene.name": self.name} | read | {_EXPECTED: None}, SINK.default))

    def read(self, key: str, text: str) -> tuple[str, Value]:
        """The key by its full name, and a value of it in SI units, or as it stands where it is no number; of keys that
        move together, joined by "+", all their names.

        Raises SceneError for a key that there isn't and a value that it can't have; whether the scene as a whole can
        is another matter.
        """
        if "+" in key:
            read = [self.read(part.strip(), text) for part in key.split("+")]
            return "+".join(name for name, _ in read), read[0][1]
        setting = f"{key}={text}"
        if self.kind == "free":
            values(self.document, (*self.settings, setting))
            try:
                return key, parse_quantity(text)[0]
            except UnitError:
                return key, text
        ((path, given),) = override({}, [setting], SINK.schema).items()
        value = SINK.schema.read({path: given})[path]
        if isinstance(value, Mapping):
            ((item, value),) = value.items()
            path = f"{path}.{item}"
        return path, float(value) if isinstance(value, float | int) else text

    def unit(self, key: str) -> str:
        """The SI unit of a key's numbers, "" where that isn't known."""
        from scenes.kinds import Quantity

        key = key.partition("+")[0]
        if self.kind == "sink":
            found = SINK.schema.paths.get(key)
            return found.kind.dimension.unit if found and isinstance(found.kind, Quantity) else ""
        from scenes.free.loading import schema_of
        from scenes.kinds import Place

        schema = schema_of(self.document)
        table, *_, last = key.split(".")
        kinds = schema.lists.get(table) or {path.rpartition(".")[2]: found.kind for path, found in schema.paths.items()}
        point, coordinate = ([*key.split("."), ""])[-3:-1]
        kind: object = kinds.get(last) or (kinds.get(point) if coordinate in "xyz" else None)
        kind = kind.coordinate if isinstance(kind, Place) else getattr(kind, "quantity", kind)
        return kind.dimension.unit if isinstance(kind, Quantity) else ""


_EXPECTED = "checks.expect_differs"


def base(source: str | Path | Sink | AnyScene, settings: Sequence[str] = ()) -> Base:
    """What `scenes.load`, `scenes.free.load` or their names stand for. Raises SceneError."""
    if isinstance(source, Sink):
        return Base("sink", source.name, as_dict(source), settings=tuple(settings))
    if not isinstance(source, str | Path):
        return Base("free", source.name, free.as_dict(source), str(Path.cwd()), tuple(settings))
    name = str(source)
    known = name in (*TYPES, *examples.names())
    text = builtin_text(name) if known else file_text(source, (SINK.name, *examples.names()))
    document = toml(text, source)
    if _DEVICE & document.keys():
        raise SceneError(f"{quoted(name)} is a device, which has no 3D model to sweep: give a sink or a scene of boxes")
    kind: Literal["sink", "free"] = "free" if _is_free(document) else "sink"
    folder = "" if known else str(Path(source).resolve().parent)
    return Base(kind, name if known else file_name(Path(source)), document, folder, tuple(settings))


def _is_free(document: Mapping[str, Any]) -> bool:
    """Whether a file is of boxes or a mesh: its tables are repeated, where those of a sink stand once."""
    return any(
        isinstance(given, list) or name == "mesh" for name, given in document.items() if name in _OF_A_FREE_SCENE
    )
