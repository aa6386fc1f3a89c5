"""Expressions of quantities: "w/2", "L - 2*w", "max(2 um, h + gap)". A small parser that computes as it reads; no text
is ever run as code.

    sum     = product (("+" | "-") product)*
    product = signed (("*" | "/") signed)*
    signed  = ("+" | "-") signed | power
    power   = atom [("**" | "^") signed]
    atom    = number [unit] | name | name "(" sum ("," sum)* ")" | "(" sum ")"

Units are checked: only like quantities are added or compared. Numbers are exact fractions but for roots, so that
"2 um + 0.5 um" is the very double that "2.5 um" is, and faces that are meant to lie in one plane do.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from scenes.errors import did_you_mean, listed, printable
from scenes.units import LEADING_UNIT, PLAIN, Powers, UnitError, called, parse_quantity, parse_unit, spelled

LONGEST = 500
"""Characters of an expression at most; longer ones are better written as several parameters."""
DEEPEST = 40
"""Nested brackets, signs and powers at most: each takes some five Python calls of the thousand allowed."""
LARGEST_EXPONENT = 100
"""No formula needs larger exponents, and exact fractions stay small."""
MOST_BITS = 4000
"""Exact fractions with more bits in numerator or denominator are rounded to a double."""
ROOTS = 12
"""Exponents of units are rational, with denominators of at most this."""

FUNCTIONS = ("sqrt", "min", "max")
PI = "pi"
_TOKEN = re.compile(
    r"\s*(?:((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|([A-Za-z_]\w*)|(\*\*|[-+*/(),])|(.))", re.ASCII | re.DOTALL
)
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*", re.ASCII)


@dataclass(frozen=True)
class Measure:
    """A value in SI units and the powers of the base units that it has."""

    value: Fraction
    powers: Powers

    @staticmethod
    def of(value: float, powers: Powers) -> Measure:
        """Of a double the fraction that its shortest decimal form says."""
        return Measure(Fraction(repr(float(value))), powers)


class _UnreadError(UnitError):
    """Text that is no expression at all."""


def measured(text: str, names: Mapping[str, Measure]) -> tuple[float, Powers | None]:
    """Return the SI value of a quantity, or of an expression of the ``names``, and its powers.

    The powers are ``None`` for a number without a unit. Raises UnitError.
    """
    said = _NAME.findall(spelled(text)) if len(text) <= LONGEST else []
    plain = None
    if not any(name in names for name in said):
        try:
            value, unit = parse_quantity(text)
            return value, None if unit is None else unit.powers
        except UnitError as error:
            plain = error
    try:
        measure = evaluate(text, names)
    except _UnreadError:
        # Text without a known name is a slip of a unit or a word, which the error of the plain reading describes.
        if plain is None or any(name in (*FUNCTIONS, PI) for name in said) or (names and text[:1].isalpha()):
            raise
        raise plain from None
    return _double(measure.value), measure.powers


def is_expression(given: object) -> bool:
    """Whether a value is text that is more than a number with a unit."""
    if not isinstance(given, str):
        return False
    try:
        parse_quantity(given)
    except UnitError:
        return True
    return False


def evaluate(text: str, names: Mapping[str, Measure]) -> Measure:
    """What an expression comes to. Raises UnitError for what is none, and for what can't be computed."""
    if len(text) > LONGEST:
        raise UnitError(f"is longer than {LONGEST} characters: say parts of it as parameters of their own")
    return _Reader(text, names).whole()


