"""A field to be shown, and its renderer, in a process beside this one (``validate.report.figures.offscreen``)."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from concurrent.futures import Future

    import numpy as np

    from compare.verdict import Check
    from compare.worker import Worker

PATIENCE = 120.0
"""Seconds after which a render is given up."""


@dataclass(frozen=True)
class Field:
    """A field to show.

    Attributes
    ----------
    points : (n, 3) in m
    cells : (m, 27) or (m, 10), the points of quadratic hexahedra or tetrahedra, in VTK's order
    rise : (n,) in K, above the first value of the colour scale
    title, under : title of the picture and texts below it
    height : name of the z axis
    scale, above : name of the colour scale, and its first value (K)
    instead : drawn where rendering fails (empty: nothing)
    """

    points: np.ndarray
    cells: np.ndarray
    rise: np.ndarray
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
        self._worker: Worker | None = None
        self._image: Future[Any] | None = None

    def __enter__(self) -> Renderer:
        if self._wanted:
            self.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._worker is not None:
            self._worker.stop()
            self._thread.shutdown(wait=False, cancel_futures=True)

    def start(self) -> None:
        """Start the process, which gets ready while this one solves."""
        from concurrent.futures import ThreadPoolExecutor

        from compare.worker import Worker

        self._worker, self._thread = Worker(), ThreadPoolExecutor(1)
        self._thread.submit(self._worker.run, PATIENCE, _offscreen, "warm_up")

    def send(self, field: Field) -> None:
        """Give the process the field; return at once."""
        if (worker := self._worker) is not None:
            given = field.points, field.cells, field.rise, field.factor
            self._image = self._thread.submit(lambda: worker.run(PATIENCE, _offscreen, "render", *given))

    def image(self) -> np.ndarray | None:
        """(rows, columns, 3) uint8, waited for; ``None`` where it can't be had."""
        image: np.ndarray | None = None
        if self._image is not None:
            with suppress(Exception):
                image = self._image.result(PATIENCE)
        return image


def _offscreen(task: str, *given: object) -> Any:
    """Call a function of the module that draws, in the process that does."""
    from validate.report.figures import offscreen

    return getattr(offscreen, task)(*given)


def exaggeration(points: np.ndarray) -> float:
    """A round factor by which to stretch z, so that the height is about a tenth of the length; at least 1."""
    extent = points.max(axis=0) - points.min(axis=0)
    wanted = 0.08 * max(extent[0], extent[1]) / extent[2]
    return max((float(step) for step in (2, 5, 10, 20, 50, 100, 200, 500, 1000) if step <= wanted), default=1.0)
