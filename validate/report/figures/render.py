"""A field to be shown, and its renderer, in a process beside this one (``validate.report.figures.offscreen``)."""

from __future__ import annotations

import io
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from compare.verdict import Check

PATIENCE = 120.0
"""Seconds after which a render is given up."""


@dataclass(frozen=True)
class Field:
    """A field to show.

    Attributes
    ----------
    points : (n, 3) in m
    hexes : (m, 8), numbers of points
    rise : (n,) in K, above the temperature that ``label`` names
    title, under : title of the picture and texts below it
    height : name of the z axis
    scale, above : name of the colour scale, and its first value (K)
    instead : drawn where rendering fails (empty: nothing)
    """

    points: np.ndarray
    hexes: np.ndarray
    rise: np.ndarray
    label: str
    title: str
    height: str
    scale: str
    above: float = 0.0
    under: tuple[Check | str, ...] = ()
    instead: str = ""

    @property
    def factor(self) -> float:
        """The factor that stretches z in the drawing."""
        return exaggeration(self.points)


class Renderer:
    """A context that starts a process early where a picture is ``wanted``, sends it the field, and waits for the image.

    On any failure ``image`` is ``None``: the machine may have no OpenGL.
    """

    def __init__(self, wanted: bool) -> None:
        self._wanted = wanted
        self._process: subprocess.Popen[bytes] | None = None
        self._thread: Thread | None = None
        self._image = b""

    def __enter__(self) -> Renderer:
        if self._wanted:
            self.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def start(self) -> None:
        """Starts the process, which gets ready while this one solves."""
        # The packages may be importable here only because of where this process was started.
        root = str(Path(__file__).parents[3])
        code = f"import sys; sys.path.insert(0, {root!r}); from validate.report.figures.offscreen import main; main()"
        pipe, command = subprocess.PIPE, [sys.executable, "-c", code]
        with suppress(OSError):
            self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL)

    def send(self, field: Field) -> None:
        """Gives the process the field; returns at once."""
        process = self._process
        if process is None:
            return
        import numpy as np

        data = io.BytesIO()
        np.savez(data, points=field.points, hexes=field.hexes, rise=field.rise, factor=field.factor)

        def talk() -> None:
            with suppress(OSError, ValueError):
                self._image = process.communicate(data.getvalue())[0]

        self._thread = Thread(target=talk, daemon=True)
        self._thread.start()

    def image(self) -> np.ndarray | None:
        """(rows, columns, 3) uint8, waited for; ``None`` where it can't be had."""
        import numpy as np

        if self._thread is not None:
            self._thread.join(PATIENCE)
        try:
            return np.load(io.BytesIO(self._image))
        except (ValueError, OSError, EOFError):
            return None


def exaggeration(points: np.ndarray) -> float:
    """A round factor by which to stretch z, so that the height is about a tenth of the length; at least 1."""
    extent = points.max(axis=0) - points.min(axis=0)
    wanted = 0.08 * max(extent[0], extent[1]) / extent[2]
    steps = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
    return float(max([step for step in steps if step <= wanted] or [1]))
