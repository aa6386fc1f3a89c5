"""How messages name parts of a scene."""

from __future__ import annotations

from collections.abc import Sequence

from scenes.dimensions import LENGTH
from scenes.errors import quoted
from scenes.model import Point

_MOST = 4


def listed(names: Sequence[str]) -> str:
    """Names in quotation marks, at most four of them."""
    shown = [quoted(name) for name in names[:_MOST]]
    if len(names) > _MOST:
        shown.append(f"{len(names) - _MOST} more")
    return " and ".join(filter(None, (", ".join(shown[:-1]), shown[-1])))


def boxes(names: Sequence[str]) -> str:
    """One box or several, by name."""
    return f"{'box' if len(names) == 1 else 'boxes'} {listed(names)}"


def point(at: Point) -> str:
    """A point with units."""
    return f"[{', '.join(LENGTH.show(float(f'{c:.9g}')) for c in at)}]"


def extent(axis: int, lower: Point, upper: Point) -> str:
    """The extent along an axis, as "x from 0 m to 2 um"."""
    return f"{'xyz'[axis]} from {LENGTH.show(lower[axis])} to {LENGTH.show(upper[axis])}"
