"""Figures 4 to 7 of the paper, with both models in them and the verdicts of their checks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from validate.report.figures import field_figure, profile_figure, time_figures
from validate.report.figures.drawing import save, style
from validate.report.figures.render import Renderer

if TYPE_CHECKING:
    from compare.outcome import Outcome


def draw(outcome: Outcome, names: list[str], folder: Path, renderer: Renderer) -> tuple[list[str], dict[str, str]]:
    """Draws the named figures, and the budget's where there is one, into a folder as .png and .svg.

    Returns the files' names, and of each figure that was drawn other than planned, how.
    """
    files: list[str] = []
    notes: dict[str, str] = {}
    with style():
        if "figure5" in names:
            files += save(profile_figure.draw(outcome), folder, "figure5")
        if "figure6" in names:
            files += save(time_figures.rises(outcome), folder, "figure6")
        if "figure7" in names:
            files += save(time_figures.current(outcome), folder, "figure7")
        if outcome.why is not None:
            from validate.report.figures import why_figure

            files += save(why_figure.draw(outcome), folder, "why")
        # Last, because the picture comes from a process of its own.
        if "figure4" in names:
            image = renderer.image()
            if image is None:
                notes["figure4"] = "the steady temperature of the top faces, from above: no OpenGL to render in 3D with"
            files += save(field_figure.draw(outcome, image, renderer.factor), folder, "figure4")
    return sorted(files), notes
