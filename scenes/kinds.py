"""The kinds of value that a key of a scene may take: how each is read and checked, written back and shown.

Every kind has the same three methods: ``read`` turns what stands in a file into the value of a scene or raises
SceneError, ``write`` turns the value into what ``read`` takes (SI numbers, plain JSON types), and ``show`` is for a
person. ``path`` is the key's full name, such as "sink.width".
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any, Protocol

from scenes.errors import SceneError, did_you_mean, quoted
from scenes.expressions import is_expression
from scenes.parameters import quantity
from scenes.units import PLAIN, TEMPERATURE, TIME, Dimension, UnitError, called, meant  # fmt: skip


class Kind(Protocol):
    """What a key's values are like; those of most kinds are written and shown as they stand."""

    def read(self, path: str, given: object) -> Any: ...

    def write(self, value: Any) -> Any:
        return value

    def show(self, value: Any) -> str:
        return str(value)


@dataclass(frozen=True)
class Quantity(Kind):
    """A number in SI units, or text with a unit, or an expression, between two bounds that are themselves allowed.

    ``signed`` bounds the magnitude instead, either sign being allowed. ``word`` is what a file says for ``None``.
    ``note`` ends the sentence of every refusal, where the bounds need a reason.
    """

    dimension: Dimension
    lower: float
    upper: float
    signed: bool = False
    word: str | None = None
    note: str = ""

    def read(self, path: str, given: object) -> float | None:
        if self.word is not None and isinstance(given, str) and given == self.word:
            return None
        value, fault = self._number(given)
        if not fault and not math.isfinite(value):
            fault = "is not a finite number"
        if not fault and not self.lower <= (abs(value) if self.signed else value) <= self.upper:
            fault = "is out of range"
        if fault:
            computed = f" = {self.dimension.show(value)}" if value and is_expression(given) else ""
            raise SceneError(f"{path} = {quoted(given)}{computed} {fault}: give {self._allowed()}")
        return value

    def write(self, value: Any) -> Any:
        """A plain float, or the word for ``None``; what is no number stays as it is, for ``read`` to refuse."""
        if value is None and self.word is not None:
            return self.word
        return float(value) if isinstance(value, Real) and not isinstance(value, bool) else value

    def show(self, value: Any) -> str:
        return self.word or "" if value is None else self.dimension.show(value)

    def _number(self, given: object) -> tuple[float, str]:
        """The SI value and what is wrong with it, one of the two being empty."""
        if isinstance(given, str):
            try:
                value, powers = quantity(given)
            except UnitError as error:
                near = meant(given, self.dimension.powers)
                return 0.0, f'{str(error).partition(", did")[0]}, did you mean "{near}"' if near else str(error)
            if powers is not None and powers != self.dimension.powers:
                near = meant(given, self.dimension.powers)
                hint = f', did you mean "{near}"' if near else ""
                return 0.0, f"is {called(powers)}, not {self.dimension.name}{hint}"
            return value, ""
        if isinstance(given, bool) or not isinstance(given, Real):
            return 0.0, f"is {_type_name(given)}, not {self.dimension.name}"
        try:
            return float(given), ""
        except OverflowError:
            return math.inf, ""

    def _allowed(self) -> str:
        d = self.dimension
        unit = f" in {d.unit}" if d.unit else ""
        span = f"{'of magnitude' if self.signed else 'from'} {d.show(self.lower)} to {d.show(self.upper)}"
        word = f', or "{self.word}"' if self.word else ""
        return f'a number{unit} or text such as "{d.example}", {span}{word}{self.note}'


@dataclass(frozen=True)
class Count(Kind):
    """A whole number between two bounds that are themselves allowed; text and 3.0 will do, 2.5 will not."""

    lower: int
    upper: int

    def read(self, path: str, given: object) -> int:
        try:
            value, powers = quantity(given) if isinstance(given, str) else (float(given), None)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            value, powers = math.nan, None
        whole = value.is_integer() and powers in (None, PLAIN) and not isinstance(given, bool)
        if not (whole and self.lower <= value <= self.upper):
            raise SceneError(f"{path} = {quoted(given)} must be a whole number from {self.lower} to {self.upper}")
        return int(value)


@dataclass(frozen=True)
class Insulator(Kind):
    """A resistivity that is checked and then left out, for a material that the model takes for an insulator."""

    quantity: Quantity

    def read(self, path: str, given: object) -> None:
        self.quantity.read(path, given)

    def write(self, value: Any) -> Any:
        return self.quantity.write(value)

    def show(self, value: Any) -> str:
        return self.quantity.show(value)


@dataclass(frozen=True)
class Choice(Kind):
    options: tuple[str, ...]

    def read(self, path: str, given: object) -> str:
        if isinstance(given, str) and given in self.options:
            return given
        known = " or ".join(f'"{o}"' for o in self.options)
        hint = did_you_mean(given, self.options) if isinstance(given, str) else ""
        raise SceneError(f"{path} = {quoted(given)} is not known: give {known}{hint}")


@dataclass(frozen=True)
class Numbers(Kind):
    """A table of values by name, of those ``known`` (any where none is), each a ``quantity``; ``called`` is what a name
    is of, and ``form`` ends the sentence on what is no such table."""

    quantity: Kind
    known: tuple[str, ...]
    called: str
    form: str

    def read(self, path: str, given: object) -> dict[str, Any]:
        if not isinstance(given, Mapping):
            raise SceneError(f"{path} = {quoted(given)} must be {self.form}")
        for name in given if self.known else ():
            known_name(path, name, self.known, self.called)
        return {str(name): self.quantity.read(f"{path}.{name}", value) for name, value in given.items()}

    def write(self, value: Any) -> Any:
        return {k: self.quantity.write(v) for k, v in value.items()} if isinstance(value, Mapping) else value

    def show(self, value: Any) -> str:
        return ", ".join(f"{name} {self.quantity.show(number)}" for name, number in value.items())


