"""The 3D fields of a free scene as files, by the same writer as those of the sink."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from compare import fields
from scenes.model import Scene
from scenes.result import Result

TIMES = 13
"""Of a transient without output times: how many instants are stored, evenly spaced from start to end."""


def write_fields(folder: Path, scene: Scene, result: Result) -> list[str]:
    """Writes what `compare.fields` writes, of the steady state, or of the start, each output time and the end; rises
    are above the scene's initial temperature. Returns the files' names."""
    times = np.empty(0) if scene.steady else stored_times(scene)
    return fields.write_fields(folder, scene.initial_temperature, scene.accuracy, result, times)


def stored_times(scene: Scene) -> np.ndarray:
    """The instants (s) whose fields are kept."""
    asked = scene.output_times or tuple(np.linspace(0.0, scene.end_time, TIMES).tolist())
    return np.array(sorted({0.0, *asked, scene.end_time}))
