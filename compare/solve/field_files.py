"""The 3D fields of a free scene as files, by the same writer as those of the sink."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from compare import fields
from scenes.model import Scene
from scenes.result import Result


def write_fields(folder: Path, scene: Scene, result: Result) -> list[str]:
    """Writes what `compare.fields` writes, rises being above the scene's initial temperature; returns the names."""
    like: Any = SimpleNamespace(
        room_temperature=scene.initial_temperature, end_time=scene.end_time, accuracy=scene.accuracy
    )
    times = fields.stored_times(scene.end_time, scene.output_times)
    return fields.write_fields(folder, cast(Any, like), result, times[:0] if scene.steady else times)
