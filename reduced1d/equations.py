"""The paper's equations 7 and 9 to 19, corrected (see the project's list of misprints), as functions of plain numbers.

SI units; every temperature is a *rise* above room temperature in K. The quantities that vary (rises, currents) may be
floats or numpy arrays of one common shape, and the result has that shape; sizes and materials are floats. The symbols
are the paper's: beam length L and cross section A_c, conductivity k, rise of the ends dT_end, rise of the peak above
the ends dT0, equivalent constant rise dT_c.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from scenes.model import Material

Values = TypeVar("Values", float, np.ndarray)


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


def peak_above_end(dT_end: Values, R_series: float, k: float, A_c: float, L: float) -> Values:
    """dT0 (K), from equating eqs 14 and 16: dT_end / R_series L / (4 k A_c). Eq 17."""
    return dT_end * (L / (4 * k * A_c * R_series))


def end_rise_from_equivalent(dT_c: Values, R_series: float, k: float, A_c: float, L: float) -> Values:
    """dT_end (K) of a beam whose equivalent rise is dT_c: dT_c / [1 + L / (6 k A_c R_series)]. Eq 18."""
    return dT_c / (1 + L / (6 * k * A_c * R_series))


def anchor_flow(dT_c: Values, R_series: float, k: float, A_c: float, L: float) -> Values:
    """Heat (W) leaving through *both* ends of a beam whose equivalent rise is dT_c: 2 dT_end / R_series. Eq 19."""
    return 2 / R_series * end_rise_from_equivalent(dT_c, R_series, k, A_c, L)


def parabola_between(y: Values, dT0: float, dT_end1: float, dT_end2: float, L: float) -> Values:
    """Rise (K) at ``y`` (m) along a beam whose ends differ: 4 dT0 y/L (1 - y/L) over the straight line between the
    ends' rises. Eq 9 where they are equal."""
    return 4 * dT0 * (y / L) * (1 - y / L) + dT_end1 + (dT_end2 - dT_end1) * (y / L)


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
    """The largest rise (K) of `parabola_between`: dT0 + the ends' mean + (their difference)^2 / (16 dT0), or an end's
    where the parabola rises all the way to it."""
    if abs(dT_end2 - dT_end1) >= 4 * dT0:
        return max(dT_end1, dT_end2)
    return dT0 + (dT_end1 + dT_end2) / 2 + (dT_end2 - dT_end1) ** 2 / (16 * dT0)
