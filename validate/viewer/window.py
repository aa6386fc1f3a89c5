"""Draw a picture, a film or a window in a process of its own: VTK without a working OpenGL may end its process."""

from __future__ import annotations

import math
import os
import sys
from importlib import import_module
from typing import Any

from compare.worker import EndedError, Worker


class NoGraphicsError(ArithmeticError):
    """The machine cannot draw; everything else still works."""


def start(module: str, request: dict[str, Any]) -> list[str]:
    """Draw a request by a module of the viewer and return notes.

    ``off_screen`` says whether a window opens. Raises SceneError for bad input, NoGraphicsError without OpenGL.
    """
    if not request["off_screen"] and sys.platform.startswith("linux"):
        if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise NoGraphicsError("there is no display to open a window on: give --screenshot FILE")
    try:
        return Worker("the viewer").run(math.inf, _draw, module, request)
    except (EndedError, ImportError) as error:
        raise NoGraphicsError(
            f"the viewer could not draw here ({error}): it needs whole files, and OpenGL or a VTK with software "
            "rendering; report.html shows the field without the viewer"
        ) from None


def _draw(module: str, request: dict[str, Any]) -> list[str]:
    """Load pyvista and draw, in the process that does."""
    notes: list[str] = import_module(f"validate.viewer.{module}").draw(request)
    return notes
