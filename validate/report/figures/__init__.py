"""Figures, and their colours, which stay apart in print, in greyscale and for colour-blind readers."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

INK = "#222222"
LINES = {"peak_K": "#8b1a1a", "mean_K": "#f0a030", "end_K": "#3a86c8", "current_A": "#5e3c99"}
LAYERS = {"sink": "#8b1a1a", "sensor": "#3a86c8", "polymer": "#f0a030"}
PARTS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#999999", "#f0e442")
"""The colours of Okabe and Ito, ordered so that lightness alternates."""
FIELD = "inferno"
_PART = (0.08, 0.93)  # The part of the colour map that is used; its ends look like ink and paper.


def table() -> np.ndarray:
    """(256, 3) uint8: matplotlib's inferno, of evenly rising lightness, without its ends of ink and paper."""
    import numpy as np
    from matplotlib import colormaps

    return (colormaps[FIELD](np.linspace(*_PART, 256))[:, :3] * 255).round().astype(np.uint8)


def with_mu(text: str) -> str:
    """Replace the "u" of micro by the letter mu."""
    return re.sub(r"(?<=[\d(] )u(?=[A-Zmos])|(?<=\()u(?=[A-Zmos])|^u(?=[A-Zm]$)", "\N{MICRO SIGN}", text)
