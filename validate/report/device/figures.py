"""Figures 9 to 13 of the paper, each with what the paper says of it and whether that came out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from validate.report.device import response_figures, step_figures
from validate.report.figures.drawing import save, style

if TYPE_CHECKING:
    from compare.device.outcome import DeviceOutcome

DRAWN: dict[str, Callable[[DeviceOutcome], Figure]] = {
    "figure9": response_figures.power,
    "figure10": response_figures.flow,
    "figure11": response_figures.slow,
    "figure12": step_figures.responses,
    "figure13": step_figures.characteristic,
}


def draw(outcome: DeviceOutcome, names: tuple[str, ...], folder: Path) -> list[str]:
    """Draws the named figures into a folder as .png and .svg; returns the files' names."""
    with style():
        return [file for name in names for file in save(DRAWN[name](outcome), folder, name)]
