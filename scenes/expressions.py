"""Expressions of quantities: "w/2", "L - 2*w", "max(2 um, h + gap)", in Python's grammar with units behind numbers.

Units are checked: only like quantities are added or compared. Numbers are exact fractions but for roots, so that
"2 um + 0.5 um" is the very double that "2.5 um" is, and faces that are meant to lie in one plane do.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from scenes.errors import did_you_mean, listed, printable
from scenes.units import (
    DECIMAL,
    ICE_POINT,
    PLAIN,
    UNITS,
    Powers,
    UnitError,
    called,
    double,
    exact,
    leading_unit,
    spelled,
)

FUNCTIONS = "sqrt", "min", "max"
PI = "pi"
_NUMBER = re.compile(rf"(?<![\w.]){DECIMAL}(?![\d.])", re.ASCII)
_LITERAL = re.compile(rf"\s*([+-]?{DECIMAL})\s*(degC)?\s*", re.ASCII)


@dataclass(frozen=True)
class Measure:
    """A value in SI units and the powers of the base units that it has."""

    value: Fraction
    powers: Powers

    @staticmethod
    def from_float(value: float, powers: Powers) -> Measure:
        """Take the shortest decimal form of a double as exact."""
        return Measure(Fraction(repr(float(value))), powers)


def measured(text: str, names: Mapping[str, Measure]) -> tuple[float, Powers | None]:
    """Return the SI value of a quantity, or of an expression of the ``names``, and its powers.

    The powers are ``None`` for a number without a unit. Raises UnitError.
    """
    if len(text) > 500:
        raise UnitError("is longer than 500 characters: say parts of it as parameters of their own")
    plain = spelled(text)
    if match := _LITERAL.fullmatch(plain):
        value, celsius = exact(match[1]), bool(match[2])
        return double(value + ICE_POINT * celsius), UNITS["degC"][0] if celsius else None
    try:
        measure = _evaluate(plain, names)
    except RecursionError:
        raise UnitError("is nested too deep: say parts of it as parameters of their own") from None
    return double(measure.value), measure.powers


def _evaluate(plain: str, names: Mapping[str, Measure]) -> Measure:
    """Evaluate a text with every number and the unit behind it as a name of its own: _0, _1 and so on."""
    numbers, parts, at = dict[str, Measure](), list[str](), 0
    while match := _NUMBER.search(plain, at):
        parts.append(plain[at : match.start()])
        number, (unit, end) = match[0], leading_unit(plain, match.end(), names)
        if plain[match.end() : end].strip() == "degC":
            raise UnitError("has a temperature in degC among other terms: give it in K, or as a parameter of its own")
        if end > match.end() and plain.startswith("**", end):
            raise UnitError(f'has a power right after "{plain[match.start() : end]}": put brackets around it')
        if behind := re.compile(r"\s*([A-Za-z_]\w*)").match(plain, end):
            raise UnitError(f'has "{number} {printable(behind[1])}": write {number}*{printable(behind[1])}')
        parts.append(f" _{len(numbers)} ")
        numbers[f"_{len(numbers)}"] = Measure(exact(number) * unit.factor, unit.powers)
        at = end
    try:
        tree = ast.parse("".join([*parts, plain[at:]]).strip(), mode="eval") if plain.isascii() else None
    except (SyntaxError, ValueError, MemoryError):
        tree = None
    if tree is None or re.search(r"(?<!\w)_", plain):
        raise _unread()
    return _value(tree.body, {PI: Measure(Fraction(math.pi), PLAIN), **numbers}, names)


def _unread() -> UnitError:
    return UnitError('is not a number with a unit, and no expression such as "w/2"')


def _value(node: ast.expr, known: Mapping[str, Measure], names: Mapping[str, Measure]) -> Measure:
    match node:
        case ast.Name(id=name) if name in known:
            return known[name]
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.Name(id=name) if names:
            raise UnitError(f'names no parameter "{printable(name)}"{did_you_mean(name, names).rstrip("?")}')
        case ast.UnaryOp(op=ast.UAdd() | ast.USub() as sign, operand=operand):
            value = _value(operand, known, names)
            return Measure(-value.value if isinstance(sign, ast.USub) else value.value, value.powers)
        case ast.BinOp(left=left, op=operator, right=right):
            return _combined(operator, _value(left, known, names), _value(right, known, names))
        case ast.Call(func=ast.Name(id="sqrt"), args=[base], keywords=[]):
            return _raised(_value(base, known, names), Measure(Fraction(1, 2), PLAIN))
        case ast.Call(func=ast.Name(id="min" | "max" as name), args=[_, *_] as arguments, keywords=[]):
            measures = [_value(each, known, names) for each in arguments]
            for measure in measures[1:]:
                _refuse_unlike(measures[0], measure)
            chosen = max if name == "max" else min
            return Measure(chosen(each.value for each in measures), measures[0].powers)
        case ast.Call(func=ast.Name(id=name), args=[_, *_]):
            raise UnitError(f'has no function "{printable(name)}" of these numbers: there are {listed(FUNCTIONS)}')
    raise _unread()


def _combined(operator: ast.operator, a: Measure, b: Measure) -> Measure:
    match operator:
        case ast.Add() | ast.Sub():
            _refuse_unlike(a, b)
            return Measure(_short(a.value + b.value if isinstance(operator, ast.Add) else a.value - b.value), a.powers)
        case ast.Mult() | ast.Div():
            by = 1 if isinstance(operator, ast.Mult) else -1
            if by == -1 and not b.value:
                raise UnitError("divides by zero")
            powers = tuple(p + by * q for p, q in zip(a.powers, b.powers, strict=True))
            return Measure(_short(a.value * b.value**by), powers)
        case ast.Pow():
            return _raised(a, b)
    raise _unread()


def _refuse_unlike(a: Measure, b: Measure) -> None:
    if a.powers != b.powers:
        raise UnitError(f"adds or compares {called(a.powers)} and {called(b.powers)}")


def _raised(base: Measure, exponent: Measure) -> Measure:
    """A power; one that is no whole number is rounded to a double."""
    if exponent.powers != PLAIN:
        raise UnitError(f"has an exponent that is {called(exponent.powers)}, not a plain number")
    e, value = exponent.value, base.value
    if abs(e) > 100:  # no formula needs more, and exact fractions stay small
        raise UnitError("has an exponent beyond 100")
    if not value and e < 0:
        raise UnitError("divides by zero")
    near = e.limit_denominator(12)
    if base.powers != PLAIN and abs(near - e) > 1e-12:
        raise UnitError(f"raises {called(base.powers)} to {float(e):g}: give a fraction such as 1/2 or 2/3")
    powers = tuple(near * p for p in base.powers)
    if e.denominator == 1:
        return Measure(_short(value ** int(e)), powers)
    if value < 0:
        raise UnitError("takes a root of a negative number")
    root = math.sqrt(double(value)) if e == Fraction(1, 2) else double(value) ** float(e)
    return Measure(Fraction(root), powers)


def _short(value: Fraction) -> Fraction:
    """The fraction, rounded to a double where it has very many digits."""
    if max(value.numerator.bit_length(), value.denominator.bit_length()) <= 4000:
        return value
    return Fraction(double(value))
