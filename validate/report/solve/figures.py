"""The figures of a free scene: traces over time and the temperature field."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from validate.report.figures.drawing import save, style
from validate.report.figures.render import Renderer
from validate.report.solve import field_figure, trace_figure

if TYPE_CHECKING:
    from compare.solve.outcome import SolveOutcome


def draw(
    outcome: SolveOutcome, names: list[str], folder: Path, renderer: Renderer
) -> tuple[list[str], dict[str, str]]:  # fmt: skip
    """Draws the named figures into a folder as .png and .svg.

    Returns the files' names, and of each figure that could not be drawn, why.
    """
    scene, result = outcome.scene, outcome.result
    files: list[str] = []
    notes: dict[str, str] = {}
    with style():
        if "traces" in names:
            files += save(trace_figure.draw(scene, result), folder, "figure_traces")
        # Last, because the picture comes from a process of its own.
        if "field" in names:
            image = renderer.image()
            if image is None:
                notes["field"] = "no OpenGL to render with"
            else:
                files += save(field_figure.draw(outcome, image, renderer.factor), folder, "figure_field")
    return files, notes
