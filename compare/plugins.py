"""Functions of packages above this one, which register as entry points of the group "compare"."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any

from scenes.errors import SceneError

PLUGINS: dict[str, Callable[..., Any]] = {}
"""By name: "write" writes a results folder, "sweep" solves many designs."""


def plugin(name: str) -> Callable[..., Any]:
    """Return a function by its name. Raises SceneError where no installed package has it."""
    if name not in PLUGINS:
        found = next(iter(entry_points(group="compare", name=name)), None)
        if found is None:
            raise SceneError(f'no installed package has the function "{name}": pip install this project')
        PLUGINS[name] = found.load()
    return PLUGINS[name]
