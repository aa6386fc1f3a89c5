"""Expressions of quantities: "w/2", "L - 2*w", "max(2 um, h + gap)".

The grammar has sums, products, powers, signs, brackets, names, numbers with units, and three functions. Units are
checked: only like quantities are added or compared. Numbers are exact fractions but for roots, so that
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

LONGEST = 500  # characters of an expression
DEEPEST = 40  # nested operations, and parameters that are made of one another: far below Python's limit of recursion
LARGEST_EXPONENT = 100  # of a power: no formula needs more, and exact fractions stay small

FUNCTIONS = ("sqrt", "min", "max")
PI = "pi"
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*", re.ASCII)


@dataclass(frozen=True)
class Measure:
    """A value in SI units and the powers of the base units that it has."""

    value: Fraction
    powers: Powers

    @staticmethod
    def from_float(value: float, powers: Powers) -> Measure:
        """Take the shortest decimal form of a double as exact."""
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
    """Evaluate an expression. Raises UnitError."""
    if len(text) > LONGEST:
        raise UnitError(f"is longer than {LONGEST} characters: say parts of it as parameters of their own")
    parser = _Parser(spelled(text).replace("^", "**"), names)
    value = parser.sum()
    if parser.rest.strip():
        raise parser.unread()
    return value


class _Parser:
    """A recursive descent through an expression; ``rest`` is the text that has not been read."""

    def __init__(self, text: str, names: Mapping[str, Measure]) -> None:
        self.rest, self.names, self.depth = text, names, 0

    def unread(self) -> _UnreadError:
        return _UnreadError('is no expression: give numbers with units, names, + - * / **, brackets, such as "w/2"')

    def take(self, pattern: str) -> str:
        """Return and consume a token at the start of the rest, or return ""."""
        match = re.match(rf"\s*({pattern})", self.rest, re.ASCII)
        if match is None:
            return ""
        self.rest = self.rest[match.end() :]
        return match[1]

    def sum(self) -> Measure:
        total = self.product()
        while sign := self.take("[+-]"):
            term = self.product()
            _refuse_unlike(total, term, "adds {1} to {0}" if sign == "+" else "subtracts {1} from {0}")
            total = Measure(_short(total.value + (term.value if sign == "+" else -term.value)), total.powers)
        return total

    def product(self) -> Measure:
        total = self.signed()
        while operator := self.take(r"\*(?!\*)|/"):
            factor, by = self.signed(), 1 if operator == "*" else -1
            if by == -1 and not factor.value:
                raise UnitError("divides by zero")
            powers: Powers = tuple(p + by * q for p, q in zip(total.powers, factor.powers, strict=True))  # type: ignore[assignment]
            total = Measure(_short(total.value * factor.value**by), powers)
        return total

    def signed(self) -> Measure:
        self.depth += 1
        if self.depth > DEEPEST:
            raise UnitError(f"is nested more than {DEEPEST} deep: say parts of it as parameters of their own")
        if sign := self.take("[+-]"):
            operand = self.signed()
            value = Measure(-operand.value, operand.powers) if sign == "-" else operand
        else:
            value = self.atom()
            if self.take(r"\*\*"):
                value = _raised(value, self.signed())
        self.depth -= 1
        return value

    def atom(self) -> Measure:
        if number := self.take(r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![\d.])"):
            return self.quantity(number)
        if self.take(r"\("):
            value = self.sum()
        elif name := self.take(r"[A-Za-z_]\w*"):
            if not self.take(r"\("):
                return self.named(name)
            if name not in FUNCTIONS:
                raise _UnreadError(f'has no function "{printable(name)}": there are {listed(FUNCTIONS)}')
            arguments = [self.sum()]
            while self.take(","):
                arguments.append(self.sum())
            value = _function(name, arguments)
        else:
            raise self.unread()
        if not self.take(r"\)"):
            raise self.unread()
        return value

    def named(self, name: str) -> Measure:
        if name == PI:
            return Measure(Fraction(math.pi), PLAIN)
        if name not in self.names:
            near = did_you_mean(name, self.names).rstrip("?")
            raise _UnreadError(f'names no parameter "{printable(name)}"{near}')
        return self.names[name]

    def quantity(self, number: str) -> Measure:
        """The measure of a number and the unit behind it."""
        # A double bounds the exponent before an exact power of ten could fill the memory.
        if not math.isfinite(float(number)):
            raise UnitError("is not a finite number")
        exact = Fraction(number) if float(number) else Fraction(0)
        match = LEADING_UNIT.match(self.rest)
        if match is None:
            if name := self.take(r"[A-Za-z_]\w*"):
                raise _UnreadError(f'has "{number} {printable(name)}": write {number}*{printable(name)}')
            return Measure(exact, PLAIN)
        for name in _NAME.findall(match[0]):
            if name in self.names:
                base = name.rstrip("0123456789")
                power = f"write {base}**{name[len(base) :]} for the unit, or rename the parameter"
                raise UnitError(f'has "{name}", a unit and a parameter: {power}')
        self.rest, unit = self.rest[match.end() :], parse_unit(match[0])
        if unit.celsius:
            raise UnitError("has a temperature in degC among other terms: give it in K, or as a parameter of its own")
        if self.rest.lstrip().startswith("**"):
            raise UnitError(f'has a power right after "{number}{match[0]}": put brackets around what it is of')
        return Measure(exact * unit.factor, unit.powers)


def _function(name: str, arguments: list[Measure]) -> Measure:
    if name == "sqrt":
        if len(arguments) > 1:
            raise UnitError("gives sqrt more than one number")
        return _raised(arguments[0], Measure(Fraction(1, 2), PLAIN))
    for argument in arguments[1:]:
        _refuse_unlike(arguments[0], argument, "compares {0} with {1}")
    chosen = max if name == "max" else min
    return Measure(chosen(each.value for each in arguments), arguments[0].powers)


def _refuse_unlike(a: Measure, b: Measure, verb: str) -> None:
    if a.powers != b.powers:
        raise UnitError(verb.format(called(a.powers), called(b.powers)))


def _raised(base: Measure, exponent: Measure) -> Measure:
    """A power; one that is no whole number is rounded to a double."""
    if exponent.powers != PLAIN:
        raise UnitError(f"has an exponent that is {called(exponent.powers)}, not a plain number")
    e, value = exponent.value, base.value
    if abs(e) > LARGEST_EXPONENT:
        raise UnitError(f"has an exponent beyond {LARGEST_EXPONENT}")
    if not value and e < 0:
        raise UnitError("divides by zero")
    near = e.limit_denominator(12)
    if base.powers != PLAIN and abs(near - e) > 1e-12:
        raise UnitError(f"raises {called(base.powers)} to {float(e):g}: give a fraction such as 1/2 or 2/3")
    powers: Powers = tuple(near * p for p in base.powers)  # type: ignore[assignment]
    if e.denominator == 1:
        return Measure(_short(value ** int(e)), powers)
    if value < 0:
        raise UnitError("takes a root of a negative number")
    root = math.sqrt(_double(value)) if e == Fraction(1, 2) else _double(value) ** float(e)
    return Measure(Fraction(root), powers)


def _short(value: Fraction) -> Fraction:
    """The fraction, rounded to a double where it has very many digits."""
    if max(value.numerator.bit_length(), value.denominator.bit_length()) <= 4000:
        return value
    return Fraction(_double(value))


def _double(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        raise UnitError("is not a finite number") from None
