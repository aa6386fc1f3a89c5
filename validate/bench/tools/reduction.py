"""This toolkit's 1D models of the sink, as users call them: ``options`` are ``transient`` and the ``reduction``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from reduced1d import ladder
from scenes.loading import load
from scenes.result import Result
from validate.bench.problem import read


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Result], Callable[[Result], dict[str, Any]]]:
    """Solve, and read the numbers."""
    sink, name, steady = load("sink", []), options["reduction"], not options["transient"]
    # The plate's states are modes of its unknowns; the others have no mesh, or only borrow from the plate's.
    size = "unknowns" if name == "plate" else "states"

    def numbers(result: Result) -> dict[str, Any]:
        return read(result, sink) | {"unknowns": result.details[size], "steps": 0, "claimed": None}

    return lambda: ladder.solve(sink, name, steady_only=steady), numbers
