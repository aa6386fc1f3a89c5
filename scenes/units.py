"""Units and the kinds of quantity that a scene file may hold: a number with a unit, as text, to SI and back.

Every unit here is SI but for a power of ten (degC, by its offset, is the one exception). The power is added to the
exponent of the number before the text becomes a double, so that "20 um" is exactly the double 20e-6.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import cached_property, lru_cache

from scenes.errors import did_you_mean, printable

Power = int | Fraction
Powers = tuple[Power, Power, Power, Power, Power]
"""The exponents of metre, kilogram, second, ampere and kelvin: whole, but for those of roots."""

PLAIN: Powers = (0, 0, 0, 0, 0)
_SYMBOLS: dict[str, tuple[Powers, int]] = {
    "m": ((1, 0, 0, 0, 0), 0),
    "g": ((0, 1, 0, 0, 0), -3),
    "s": ((0, 0, 1, 0, 0), 0),
    "A": ((0, 0, 0, 1, 0), 0),
    "K": ((0, 0, 0, 0, 1), 0),
    "V": ((2, 1, -3, -1, 0), 0),
    "W": ((2, 1, -3, 0, 0), 0),
    "J": ((2, 1, -2, 0, 0), 0),
    "ohm": ((2, 1, -3, -2, 0), 0),
}
_WITHOUT_PREFIX: dict[str, tuple[Powers, int]] = {
    "degC": ((0, 0, 0, 0, 1), 0),
    "ppm": (PLAIN, -6),
    "%": (PLAIN, -2),
    "1": (PLAIN, 0),
}
_PREFIXES = {"G": 9, "M": 6, "k": 3, "": 0, "c": -2, "m": -3, "u": -6, "n": -9, "p": -12}
_FAMILIAR = ("m", "cm", "mm", "um", "nm", "s", "ms", "us", "ns", "V", "mV", "kV", "K", "degC", "W", "mW", "J", "kg",
             "g", "ohm", "ppm")  # fmt: skip

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+))(?:[eE]([+-]?\d+))?(.*)", re.ASCII | re.DOTALL)
_TOKEN = re.compile(r"[A-Za-z%]+(?:-?\d+)?|[/()]|1(?=/)", re.ASCII)
_SPELLINGS = str.maketrans({
    "\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u",
    "\N{OHM SIGN}": "ohm", "\N{GREEK CAPITAL LETTER OMEGA}": "ohm",
    "\N{DEGREE SIGN}": "deg", "\N{DEGREE CELSIUS}": "degC",
    "\N{MIDDLE DOT}": " ", "\N{DOT OPERATOR}": " ", "\N{MINUS SIGN}": "-",
})  # fmt: skip
_SUPERSCRIPTS = str.maketrans({
    "\N{SUPERSCRIPT MINUS}": "-",
    "\N{SUPERSCRIPT ONE}": "1", "\N{SUPERSCRIPT TWO}": "2", "\N{SUPERSCRIPT THREE}": "3",
})  # fmt: skip
_SUPERSCRIPT = re.compile(
    "(?<=[A-Za-z])[\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT TWO}\N{SUPERSCRIPT THREE}]+"
)
_WORDS = "|".join(filter(str.isalpha, _WITHOUT_PREFIX))
_POWER = r"(?:(?:\*\*)?-?\d+)?"
_FACTOR = rf"(?:[{''.join(_PREFIXES)}]?(?:{'|'.join(_SYMBOLS)}){_POWER}|{_WORDS}|%)(?![\w%])"
LEADING_UNIT = re.compile(
    rf"\s*(?:1\s*/\s*)?{_FACTOR}(?:(?:\s*/\s*|\s+){_FACTOR}|\s*/\s*\(\s*{_FACTOR}(?:\s+{_FACTOR})*\s*\))*", re.ASCII
)
"""A unit at the start of a text, in the signs that `spelled` gives, as far as its units are known."""
_MEANT = {"c": "degC", "celsius": "degC", "kelvin": "K", "micron": "um", "mu": "um", "sec": "s", "volt": "V",
          "s": "1/ohm", "siemens": "1/ohm"}  # fmt: skip
"""Common words for units that are not spelled like ours."""
_LONGEST = 100  # Characters of a quantity at most.


class UnitError(ValueError):
    """Text that is no quantity; the message completes a sentence that starts with the text."""


@dataclass(frozen=True)
class Unit:
    """A product of SI base units times ten to the ``exponent``; ``celsius`` marks a temperature in degrees Celsius."""

    powers: Powers
    exponent: int
    celsius: bool = False


def parse_quantity(text: str) -> tuple[float, Unit | None]:
    """The SI value of a number with a unit, and the unit (``None`` where the text has only a number).

    Raises UnitError where the text is not a number, or its unit is not known.
    """
    match = _NUMBER.fullmatch(_plain(text)) if len(text) <= _LONGEST else None
    if match is None:
        raise UnitError("is not a number with a unit")
    mantissa, exponent, rest = match.groups()
    if not rest.strip():
        return float(f"{mantissa}e{exponent or 0}"), None
    unit = parse_unit(rest)
    value = float(f"{mantissa}e{int(exponent or 0) + unit.exponent}")
    # Rounded because 0.2 + 273.15 should be the double 273.35.
    return (round(value + 273.15, 9) if unit.celsius else value), unit


@lru_cache(maxsize=256)
def parse_unit(text: str) -> Unit:
    """A unit such as "um", "W/(m K)", "W/m/K", "kg/m^3" or "1/K"; a slash divides by the one factor that follows it.

    Raises UnitError.
    """
    close_up = re.sub(r"\s*([/()])\s*", r"\1", _plain(text).strip())
    tokens, unknown = _TOKEN.findall(close_up), UnitError(f'has an unknown unit "{printable(text.strip())}"')
    if "".join(tokens) != re.sub(r"\s+", "", close_up):
        raise unknown
    if tokens == ["degC"]:
        return Unit(_SYMBOLS["K"][0], 0, celsius=True)
    tokens.reverse()
    unit = _product(tokens)
    if tokens:
        raise unknown
    return unit


def spelled(text: str) -> str:
    """The text with one spelling for every sign, in ASCII: the power of a unit stands behind it as a number. A power of
    a number, as in "2² um", is none of a unit and stays as it is."""
    return _SUPERSCRIPT.sub(lambda power: power.group().translate(_SUPERSCRIPTS), text.translate(_SPELLINGS))


def _plain(text: str) -> str:
    """A quantity without signs of powers and products: powers right behind their unit, factors apart."""
    return re.sub(r"(?<=[A-Za-z])(\*\*|\^)", "", spelled(text)).replace("*", " ")


def meant(text: str, powers: Powers) -> str | None:
    """The quantity of some base units that a text would be with its factors apart, and all that is behind a slash below
    it: "200 W/(m K)" for "200 W/mK", which divides by millikelvins, and for "200 W/m K". ``None`` where it is none."""
    match = _NUMBER.fullmatch(_plain(text)) if len(text) <= _LONGEST else None
    if match is None:
        return None
    above, slash, below = (
        re.sub("[A-Za-z]+", lambda name: _apart(name[0]), part).strip(" ()") for part in match[3].partition("/")
    )
    unit = re.sub(r"(?<=\d)(?=[A-Za-z])", " ", f"{above}/({below})" if slash else above)
    try:
        fits = parse_unit(unit).powers == powers
    except UnitError:
        return None
    return f"{text[: match.start(3)].strip()} {unit}" if fits else None


def _apart(name: str) -> str:
    """Two units that stand close to one another apart: "m K", "kg K", "ohm m"; anything else as it is."""
    for at in range(1, len(name)):
        try:
            _named(name[:at])
            _named(name[at:])
        except UnitError:
            continue
        return f"{name[:at]} {name[at:]}"
    return name


def _product(tokens: list[str]) -> Unit:
    """Consumes factors from the end of ``tokens`` up to its start or a closing bracket."""
    powers, exponent, sign = PLAIN, 0, 1
    while tokens and tokens[-1] != ")":
        token = tokens.pop()
        if token == "/":
            if sign == -1:
                raise UnitError('has a unit with "//" in it')
            sign = -1
            continue
        if token == "(":
            factor = _product(tokens)
            if not tokens:
                raise UnitError("has a unit with an open bracket")
            tokens.pop()
        else:
            name = token.rstrip("-0123456789") or "1"
            power = int(token[len(name) :] or 1)
            base, ten = _named(name)
            factor = Unit(_combine(PLAIN, base, power), power * ten)
        powers = _combine(powers, factor.powers, sign)
        exponent += sign * factor.exponent
        sign = 1
    if sign == -1:
        raise UnitError('has a unit that ends in "/"')
    return Unit(powers, exponent)


def _named(name: str) -> tuple[Powers, int]:
    if name in _WITHOUT_PREFIX:
        return _WITHOUT_PREFIX[name]
    for symbol, (powers, exponent) in _SYMBOLS.items():
        prefix = name.removesuffix(symbol)
        if name.endswith(symbol) and prefix in _PREFIXES:
            return powers, exponent + _PREFIXES[prefix]
    meant = _MEANT.get(name.lower())
    hint = f', did you mean "{meant}"' if meant else did_you_mean(name, _FAMILIAR).rstrip("?")
    raise UnitError(f'has an unknown unit "{printable(name)}"{hint}')


def _combine(a: Powers, b: Powers, times: int) -> Powers:
    m, kg, s, ampere, kelvin = (x + times * y for x, y in zip(a, b, strict=True))
    return m, kg, s, ampere, kelvin


_SHOWN = ((0, ""), (-3, "m"), (-6, "u"), (-9, "n"))


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
        """An SI value for a person to read, such as "20 um", exact to the last digit."""
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


def named(powers: Powers) -> str | None:
    """The name of the dimension with these base units, or ``None`` where no scene has such a quantity."""
    return next((d.name for d in DIMENSIONS if d.powers == powers), None)


def called(powers: Powers) -> str:
    """What a quantity of these base units is, with an article: "a length", "a quantity in m2"."""
    return named(powers) or f"a quantity in {unit_of(powers)}"


def dimension_of(powers: Powers) -> Dimension:
    """The dimension with these base units, one without a name where no scene has such a quantity."""
    unit = unit_of(powers)
    dimension = next((d for d in DIMENSIONS if d.powers == powers), None)
    return dimension or Dimension(called(powers), unit, f"1 {unit}")


def unit_of(powers: Powers) -> str:
    """The SI unit of these powers, as a scene would show it, or else of base units: "W/(m K)", "m2 kg s-3"."""
    unit = next((d.unit for d in DIMENSIONS if d.powers == powers), None)
    if unit is not None:
        return unit
    base = zip(("m", "kg", "s", "A", "K"), powers, strict=True)
    return " ".join(f"{symbol}{power if power != 1 else ''}" for symbol, power in base if power)


def is_unit(name: str) -> bool:
    """Whether a name means a unit, such as W, or a power of one, such as m2."""
    return LEADING_UNIT.fullmatch(name) is not None


def point(at: tuple[float, float, float]) -> str:
    return f"[{', '.join(LENGTH.show(float(f'{c:.9g}')) for c in at)}]"


def extent(axis: int, lower: tuple[float, float, float], upper: tuple[float, float, float]) -> str:
    """The extent along an axis, as "x from 0 m to 2 um"."""
    return f"{'xyz'[axis]} from {LENGTH.show(lower[axis])} to {LENGTH.show(upper[axis])}"
