"""Reading a free scene: from a TOML file or one of the examples, with overrides, checked; and writing it back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from scenes import examples
from scenes.free import build, document
from scenes.free.overrides import override
from scenes.free.validity import check
from scenes.free.write import as_dict
from scenes.loading import file_name, file_text, toml
from scenes.model import Scene

__all__ = ["as_dict", "check", "from_dict", "load"]


def load(source: str | Path, overrides: Sequence[str] = ()) -> Scene:
    """The scene of a file, with what "KEY=VALUE" overrides say put over it, checked.

    ``source`` is the name of an example or a path to a TOML file; a scene without a name is called after its file.
    Raises SceneError.
    """
    example = isinstance(source, str) and source in examples.names()
    text = examples.text(str(source)) if example else file_text(source, examples.names())
    return from_dict(override(toml(text, source), overrides), str(source) if example else file_name(Path(source)))


def from_dict(given: Mapping[str, Any], name: str = "scene") -> Scene:
    """The scene of nested tables such as `as_dict` returns, checked; raises SceneError."""
    return check(build.build(document.read(given), name))
