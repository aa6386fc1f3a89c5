"""A schema: the table of the keys that one type of scene file may have, and reading and writing by it.

A *path* is a key's full name, section and all: "materials.silicon.density". A *flat* scene maps paths to what stands in
the file; its *values* map the same paths to what has been read from that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter
from typing import Any, TypeVar

from scenes.errors import SceneError, nearest, printable, quoted
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
class Schema:
    """The keys of one type of scene, in the order in which they are written."""

    keys: tuple[Key, ...]

    @cached_property
    def paths(self) -> dict[str, Key]:
        """The keys by path."""
        return {key.path: key for key in self.keys}

    @cached_property
    def sections(self) -> dict[str, tuple[str, ...]]:
        """What every section takes, keys or sections, by the section's path; "" is the whole file."""
        found: dict[str, dict[str, None]] = {}
        for path in self.paths:
            while path:
                parent, _, name = path.rpartition(".")
                found.setdefault(parent, {})[name] = None
                path = parent
        return {section: tuple(names) for section, names in found.items()}

    def flatten(self, document: Mapping[str, object], section: str = "") -> dict[str, object]:
        """What a (nested) document says, by path; raises SceneError for an unknown key or section."""
        flat: dict[str, object] = {}
        for name, given in document.items():
            path = f"{section}.{name}" if section else str(name)
            if path in self.paths:
                flat[path] = given
            elif path not in self.sections:
                raise self.unknown(path, given)
            elif isinstance(given, Mapping):
                flat |= self.flatten(given, path)
            else:
                raise SceneError(f"{path} = {quoted(given)} must be a section: {self._takes(path)}")
        return flat

    def read(self, flat: Mapping[str, object]) -> dict[str, Any]:
        """The values of a flat scene in SI units; raises SceneError."""
        return {path: self.paths[path].kind.read(path, given) for path, given in flat.items()}

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
        what = f"section [{printable(path)}]" if isinstance(given, Mapping) else f"key {printable(path)}"
        value = "" if isinstance(given, Mapping) else f" = {quoted(given)}"
        return SceneError(f"unknown {what}{value}: {self._takes(section)}{hint}")

    def _takes(self, section: str) -> str:
        name = f"[{section}]" if section else "a scene file"
        return f"{name} takes {', '.join(self.sections[section])}"


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
