"""Units and the dimensions of the quantities in a scene file: text such as "20 um" to SI values and back.

A unit is an exact fraction of its SI unit, so that "20 um" is exactly the double 20e-6.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import cached_property, lru_cache
from math import isfinite

from scenes.errors import did_you_mean, printable

Powers = tuple[int | Fraction, ...]
"""The exponents of metre, kilogram, second, ampere and kelvin: whole, but for those of roots."""

PLAIN: Powers = (0, 0, 0, 0, 0)
_SYMBOLS: dict[str, Powers] = {
    "m": (1, 0, 0, 0, 0), "g": (0, 1, 0, 0, 0), "s": (0, 0, 1, 0, 0), "A": (0, 0, 0, 1, 0), "K": (0, 0, 0, 0, 1),
    "V": (2, 1, -3, -1, 0), "W": (2, 1, -3, 0, 0), "J": (2, 1, -2, 0, 0), "S": (-2, -1, 3, 2, 0),
    "ohm": (2, 1, -3, -2, 0),
}  # fmt: skip
_PREFIXES = {"G": 9, "M": 6, "k": 3, "": 0, "c": -2, "m": -3, "u": -6, "n": -9, "p": -12}
UNITS = {
    f"{prefix}{symbol}": (powers, Fraction(10) ** (exponent - 3 * (symbol == "g")))
    for symbol, powers in _SYMBOLS.items() for prefix, exponent in _PREFIXES.items()
} | {
    "min": (_SYMBOLS["s"], Fraction(60)), "degC": (_SYMBOLS["K"], Fraction(1)),
    "ppm": (PLAIN, Fraction(1, 10**6)), "%": (PLAIN, Fraction(1, 100)),
}  # fmt: skip
"""The powers and the size in SI units of every unit without a power."""
ICE_POINT = Fraction("273.15")  # K, of 0 degC: the definition of the degree Celsius

DECIMAL = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*([+-]?{DECIMAL})(.*)", re.ASCII | re.DOTALL)
_FACTOR = re.compile(r"\s*(/|\*(?!\*))?\s*(([A-Za-z%]+)(?:(?:\*\*)?(-[1-9]|[2-9]))?)(?![\w%.]|-\d)\s*", re.ASCII)
"""A factor of a unit: a slash, which divides by this factor alone, a name, and a power, which is never 0 or 1."""
_BRACKET = re.compile(r"/\s*\(([\w\s*%-]+)\)", re.ASCII)
_SPELLINGS = str.maketrans({
    "\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u",
    "\N{OHM SIGN}": "ohm", "\N{GREEK CAPITAL LETTER OMEGA}": "ohm",
    "\N{DEGREE SIGN}": "deg", "\N{DEGREE CELSIUS}": "degC",
    "\N{MIDDLE DOT}": " ", "\N{DOT OPERATOR}": " ", "\N{MINUS SIGN}": "-",
})  # fmt: skip
_POWERS = "\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT TWO}\N{SUPERSCRIPT THREE}"
_SUPERSCRIPTS = str.maketrans(_POWERS, "-123")
_SUPERSCRIPT = re.compile(f"(?<=[A-Za-z])[{_POWERS}]+")
WORDS = {"c": "degC", "deg c": "degC", "degrees c": "degC", "degree celsius": "degC", "degrees celsius": "degC",
         "celsius": "degC", "kelvin": "K", "siemens": "S", "micron": "um", "mu": "um", "sec": "s", "msec": "ms",
         "usec": "us", "second": "s", "minute": "min", "min": "min", "volt": "V", "amp": "A", "ampere": "A",
         "watt": "W", "ohm": "ohm"}  # fmt: skip
"""Common words for units, in lower case, that this module spells differently."""
_SHOWN = ((0, ""), (-3, "m"), (-6, "u"), (-9, "n"))


class UnitError(ValueError):
    """Text that is no quantity; the message completes a sentence that starts with the text."""


@dataclass(frozen=True)
class Unit:
    """A unit with ``powers`` of SI base units; ``factor`` times a number, plus ``offset``, is in SI units."""

    powers: Powers
    factor: Fraction
    offset: Fraction = Fraction(0)


def exact(number: str) -> Fraction:
    """Return a decimal number as a fraction; raises UnitError beyond the range of doubles."""
    # A double bounds the exponent before an exact power of ten could fill the memory.
    if not isfinite(float(number)):
        raise UnitError("is not a finite number")
    return Fraction(number) if float(number) else Fraction(0)


def double(value: Fraction) -> float:
    """Return the nearest double; raises UnitError beyond the range of doubles."""
    try:
        return float(value)
    except OverflowError:
        raise UnitError("is not a finite number") from None


def parse_quantity(text: str) -> tuple[float, Unit | None]:
    """Return the SI value of a number with a unit, and the unit (``None`` without one).

    Raises UnitError where the text is not a number, or its unit is unknown.
    """
    match = _QUANTITY.fullmatch(spelled(text)) if len(text) <= 100 else None  # no quantity is longer
    if match is None:
        raise UnitError("is not a number with a unit")
    number, unit = exact(match[1]), parse_unit(match[2]) if match[2].strip() else None
    if unit is None:
        return float(number), None
    return double(number * unit.factor + unit.offset), unit


@lru_cache(maxsize=256)
def parse_unit(text: str) -> Unit:
    """Parse a unit such as "um", "W/(m K)", "kg/m^3" or "1/K"; a slash divides by the one factor after it.

    Raises UnitError.
    """
    plain = spelled(text).strip()
    unit, end = leading_unit(plain, 0)
    if end < len(plain):
        raise UnitError(f'has an unknown unit "{printable(text.strip())}"')
    return Unit(unit.powers, unit.factor, ICE_POINT * (plain == "degC"))


def leading_unit(text: str, at: int, names: Collection[str] = ()) -> tuple[Unit, int]:
    """Return the unit at a place in a text that is `spelled`, and where the unit ends, which is before the ``names``.

    Raises UnitError for an unknown unit, and for one that is called like a name.
    """
    powers, scale, start = PLAIN, Fraction(1), at
    if inverse := re.compile(r"\s*1\s*(?=/|$)").match(text, at):
        at = inverse.end()
    while match := _FACTOR.match(text, at):
        sign, factor, name, power = match.groups()
        if factor in names or name in names:
            if (sign and at == start) or sign == "*" or name in names:
                break
            raise UnitError(
                f'has "{factor}", a unit and a parameter: write {name}**{power} for the unit, or rename the parameter'
            )
        if sign and at == start and name not in UNITS:
            break
        base, size = _named(name)
        exponent = (-1 if sign == "/" else 1) * int(power or 1)
        powers = tuple(p + exponent * q for p, q in zip(powers, base, strict=True))
        scale, at = scale * size**exponent, match.end()
    return Unit(powers, scale), at


def spelled(text: str) -> str:
    """Return the text in ASCII, with powers of units as digits behind them, and no brackets in units."""
    plain = _SUPERSCRIPT.sub(lambda power: power.group().translate(_SUPERSCRIPTS), text.translate(_SPELLINGS))

    def factors(match: re.Match[str]) -> str:
        parts = re.split(r"[\s*]+", match[1].strip())
        units = all(re.sub(r"-?\d*$", "", part) in UNITS for part in parts)
        return "".join(f"/{part} " for part in parts) if units else match[0]

    return _BRACKET.sub(factors, plain.replace("^", "**"))


def _named(name: str) -> tuple[Powers, Fraction]:
    """Powers and size of a unit without a power. Raises UnitError with a hint."""
    if name in UNITS:
        return UNITS[name]
    joined = next((f"({name[:at]} {name[at:]})" for at in range(len(name)) if {name[:at], name[at:]} <= {*UNITS}), "")
    meant = WORDS.get(name.lower()) or joined
    hint = f', did you mean "{meant}"' if meant else did_you_mean(name, UNITS)
    raise UnitError(f'has an unknown unit "{printable(name)}"{hint.rstrip("?")}')


@dataclass(frozen=True)
class Dimension:
    """A kind of quantity: its name with an article, its SI unit, an example; ``prefixed`` ones are shown as "20 um"."""

    name: str
    unit: str
    example: str
    prefixed: bool = False

    @cached_property
    def powers(self) -> Powers:
        """The exponents of its SI base units."""
        return parse_unit(self.unit).powers

    def show(self, value: float) -> str:
        """Format an SI value, such as "20 um", exact to the last digit."""
        exact = Decimal(repr(float(value)))
        power, prefix = 0, ""
        if self.prefixed and exact:
            power, prefix = next(((p, n) for p, n in _SHOWN if exact.adjusted() >= p), _SHOWN[-1])
        short = exact.scaleb(-power).normalize()
        # Without zeros at the end, and with an exponent only where there would be many zeros in front or behind.
        digits = f"{short:f}" if not short or -5 <= short.adjusted() < 6 else f"{short:e}"
        return f"{digits} {prefix}{self.unit}".rstrip()


NUMBER = Dimension("a plain number", "", "0.1 %")
LENGTH = Dimension("a length", "m", "20 um", prefixed=True)
TIME = Dimension("a time", "s", "0.2 ms", prefixed=True)
VOLTAGE = Dimension("a voltage", "V", "1 V", prefixed=True)
TEMPERATURE = Dimension("a temperature", "K", "20 degC")
THERMAL_CONDUCTIVITY = Dimension("a thermal conductivity", "W/(m K)", "130 W/(m K)")
DENSITY = Dimension("a density", "kg/m3", "2330 kg/m3")
SPECIFIC_HEAT = Dimension("a specific heat", "J/(kg K)", "712 J/(kg K)")
RESISTIVITY = Dimension("a resistivity", "ohm m", "6e-5 ohm m")
ELECTRICAL_CONDUCTIVITY = Dimension("an electrical conductivity", "S/m", "1.7e4 S/m")
TEMPERATURE_COEFFICIENT = Dimension("a temperature coefficient", "1/K", "500 ppm/K")
CONVECTION_COEFFICIENT = Dimension("a convection coefficient", "W/(m2 K)", "10 W/(m2 K)")
THERMAL_CONTACT = Dimension("a thermal contact resistance", "m2 K/W", "1e-7 m2 K/W")
ELECTRICAL_CONTACT = Dimension("an electrical contact resistance", "ohm m2", "1e-12 ohm m2")
HEAT_FLUX = Dimension("a heat flux", "W/m2", "100 W/m2")
HEAT_SOURCE = Dimension("a heat source", "W/m3", "1e9 W/m3")
CURRENT = Dimension("a current", "A", "3 mA", prefixed=True)
RESISTANCE = Dimension("a resistance", "ohm", "100 ohm", prefixed=True)
POWER = Dimension("a power", "W", "3 mW")

DIMENSIONS = tuple(dimension for dimension in list(globals().values()) if isinstance(dimension, Dimension))


def dimension_of(powers: Powers) -> Dimension:
    """Return the dimension with these base units; one named after its unit where no scene has such a quantity."""
    known = next((d for d in DIMENSIONS if d.powers == powers), None)
    if known is not None:
        return known
    base = zip(("m", "kg", "s", "A", "K"), powers, strict=True)
    unit = " ".join(f"{symbol}{power if power != 1 else ''}" for symbol, power in base if power)
    return Dimension(f"a quantity in {unit}", unit, f"1 {unit}")


def called(powers: Powers) -> str:
    """Return the name of a quantity of these base units, with an article: "a length", "a quantity in m2"."""
    return dimension_of(powers).name
