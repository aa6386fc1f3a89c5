"""The spreading resistance of a substrate: the resistance of a plate from a rectangle on its top to its underside.

Y. S. Muzychka, J. R. Culham and M. M. Yovanovich, Thermal spreading resistance of eccentric heat sources on rectangular
flux channels, Journal of Electronic Packaging 125, 178 (2003).
"""

from __future__ import annotations

import math

import numpy as np

from scenes.errors import NumericsError
from scenes.units import LENGTH

_TERMS = 40
"""Terms of each sum per ratio of plate to source. The rest falls as their square, which half as many terms tell."""


def plate_resistance(
    plate: tuple[float, float, float], source: tuple[float, float], place: tuple[float, float], conductivity: float,
    other: tuple[float, float] | None = None,
) -> float:  # fmt: skip
    """The mean rise (K/W) under a rectangle on a plate whose underside is held, per watt that enters evenly through
    a rectangle of the same sides: itself, or the one at ``other``.

    ``plate`` are its sides and its thickness (m), ``source`` the rectangle's sides, ``place`` and ``other`` where their
    middles are, from the plate's corner. With a_m(y) = cos(m pi y / L), whose mean over a rectangle is a_m at its
    middle times sin(x)/x, x = m pi a / (2 L), the sum over m, n of the source's coefficient, the spreading
    tanh(b t) / (k b) with b^2 = (m pi / L)^2 + (n pi / W)^2 (t / k for m = n = 0), and the mean of the mode.
    Sides farther away than the heat spreads are moved there.

    Raises NumericsError where the plate is so much larger than the source that this takes too many terms.
    """
    # Sides farther away than six thicknesses don't matter: a reflection falls by exp(-pi) over each, to 6e-9.
    far, away = 6 * plate[2], other or place
    length, width = (_near(*axis, far) for axis in zip(plate[:2], source, place, away, strict=True))
    near = length[0], width[0], plate[2]
    # Half a thousand million terms take some three seconds: a plate 500 times as wide as the source and as thick.
    if math.prod(_TERMS * side / extent for side, extent in zip(near[:2], source, strict=True)) > 5e8:
        sides, under = (" by ".join(LENGTH.show(side) for side in sides) for sides in (plate, source))
        raise NumericsError(
            f"a substrate of {sides} is too large to be summed up under an oxide of {under} in 1D: give a smaller one"
        )
    middles = (length[1], width[1]), (length[2], width[2])
    fine, coarse = (_sum(near, source, *middles, terms) for terms in (_TERMS, _TERMS // 2))
    return (fine + (fine - coarse) / 3) / (conductivity * near[0] * near[1])


def _near(side: float, extent: float, place: float, other: float, far: float) -> tuple[float, float, float]:
    """A side of the plate cut at ``far`` from both sources, and the places of their middles on it."""
    start = max(min(place, other) - extent / 2 - far, 0.0)
    end = min(max(place, other) + extent / 2 + far, side)
    return end - start, place - start, other - start


def _sum(
    plate: tuple[float, float, float], source: tuple[float, float], place: tuple[float, float],
    other: tuple[float, float], terms: int,
) -> float:  # fmt: skip
    """`plate_resistance` times the conductivity and the area, by so many terms."""
    length, width, thickness = plate
    along = _modes(length, source[0], place[0], other[0], terms)
    across = _modes(width, source[1], place[1], other[1], terms)
    squares = [(np.arange(len(modes)) * math.pi / side) ** 2 for modes, side in ((along, length), (across, width))]
    total = 0.0
    for weight, square in zip(along, squares[0], strict=True):
        b = np.sqrt(square + squares[1])
        with np.errstate(divide="ignore", invalid="ignore"):
            spread = np.where(b > 0, np.tanh(b * thickness) / b, thickness)
        total += weight * float(across @ spread)
    return total


def _modes(side: float, extent: float, place: float, other: float, terms: int) -> np.ndarray:
    """(terms,): how much of each cosine a source along a side makes at one place, as the mean at the other sees it."""
    m = np.arange(math.ceil(terms * side / extent) + 1)
    mean = np.sinc(m * extent / (2 * side)) ** 2
    cosines: np.ndarray = mean * np.cos(m * math.pi * place / side) * np.cos(m * math.pi * other / side)
    return np.where(m == 0, 1.0, 2.0) * cosines
