"""The kinds of quantity that a scene file may hold, how each is named and written."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property

from scenes.units import Powers, parse_unit

_PREFIXES = ((0, ""), (-3, "m"), (-6, "u"), (-9, "n"))


@dataclass(frozen=True)
class Dimension:
    """A kind of quantity: its name with an article, its SI unit, an example; ``prefixed`` ones are shown as "20 um"."""

    name: str
    unit: str
    example: str
    prefixed: bool = False

    @cached_property
    def powers(self) -> Powers:
        """The SI base units of the dimension."""
        return parse_unit(self.unit).powers

    def show(self, value: float) -> str:
        """An SI value for a person to read, such as "20 um", exact to the last digit."""
        exact = Decimal(repr(float(value)))
        power, prefix = 0, ""
        if self.prefixed and exact:
            power, prefix = next(((p, n) for p, n in _PREFIXES if exact.adjusted() >= p), _PREFIXES[-1])
        return f"{_digits(exact.scaleb(-power))} {prefix}{self.unit}".rstrip()


NUMBER = Dimension("a plain number", "", "0.1 %")
LENGTH = Dimension("a length", "m", "20 um", prefixed=True)
TIME = Dimension("a time", "s", "0.2 ms", prefixed=True)
VOLTAGE = Dimension("a voltage", "V", "1 V", prefixed=True)
TEMPERATURE = Dimension("a temperature", "K", "20 degC")
THERMAL_CONDUCTIVITY = Dimension("a thermal conductivity", "W/(m K)", "130 W/(m K)")
DENSITY = Dimension("a density", "kg/m3", "2330 kg/m3")
SPECIFIC_HEAT = Dimension("a specific heat", "J/(kg K)", "712 J/(kg K)")
RESISTIVITY = Dimension("a resistivity", "ohm m", "6e-5 ohm m")
TEMPERATURE_COEFFICIENT = Dimension("a temperature coefficient", "1/K", "500 ppm/K")
CONVECTION_COEFFICIENT = Dimension("a convection coefficient", "W/(m2 K)", "10 W/(m2 K)")
HEAT_FLUX = Dimension("a heat flux", "W/m2", "100 W/m2")
HEAT_SOURCE = Dimension("a heat source", "W/m3", "1e9 W/m3")
POWER = Dimension("a power", "W", "3 mW")

DIMENSIONS = (
    NUMBER, LENGTH, TIME, VOLTAGE, TEMPERATURE, THERMAL_CONDUCTIVITY, DENSITY, SPECIFIC_HEAT, RESISTIVITY,
    TEMPERATURE_COEFFICIENT, CONVECTION_COEFFICIENT, HEAT_FLUX, HEAT_SOURCE, POWER,
)  # fmt: skip


def _digits(number: Decimal) -> str:
    """Without zeros at the end, and with an exponent only where there would be many zeros in front or behind."""
    short = number.normalize()
    return f"{short:f}" if not short or -5 <= short.adjusted() < 6 else f"{short:e}"


def named(powers: Powers) -> str | None:
    """The name of the dimension with these base units, or ``None`` where no scene has such a quantity."""
    return next((d.name for d in DIMENSIONS if d.powers == powers), None)


def point(at: tuple[float, float, float]) -> str:
    """A point with units."""
    return f"[{', '.join(LENGTH.show(float(f'{c:.9g}')) for c in at)}]"


def extent(axis: int, lower: tuple[float, float, float], upper: tuple[float, float, float]) -> str:
    """The extent along an axis, as "x from 0 m to 2 um"."""
    return f"{'xyz'[axis]} from {LENGTH.show(lower[axis])} to {LENGTH.show(upper[axis])}"
