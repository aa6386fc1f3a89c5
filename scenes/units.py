"""Units: a number with a unit, as text, to SI and back.

Every unit here is SI but for a power of ten (degC, by its offset, is the one exception). The power is added to the
exponent of the number before the text becomes a double, so that "20 um" is exactly the double 20e-6.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from scenes.errors import did_you_mean, printable

Powers = tuple[int, int, int, int, int]
"""The exponents of metre, kilogram, second, ampere and kelvin."""

_NONE: Powers = (0, 0, 0, 0, 0)
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
    "ppm": (_NONE, -6),
    "%": (_NONE, -2),
    "1": (_NONE, 0),
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
    "\N{MIDDLE DOT}": " ", "\N{DOT OPERATOR}": " ", "*": " ", "^": "",
    "\N{MINUS SIGN}": "-", "\N{SUPERSCRIPT MINUS}": "-",
    "\N{SUPERSCRIPT ONE}": "1", "\N{SUPERSCRIPT TWO}": "2", "\N{SUPERSCRIPT THREE}": "3",
})  # fmt: skip
_MEANT = {"c": "degC", "celsius": "degC", "kelvin": "K", "micron": "um", "sec": "s", "volt": "V"}
"""What is meant by words that are spelled like another unit, or like none."""
_LONGEST = 100


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
        return _times_ten(mantissa, int(exponent or 0)), None
    unit = parse_unit(rest)
    value = _times_ten(mantissa, int(exponent or 0) + unit.exponent)
    # Rounded because 0.2 + 273.15 should be the double 273.35.
    return (round(value + 273.15, 9) if unit.celsius else value), unit


def parse_unit(text: str) -> Unit:
    """A unit such as "um", "W/(m K)", "W/m/K", "kg/m^3" or "1/K"; a slash divides by the one factor that follows it.

    Raises UnitError.
    """
    close_up = re.sub(r"\s*([/()])\s*", r"\1", _plain(text).strip())
    tokens = _TOKEN.findall(close_up)
    if "".join(tokens) != re.sub(r"\s+", "", close_up):
        raise UnitError(f'has an unknown unit "{printable(text.strip())}"')
    if tokens == ["degC"]:
        return Unit(_SYMBOLS["K"][0], 0, celsius=True)
    tokens.reverse()
    unit = _product(tokens)
    if tokens:
        raise UnitError(f'has an unknown unit "{printable(text.strip())}"')
    return unit


def _plain(text: str) -> str:
    """The text with one spelling for every sign: ASCII, factors apart, powers right behind their unit."""
    return text.replace("**", "").translate(_SPELLINGS)


def _times_ten(mantissa: str, exponent: int) -> float:
    return float(f"{mantissa}e{exponent}")


def _product(tokens: list[str]) -> Unit:
    """Consumes factors from the end of ``tokens`` up to its start or a closing bracket."""
    powers, exponent, sign = _NONE, 0, 1
    while tokens and tokens[-1] != ")":
        token = tokens.pop()
        if token == "/":
            if sign == -1:
                raise UnitError('has a unit with "//" in it')
            sign = -1
            continue
        factor = _bracket(tokens) if token == "(" else _symbol(token)
        powers = _combine(powers, factor.powers, sign)
        exponent += sign * factor.exponent
        sign = 1
    if sign == -1:
        raise UnitError('has a unit that ends in "/"')
    return Unit(powers, exponent)


def _bracket(tokens: list[str]) -> Unit:
    inner = _product(tokens)
    if not tokens:
        raise UnitError("has a unit with an open bracket")
    tokens.pop()
    return inner


def _symbol(token: str) -> Unit:
    name = token.rstrip("-0123456789") or "1"
    power = int(token[len(name) :] or 1)
    powers, exponent = _named(name)
    return Unit(_combine(_NONE, powers, power), power * exponent)


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
    return a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2], a[3] + times * b[3], a[4] + times * b[4]
