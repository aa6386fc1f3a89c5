"""The 3D fields of a free scene as files, by the same writer as those of the sink."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenes.model import AnyScene
from scenes.result import Result
from validate.report import fields


def write_fields(folder: Path, scene: AnyScene, result: Result) -> list[str]:
    """Writes what `fields` writes, rises being above the scene's initial temperature; returns the names.

    Of a transient with output times these are stored, with its start and end.
    """
    asked = np.unique([0.0, *scene.output_times, scene.end_time])
    times = asked if scene.output_times else fields.stored_times(scene.end_time)
    return fields.write_fields(
        folder, result, times[:0] if scene.steady else times, scene.initial_temperature, scene.accuracy
    )
