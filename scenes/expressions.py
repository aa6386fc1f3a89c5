"""Expressions of quantities: "w/2", "L - 2*w", "max(2 um, h + gap)".

Python's own parser makes a syntax tree, of which only sums, products, powers, signs, names and three functions are
evaluated; no text is ever run as code. Units are checked: only like quantities are added or compared. Numbers are exact
fractions but for roots, so that "2 um + 0.5 um" is the very double that "2.5 um" is, and faces that are meant to lie in
one plane do.
"""

from __future__ import annotations

import ast
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
MOST_BITS = 4000  # of an exact fraction; one with more is rounded to a double
ROOTS = 12  # largest denominator of a unit's exponent

FUNCTIONS = ("sqrt", "min", "max")
PI = "pi"
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*", re.ASCII)
_NUMBER = re.compile(r"(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_ALLOWED = re.compile(r"[\w .+*/(),-]*", re.ASCII)


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
    plain, quantities = _extract(spelled(text).strip().replace("^", "**"), names)
    try:
        if not _ALLOWED.fullmatch(plain):
            raise SyntaxError
        tree = ast.parse(plain, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise _UnreadError(
            'is no expression: give numbers with units, names, + - * / **, brackets, such as "w/2"'
        ) from None
    return _evaluate(tree, names, quantities, 0)


def _extract(text: str, names: Mapping[str, Measure]) -> tuple[str, dict[str, Measure]]:
    """The text with a name of its own in place of every number, and the quantities by these names."""
    quantities, pieces, at = dict[str, Measure](), list[str](), 0
    for number in _NUMBER.finditer(text):
        if number.start() < at:
            continue  # a digit inside of a unit
        unit, end, powers, factor = LEADING_UNIT.match(text, number.end()), number.end(), PLAIN, Fraction(1)
        if unit is not None:
            end, said = unit.end(), unit[0]
            _refuse_ambiguous(said, names)
            parsed = parse_unit(said)
            if parsed.celsius:
                raise UnitError(
                    "has a temperature in degC among other terms: give it in K, or as a parameter of its own"
                )
            if text[end:].lstrip().startswith("**"):
                raise UnitError(f'has a power right after "{number[0]}{said}": put brackets around what it is of')
            powers, factor = parsed.powers, parsed.factor
        elif (name := re.match(r"\s*([A-Za-z_]\w*)", text[end:], re.ASCII)) is not None:
            raise _UnreadError(f'has "{number[0]} {printable(name[1])}": write {number[0]}*{printable(name[1])}')
        # A double bounds the exponent before an exact power of ten could fill the memory.
        if not math.isfinite(value := float(number[0])):
            raise UnitError("is not a finite number")
        key = f"_{len(quantities)}"
        quantities[key] = Measure(Fraction(number[0]) * factor if value else Fraction(0), powers)
        pieces += [text[at : number.start()], key]
        at = end
    return "".join([*pieces, text[at:]]), quantities


def _refuse_ambiguous(unit: str, names: Mapping[str, Measure]) -> None:
    """Refuse a unit that is a parameter's name too, such as m2 in "5 W/m2"."""
    for name in _NAME.findall(unit):
        if name in names:
            base = name.rstrip("0123456789")
            power = f"write {base}**{name[len(base) :]} for the unit, or rename the parameter"
            raise UnitError(f'has "{name}", a unit and a parameter: {power}')


def _evaluate(node: ast.expr, names: Mapping[str, Measure], quantities: Mapping[str, Measure], depth: int) -> Measure:
    if depth > DEEPEST:
        raise UnitError(f"is nested more than {DEEPEST} deep: say parts of it as parameters of their own")

    def inner(part: ast.expr) -> Measure:
        return _evaluate(part, names, quantities, depth + 1)

    match node:
        case ast.Name(id=name):
            if name == PI:
                return Measure(Fraction(math.pi), PLAIN)
            if name in quantities:
                return quantities[name]
            if name not in names:
                raise _UnreadError(f'names no parameter "{printable(name)}"{did_you_mean(name, names).rstrip("?")}')
            return names[name]
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return inner(operand)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return Measure(-(negated := inner(operand)).value, negated.powers)
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return _raised(inner(left), inner(right))
        case ast.BinOp():
            # Terms of one sum are not nested, however many there are.
            terms, first = list[ast.BinOp](), node
            while isinstance(first, ast.BinOp) and not isinstance(first.op, ast.Pow):
                terms.append(first)
                first = first.left  # type: ignore[assignment]
            total = inner(first)
            for term in reversed(terms):
                total = _combined(total, term.op, inner(term.right))
            return total
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if args:
            if name not in FUNCTIONS:
                raise _UnreadError(f'has no function "{printable(name)}": there are {listed(FUNCTIONS)}')
            return _function(name, [inner(each) for each in args])
    raise _UnreadError("is no expression of numbers, names, + - * / **, brackets and functions")


def _combined(a: Measure, op: ast.operator, b: Measure) -> Measure:
    """A sum, difference, product or quotient."""
    match op:
        case ast.Add():
            _refuse_unlike(a, b, "adds {1} to {0}")
            return Measure(_short(a.value + b.value), a.powers)
        case ast.Sub():
            _refuse_unlike(a, b, "subtracts {1} from {0}")
            return Measure(_short(a.value - b.value), a.powers)
        case ast.Mult() | ast.Div():
            by = 1 if isinstance(op, ast.Mult) else -1
            if by == -1 and not b.value:
                raise UnitError("divides by zero")
            powers: Powers = tuple(p + by * q for p, q in zip(a.powers, b.powers, strict=True))  # type: ignore[assignment]
            return Measure(_short(a.value * b.value**by), powers)
    raise _UnreadError("has an operator other than + - * / **")


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
