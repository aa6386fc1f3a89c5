"""Names in columns left and right of a drawing, each with a line to its part, none over another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Label:
    """A text with its colour and the place (x, y) that it names; ``hidden`` where that can't be seen."""

    text: str
    colour: str
    at: tuple[float, float]
    hidden: bool = False


def columns(labels: Sequence[Label], most: int) -> tuple[list[Label], list[Label]]:
    """The left and the right column, from top to bottom: each name on its nearer side, as far as there is room."""
    ordered = sorted(labels, key=lambda label: label.at[0])
    places = [label.at[0] for label in ordered]
    count = sum(x <= (places[0] + places[-1]) / 2 for x in places)
    # Neither side has more than two thirds, so that no column is far longer than the drawing is high.
    even = -(-2 * len(ordered) // 3)
    count = min(max(count, len(ordered) - even, len(ordered) - most), even, most)
    sides = ordered[:count], ordered[count:]
    left, right = (sorted(side, key=lambda label: -label.at[1]) for side in sides)
    return left, right


def spread(wanted: Sequence[float], apart: float, low: float, high: float) -> np.ndarray:
    """Return heights in descending order, at least ``apart`` from each other and as near to ``wanted`` as possible
    (least squares, by pooling neighbours that are too near), between two bounds as far as there is room."""
    # With i * apart added the heights need only descend: pools of violators get their mean.
    pools: list[list[float]] = []
    for i, height in enumerate(wanted):
        pools.append([height + i * apart, 1.0])
        while len(pools) > 1 and pools[-2][0] < pools[-1][0]:
            value, count = pools.pop()
            before, number = pools[-1]
            pools[-1] = [(before * number + value * count) / (number + count), number + count]
    level = np.concatenate([np.full(int(count), value) for value, count in pools]) if pools else np.zeros(0)
    steps = apart * np.arange(len(level))
    room = high - low - apart * max(len(level) - 1, 0)
    return np.clip(level, high - max(room, 0.0), high) - steps