class _Reader:
    """A text that is read from its start to its end; ``token`` is the next one, "" at the end."""

    def __init__(self, text: str, names: Mapping[str, Measure]) -> None:
        self.text, self.names = spelled(text).replace("^", "**"), names
        self.at, self.depth = 0, 0
        self.number = self.name = self.token = ""
        self._next()

    def whole(self) -> Measure:
        measure = self._sum()
        if self.token:
            raise _UnreadError(f'has "{printable(self.token)}" where the expression could end')
        return measure

    def _next(self) -> None:
        match = _TOKEN.match(self.text, self.at)
        self.number, self.name, mark, other = ("", "", "", "") if match is None else (g or "" for g in match.groups())
        if other.strip():
            raise _UnreadError(f'has "{printable(other)}" in it, which no expression has')
        self.token = self.number or self.name or mark
        self.at = len(self.text) if match is None else match.end()

    def _take(self, *tokens: str) -> str:
        """The next token where it is one of these, which is then passed; else ""."""
        if (token := self.token) not in tokens:
            return ""
        self._next()
        return token

    def _expect(self, token: str) -> None:
        if not self._take(token):
            seen = f'"{printable(self.token)}"' if self.token else "its end"
            raise _UnreadError(f'has {seen} where "{token}" should be')

    def _deeper(self) -> None:
        self.depth += 1
        if self.depth > DEEPEST:
            raise UnitError(f"is nested more than {DEEPEST} deep: say parts of it as parameters of their own")

    def _sum(self) -> Measure:
        self._deeper()
        total = self._product()
        while sign := self._take("+", "-"):
            term = self._product()
            verb = "adds {1} to {0}" if sign == "+" else "subtracts {1} from {0}"
            _alike(total, term, verb)
            value = total.value + term.value if sign == "+" else total.value - term.value
            total = Measure(_short(value), total.powers)
        self.depth -= 1
        return total

    def _product(self) -> Measure:
        product = self._signed()
        while sign := self._take("*", "/"):
            factor = self._signed()
            if sign == "/" and not factor.value:
                raise UnitError("divides by zero")
            by = 1 if sign == "*" else -1
            powers: Powers = tuple(a + by * b for a, b in zip(product.powers, factor.powers, strict=True))  # type: ignore[assignment]
            product = Measure(_short(product.value * factor.value**by), powers)
        return product

    def _signed(self) -> Measure:
        sign = self._take("+", "-")
        if not sign:
            return self._power()
        self._deeper()
        operand = self._signed()
        self.depth -= 1
        return operand if sign == "+" else Measure(-operand.value, operand.powers)

    def _power(self) -> Measure:
        base = self._atom()
        if not self._take("**"):
            return base
        self._deeper()
        exponent = self._signed()
        self.depth -= 1
        return _raised(base, exponent)

    def _atom(self) -> Measure:
        if self.number:
            return self._quantity()
        if self.name:
            return self._named()
        if self._take("("):
            inner = self._sum()
            self._expect(")")
            return inner
        seen = f'"{printable(self.token)}"' if self.token else "its end"
        raise _UnreadError(f"has {seen} where a number, a name or a bracket should be")

    def _quantity(self) -> Measure:
        number, unit = self.number, LEADING_UNIT.match(self.text, self.at)
        if unit is None:
            self._next()
            if self.name:
                raise _UnreadError(
                    f'has "{number} {printable(self.name)}": write {number}*{printable(self.name)} for a product'
                )
            return Measure(_fraction(number), PLAIN)
        said = unit.group()
        for name in _NAME.findall(said):
            if name in self.names:
                base = name.rstrip("0123456789")
                power = f"write {base}**{name[len(base) :]} for the unit, or rename the parameter"
                raise UnitError(f'has "{name}", a unit and a parameter: {power}')
        self.at = unit.end()
        self._next()
        parsed = parse_unit(said)
        if parsed.celsius:
            raise UnitError("has a temperature in degC among other terms: give it in K, or as a parameter of its own")
        if self.token == "**":
            raise UnitError(f'has a power right after "{number} {said.strip()}": put brackets around what it is of')
        return Measure(_fraction(number) * parsed.factor, parsed.powers)

    def _named(self) -> Measure:
        name = self.name
        self._next()
        if self.token == "(":
            if name not in FUNCTIONS:
                raise _UnreadError(f'has no function "{printable(name)}": there are {listed(FUNCTIONS)}')
            return self._function(name)
        if name == PI:
            return Measure(Fraction(math.pi), PLAIN)
        if name not in self.names:
            near = did_you_mean(name, self.names).rstrip("?")
            raise _UnreadError(f'names no parameter "{printable(name)}"{near}')
        return self.names[name]

    def _function(self, name: str) -> Measure:
        self._expect("(")
        arguments = [self._sum()]
        while self._take(","):
            arguments.append(self._sum())
        self._expect(")")
        if name == "sqrt":
            if len(arguments) > 1:
                raise UnitError("gives sqrt more than one number")
            return _raised(arguments[0], Measure(Fraction(1, 2), PLAIN))
        for argument in arguments[1:]:
            _alike(arguments[0], argument, "compares {0} with {1}")
        chosen = max if name == "max" else min
        return Measure(chosen(each.value for each in arguments), arguments[0].powers)


def _alike(a: Measure, b: Measure, verb: str) -> None:
    if a.powers != b.powers:
        raise UnitError(verb.format(called(a.powers), called(b.powers)))


def _raised(base: Measure, exponent: Measure) -> Measure:
    """A power; a square root where the exponent is a half, rounded as one."""
    if exponent.powers != PLAIN:
        raise UnitError(f"has an exponent that is {called(exponent.powers)}, not a plain number")
    e, value = exponent.value, base.value
    if abs(e) > LARGEST_EXPONENT:
        raise UnitError(f"has an exponent beyond {LARGEST_EXPONENT}")
    if not value and e < 0:
        raise UnitError("divides by zero")
    near = e.limit_denominator(ROOTS)
    if base.powers != PLAIN and abs(near - e) > 1e-12:
        raise UnitError(f"raises {called(base.powers)} to {float(e):g}: give a fraction such as 1/2 or 2/3")
    powers: Powers = tuple(near * p for p in base.powers)  # type: ignore[assignment]
    if e.denominator == 1:
        return Measure(_short(value ** int(e)), powers)
    if value < 0:
        raise UnitError("takes a root of a negative number")
    root = math.sqrt(_double(value)) if e == Fraction(1, 2) else _double(value) ** float(e)
    return Measure(Fraction(root), powers)


def _fraction(number: str) -> Fraction:
    value = float(number)
    # A double says whether it is within what is computed with, before an exact power of ten could fill the memory.
    if not math.isfinite(value):
        raise UnitError("is not a finite number")
    return Fraction(number) if value else Fraction(0)


def _short(value: Fraction) -> Fraction:
    """The fraction, rounded to a double where it has very many digits."""
    if max(value.numerator.bit_length(), value.denominator.bit_length()) <= MOST_BITS:
        return value
    return Fraction(_double(value))


def _double(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        raise UnitError("is not a finite number") from None
