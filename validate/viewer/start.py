"""Runs the process that draws, and says in a sentence what became of it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from scenes.errors import SceneError


class NoGraphicsError(ArithmeticError):
    """The machine cannot draw; everything else still works."""


def start(request: dict[str, Any], progress: Callable[[str], None]) -> list[str]:
    """Draws what is asked and returns what there is to be said of it; SceneError for bad input, NoGraphicsError where
    the machine cannot draw."""
    if not request["off_screen"] and sys.platform.startswith("linux"):
        if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise NoGraphicsError(
                "there is no display to open a window on: give --screenshot FILE or --movie FILE, or open the run's "
                "report.html"
            )
    progress("starting the viewer")
    # The packages may be importable here only because of where this process was started.
    root = str(Path(__file__).parents[2])
    code = f"import sys; sys.path.insert(0, {root!r}); from validate.viewer.window import main; sys.exit(main())"
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stderr is not None
    notes = []
    try:
        process.stdin.write(json.dumps(request))
        process.stdin.close()
        for line in process.stdout:
            if line.startswith("film "):
                progress(f"drawing {line.strip()}")
            elif line.startswith("note "):
                notes.append(line.removeprefix("note ").strip())
        said = process.stderr.read()
        status = process.wait()
    except BaseException:
        process.kill()
        process.wait()
        raise
    fault = next((line for line in said.splitlines() if line.startswith("fault: ")), None)
    if fault is not None:
        raise SceneError(fault.removeprefix("fault: "))
    if "Traceback" in said and "ImportError" not in said:
        # A fault here, which is not the machine's.
        raise RuntimeError(f"the viewer ended: {_why(status, said)}")
    missing = [name for name in (request["screenshot"], request["movie"]) if name and not Path(name).exists()]
    if status != 0 or missing:
        raise NoGraphicsError(
            f"the viewer could not draw here ({_why(status, said)}): pyvista needs OpenGL, or a VTK with software "
            "rendering; the run's files are whole, and its report.html shows the field without it"
        )
    return notes


def _why(status: int, said: str) -> str:
    """The last thing that the process said, or how it ended."""
    last = next((line.strip() for line in reversed(said.splitlines()) if line.strip()), "")
    if status < 0:
        return f"its process was ended by signal {-status}"
    return last[:120] if last else f"its process ended with status {status}"
