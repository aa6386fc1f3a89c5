"""Imports, a first solve and one at a second voltage in one fresh process, in wall-clock time: ``options`` are the
accuracy. The worker's first solve is what counts; it is never repeated."""

from __future__ import annotations

import time

_STARTED = time.perf_counter()
import skfem  # noqa: E402, F401 - timed

_IMPORTED = time.perf_counter() - _STARTED

from collections.abc import Callable  # noqa: E402
from dataclasses import replace  # noqa: E402
from typing import Any  # noqa: E402

import scipy.sparse.linalg  # noqa: E402, F401 - not part of the solve

from fem3d import run  # noqa: E402
from scenes.loading import load  # noqa: E402
from scenes.plan import Request  # noqa: E402


def prepare(
    options: dict[str, Any],
) -> tuple[Callable[[], dict[str, float]], Callable[[dict[str, float]], dict[str, Any]]]:
    """Solve at one voltage, then at twice that with what is known."""
    sink = load("sink", [f"accuracy={options['accuracy']}"])

    def solve() -> dict[str, float]:
        started = time.perf_counter()
        first = run.solve(sink, Request())
        solved = time.perf_counter() - started
        started = time.perf_counter()
        run.solve(replace(sink, voltage=2 * sink.voltage), Request(), earlier=first)
        return {"import_s": _IMPORTED, "solved_s": solved, "again_s": time.perf_counter() - started}

    return solve, lambda found: dict(found)
