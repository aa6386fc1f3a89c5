"""The paper's equations 7, 9, 12 to 16, 18 and 19, corrected (see the list of misprints), and resistances.

SI units; every temperature is a *rise* above room temperature in K. The quantities that vary (rises, currents) may be
floats or numpy arrays of one common shape; sizes and materials are floats. The symbols are the paper's: beam length L
and cross section A_c, conductivity k, rise of the ends dT_end, rise of the peak above the ends dT0, equivalent constant
rise dT_c. The spreading resistance of a substrate is that of Y. S. Muzychka, J. R. Culham and M. M. Yovanovich, Journal
of Electronic Packaging 125, 178 (2003).
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np

from scenes.errors import NumericsError
from scenes.model import Material
from scenes.sink import Sink
from scenes.units import LENGTH

Values = TypeVar("Values", float, np.ndarray)
_TERMS = 40
"""Terms of each sum per ratio of plate to source. The rest falls as their square, which half as many terms tell."""


def room_resistivity(material: Material, room_temperature: float) -> tuple[float, float]:
    """The resistivity (ohm m) at room temperature and the coefficient (1/K) of eq 7, whose rises are above room.

    A material's resistivity and coefficient refer to its own reference temperature; written about room temperature,
    rho_ref (1 + a_ref (T - T_ref)) = rho (1 + a (T - T_room)) with a = a_ref rho_ref / rho.

    Raises ValueError for an electrical insulator and where the resistivity at room temperature is not positive.
    """
    if material.resistivity is None:
        raise ValueError(f"material {material.name!r} has no resistivity, so no current can heat the sink")
    a = material.temperature_coefficient
    factor = 1 + a * (room_temperature - material.reference_temperature)
    if not material.resistivity * factor > 0:
        raise ValueError(
            f"the resistivity of {material.name!r} at {room_temperature:g} K, "
            f"{material.resistivity * factor:g} ohm m, must be positive"
        )
    return material.resistivity * factor, a / factor


def resistance(rise: Values, resistivity: float, a: float, L: float, A_c: float) -> Values:
    """Resistance (ohm) of a beam at a uniform rise: R = rho_e L / A_c (1 + a dT). Eq 7."""
    return resistivity * L / A_c * (1 + a * rise)


def parabola(y: Values, dT0: float, dT_end: float, L: float) -> Values:
    """Rise (K) at ``y`` (m, 0 to L) along the beam: dT0 [1 - 4 (y/L - 1/2)^2] + dT_end. Eq 9.

    Printed with a plus sign, which would make the middle the coldest place and the ends hotter than dT_end.
    """
    return dT0 * (1 - 4 * (y / L - 0.5) ** 2) + dT_end


def power(
    current: Values, dT0: Values, dT_end: Values, resistivity: float, a: float, L: float, A_c: float
) -> Values:  # fmt: skip
    """Power (W) of a beam with the parabolic rise of eq 9: I^2 rho_e L / A_c (1 + a [2/3 dT0 + dT_end]). Eq 12.

    It is the integral of I^2 rho(y) / A_c along the beam; eq 11 prints rho L / A_c there, L times too small.
    """
    return current**2 * resistance(equivalent_rise(dT0, dT_end), resistivity, a, L, A_c)


def equivalent_rise(dT0: Values, dT_end: Values) -> Values:
    """The uniform rise (K) with the parabola's power, which is the parabola's mean: 2/3 dT0 + dT_end. Eq 13."""
    return 2 / 3 * dT0 + dT_end


def series_resistance(u_o: float, k_si: float, A_si: float, t_o: float, k_o: float, A_o: float) -> float:
    """Thermal resistance (K/W) from one end of the beam to the substrate: u_o/(k_si A_si) + t_o/(k_o A_o). Eq 14.

    Silicon over the distance ``u_o`` (m) with the pad's cross section ``A_si`` (m2), then oxide of thickness ``t_o``
    and area ``A_o``: two prisms in series, without the constriction where the heat turns down into the oxide.
    """
    return u_o / (k_si * A_si) + t_o / (k_o * A_o)


def end_flow(dT0: Values, k: float, A_c: float, L: float) -> Values:
    """Heat (W) leaving the beam through *one* end with the parabolic rise: 4 k A_c dT0 / L. Eqs 15 and 16."""
    return 4 * k * A_c / L * dT0


def end_rise_from_equivalent(dT_c: Values, R_series: float, k: float, A_c: float, L: float) -> Values:
    """dT_end (K) of a beam whose equivalent rise is dT_c: dT_c / [1 + L / (6 k A_c R_series)]. Eq 18."""
    return dT_c / (1 + L / (6 * k * A_c * R_series))


def anchor_flow(dT_c: Values, R_series: float, k: float, A_c: float, L: float) -> Values:
    """Heat (W) leaving through *both* ends of a beam whose equivalent rise is dT_c: 2 dT_end / R_series. Eq 19."""
    return 2 / R_series * end_rise_from_equivalent(dT_c, R_series, k, A_c, L)


def unequal_ends(
    dT_c: Values, R1: float, R2: float, k: float, A_c: float, L: float
) -> tuple[Values, Values, Values]:  # fmt: skip
    """dT0, dT_end1, dT_end2 (K) of a beam whose equivalent rise is dT_c, between resistances R1 and R2 (K/W).

    Eqs 13 to 18 for ends that differ: with r = L/(k A_c) and e = R/(r + 2 R) of each end, dT_end = s e, 4 dT0 = s (1 -
    e1 - e2) and s = 6 dT_c / (1 + 2 (e1 + e2)). Equal ends give eqs 17 and 18. The derivation is on the theory page.
    """
    r = L / (k * A_c)
    e1, e2 = R1 / (r + 2 * R1), R2 / (r + 2 * R2)
    s = 6 / (1 + 2 * (e1 + e2)) * dT_c
    return (1 - e1 - e2) / 4 * s, e1 * s, e2 * s


def unequal_peak(dT0: float, dT_end1: float, dT_end2: float) -> float:
    """The largest rise (K) of the parabola over the straight line between the ends: dT0 + the ends' mean +
    (their difference)^2 / (16 dT0), or an end's where the parabola rises all the way to it."""
    if abs(dT_end2 - dT_end1) >= 4 * dT0:
        return max(dT_end1, dT_end2)
    return dT0 + (dT_end1 + dT_end2) / 2 + (dT_end2 - dT_end1) ** 2 / (16 * dT0)


def anchor_series_resistance(sink: Sink) -> float:
    """Compute eq 14's resistance (K/W) of one anchor: u_o of silicon as wide as the pad, then the oxide block."""
    return series_resistance(
        sink.anchor_distance, sink.silicon.thermal_conductivity, sink.pad_width * sink.thickness,
        sink.oxide_thickness, sink.oxide.thermal_conductivity, sink.oxide_length * sink.oxide_width,
    )  # fmt: skip


def air_conductance(sink: Sink) -> float:
    """Compute the conductance (W/K) from the beam's top face to the room: coefficient times length times width.

    Our reading: the paper announces the loss to the air and leaves it out of eq 20; as a lumped term h A dT_c with the
    equivalent rise it is exact for the beam (dT_c is the mean rise). The pads' faces, which the 3D scene cools too,
    have no temperature in this model.
    """
    return sink.convection_coefficient * sink.length * sink.width


def gap_conductance(sink: Sink) -> float:
    """Compute the conductance (W/K) of the gap's gas from the beam to a substrate at room temperature."""
    return sink.gap_coefficient * sink.length * sink.width


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