def known_name(path: str, name: object, known: tuple[str, ...], called: str) -> str:
    """A name among those known, else SceneError. Of the many of a kind, its list has one: a row's checks."""
    if isinstance(name, str) and name in known:
        return name
    hint = did_you_mean(name, known) if isinstance(name, str) else ""
    shown = [each for each in known if not each.startswith("islands_") or each == "islands_mean"]
    raise SceneError(f"{path} names an unknown {called} {quoted(name)}: give {', '.join(shown)}{hint}")


@dataclass(frozen=True)
class NumberOrText(Kind):
    """A finite number, or a text whose meaning is told by what it is for."""

    def read(self, path: str, given: object) -> float | str:
        if isinstance(given, str) and given.strip():
            return given
        if isinstance(given, bool) or not isinstance(given, Real) or not math.isfinite(given):
            raise SceneError(f'{path} = {quoted(given)} is not a value: give a number, or text such as "2 um"')
        return float(given)


@dataclass(frozen=True)
class Switch(Kind):
    def read(self, path: str, given: object) -> bool:
        if isinstance(given, bool):
            return given
        raise SceneError(f"{path} = {quoted(given)} is neither true nor false: give one of these")

    def show(self, value: Any) -> str:
        return str(value).lower()


@dataclass(frozen=True)
class Text(Kind):
    """A text of a form (a regular expression); ``refusal`` ends the sentence on any other."""

    form: str
    refusal: str
    longest: int = 60

    def read(self, path: str, given: object) -> str:
        if isinstance(given, str) and len(given) <= self.longest and re.fullmatch(self.form, given):
            return given
        raise SceneError(f"{path} = {quoted(given)} {self.refusal}")


NAME = Text(
    r"\w([\w .-]*\w)?",
    "cannot name a results folder: give text of 1 to 60 letters, digits, spaces, dots, - and _, with a letter or digit "
    "at either end",
)
"""A short text that is safe in a folder's name."""


INSTANT = Quantity(TIME, 0.0, 1e9)


@dataclass(frozen=True)
class Place(Kind):
    """A point [x, y, z]."""

    coordinate: Quantity

    def read(self, path: str, given: object) -> tuple[float, float, float]:
        if not isinstance(given, (list, tuple)) or len(given) != 3:
            raise SceneError(f'{path} = {quoted(given)} is not a point: give [x, y, z], such as [0, "-50 um", 2e-6]')
        x, y, z = (self.coordinate.read(f"{path}[{'xyz'[d]}]", c) or 0.0 for d, c in enumerate(given))
        return x, y, z


MOST_TIMES = 10_000
"""The most output times: each is a row of traces.csv."""


@dataclass(frozen=True)
class Instants(Kind):
    """A list of times; the value has each once, ascending."""

    def read(self, path: str, given: object) -> tuple[float, ...]:
        if not isinstance(given, (list, tuple)) or not given:
            raise SceneError(f'{path} = {quoted(given)} is not a list of times: give some, such as [0.1, "200 ms"]')
        if len(given) > MOST_TIMES:
            raise SceneError(
                f"{path} has {len(given)} times: give at most {MOST_TIMES}; whatever is given here, traces.csv has as "
                "many rows as the accuracy takes"
            )
        return tuple(sorted({INSTANT.read(f"{path}[{i}]", t) or 0.0 for i, t in enumerate(given, 1)}))


@dataclass(frozen=True)
class Pair(Kind):
    """A list of two names; ``called`` says of what."""

    member: Kind
    called: str

    def read(self, path: str, given: object) -> tuple[str, str]:
        if not isinstance(given, (list, tuple)) or len(given) != 2:
            raise SceneError(f'{path} = {quoted(given)} is not a pair: give two {self.called}, such as ["a", "b"]')
        one, other = (self.member.read(f"{path}[{i}]", name) for i, name in enumerate(given, 1))
        return one, other


@dataclass(frozen=True)
class Names(Kind):
    """A list of names; ``called`` says of what."""

    member: Kind
    called: str

    def read(self, path: str, given: object) -> tuple[str, ...]:
        if isinstance(given, (list, tuple)) and given:
            return tuple(self.member.read(f"{path}[{i}]", name) for i, name in enumerate(given, 1))
        raise SceneError(f'{path} = {quoted(given)} is not a list of {self.called}: give some, such as ["silicon"]')


LABEL = Text(
    r"\w([\w .+-]*\w)?",
    "is not a name: give text of 1 to 60 letters, digits, spaces, dots, +, - and _, with a letter or digit at either "
    "end",
)
"""The name of a part, used by messages, overrides and columns."""
MODEL_FILE = Text(r"[ -~\u00a0-\uffff]*\S[ -~\u00a0-\uffff]*", "is no text of one line", longest=4096)
KELVIN = Quantity(TEMPERATURE, 0.0, 1e6)


def only(path: str, given: Mapping[Any, object], known: tuple[str, ...]) -> None:
    """Refuses a name in a table that is not known."""
    for name, value in given.items():
        if name not in known:
            hint = did_you_mean(name, known)
            raise SceneError(f"unknown key {path}.{name} = {quoted(value)}: give {' and '.join(known)}{hint}")


def _type_name(given: object) -> str:
    if given is None:
        return "missing"
    names = {bool: "a boolean", Mapping: "a table", list: "a list", tuple: "a list"}
    return next((name for kind, name in names.items() if isinstance(given, kind)), f"a {type(given).__name__}")
