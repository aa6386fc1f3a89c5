"""Reading the parametric scenes: built-in or from a TOML file, with overrides, checked; and writing them back."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, overload

from scenes import examples
from scenes.errors import SceneError, did_you_mean, quoted, reason
from scenes.keys import SINK, TYPES, SceneType, type_of
from scenes.overrides import override
from scenes.schema import nest
from scenes.sink import Sink
from scenes.slug import distinguishes
from scenes.validity import check

__all__ = ["as_dict", "builtin_names", "builtin_text", "check", "distinguishes", "from_dict", "load"]

T = TypeVar("T")
_BUILTIN = tuple(TYPES)
_EXPECTED = "checks.expect_differs"


@overload
def load(source: str | Path, overrides: Sequence[str] = ()) -> Sink: ...
@overload
def load(source: str | Path, overrides: Sequence[str] = (), *, of: SceneType[T]) -> T: ...
def load(source: str | Path, overrides: Sequence[str] = (), *, of: SceneType[Any] = SINK) -> Any:
    """The scene of a file, with what "KEY=VALUE" overrides say put over it, checked.

    ``source`` is the name of the built-in scene of the type ``of``, or a path to a TOML file; what a file leaves out
    has its default, and a scene without a name is called after its file. The checks that a scene expects to differ are
    a statement about that scene: an override of anything physical withdraws it (``expected_to_differ`` is then
    ``None``), unless an override says what is expected now. Raises SceneError.
    """
    name = source if isinstance(source, str) and source == of.name else file_name(Path(source))
    return _built({"scene.name": name} | of.schema.flatten(_document(source, of)), overrides, of)


def overridden(scene: T, overrides: Sequence[str]) -> T:
    """A scene with "KEY=VALUE" overrides put over it as ``load`` puts them, checked; raises SceneError."""
    of = type_of(scene)
    return _built(of.schema.write(scene), overrides, of)


def _built(flat: Mapping[str, Any], overrides: Sequence[str], of: SceneType[Any]) -> Any:
    schema = of.schema
    before, values = schema.read(flat), schema.read(override(flat, overrides, schema))
    if _physical(before, of) != _physical(values, of) and _EXPECTED not in override({}, overrides, schema):
        values[_EXPECTED] = None
    return check(schema.apply(values, of.default))


@overload
def from_dict(document: Mapping[str, Any]) -> Sink: ...
@overload
def from_dict(document: Mapping[str, Any], of: SceneType[T]) -> T: ...
def from_dict(document: Mapping[str, Any], of: SceneType[Any] = SINK) -> Any:
    """The scene of nested sections such as ``as_dict`` returns, checked; raises SceneError."""
    return check(of.schema.apply(of.schema.read(of.schema.flatten(document)), of.default))


def as_dict(scene: object) -> dict[str, Any]:
    """Every key of a scene by section, as plain JSON types in SI units; ``from_dict`` gives an equal scene back."""
    return nest(type_of(scene).schema.write(scene))


def builtin_names() -> tuple[str, ...]:
    """The names of the parametric scenes that come with the toolkit."""
    return _BUILTIN


def known_names() -> tuple[str, ...]:
    """The same, with the examples of free scenes."""
    return (*_BUILTIN, *examples.names())


def builtin_text(name: str) -> str:
    """A built-in scene as commented TOML, to copy and edit; raises SceneError for an unknown name."""
    if name in examples.names():
        return examples.text(name)
    if name not in _BUILTIN:
        known = known_names()
        raise SceneError(
            f"{quoted(name)} is not a built-in scene: give {' or '.join(known)}{did_you_mean(name, known)}"
        )
    return Path(__file__).with_name(f"{name}.toml").read_text(encoding="utf-8")


def _document(source: str | Path, of: SceneType[Any]) -> dict[str, Any]:
    """The TOML document of a built-in scene or a file."""
    builtin = isinstance(source, str) and source == of.name
    return toml(builtin_text(str(source)) if builtin else file_text(source, (of.name,)), source)


def toml(text: str, source: str | Path) -> dict[str, Any]:
    """The document of a TOML text that came from somewhere; raises SceneError."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise SceneError(f"{quoted(Path(source))} is not valid TOML: {reason(error)}") from None


def file_text(source: str | Path, known: Sequence[str]) -> str:
    """The text of a scene file; ``known`` are the built-in scenes that could be given instead. Raises SceneError."""
    shown, instead = quoted(Path(source)), " or ".join(known)
    try:
        # A byte order mark, which some editors write, is no part of the text.
        return Path(source).read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        hint = did_you_mean(str(source), known)
        raise SceneError(f"{shown} is no file: give a TOML file, or the built-in {instead}{hint}") from None
    except IsADirectoryError:
        raise SceneError(f"{shown} is a directory: give a TOML file, or the built-in {instead}") from None
    except UnicodeDecodeError as error:
        raise SceneError(f"{shown} is not UTF-8 text (byte {error.start}): save the TOML file as UTF-8") from None
    except (OSError, ValueError) as error:
        raise SceneError(f"{shown} cannot be read: {reason(error)}") from None


def file_name(path: Path) -> str:
    """A name for a scene that has none: the file's, without what a name may not have."""
    return re.sub(r"[^\w .-]", "_", path.stem)[:60].strip(" .-") or "scene"


def _physical(values: Mapping[str, Any], of: SceneType[Any]) -> dict[str, Any]:
    """What says what is solved, with a default standing for what is left out."""
    written = of.schema.write(of.schema.apply(values, of.default))
    return {path: written[path] for path, key in of.schema.paths.items() if key.physical}
