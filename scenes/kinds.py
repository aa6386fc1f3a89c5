"""The kinds of value that a key of a scene may take: how each is read and checked, written back, shown and described.

``read`` turns the content of a file into the value of a scene or raises SceneError, ``write`` turns the value into SI
numbers and plain JSON types that ``read`` takes, ``show`` is for a person, and ``form`` describes the values that a
file may give, in refusals and in the table of keys. ``path`` is the key's full name, such as "sink.width".
"""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from numbers import Real
from typing import Any

from scenes.errors import SceneError, did_you_mean, quoted, unknown
from scenes.parameters import quantity
from scenes.units import LENGTH, NUMBER, TEMPERATURE, TIME, Dimension, UnitError, called

_MEMORY = re.compile(r"\s*(\d+\.?\d*(?:e\+?\d+)?)\s*(kB|MB|GB|TB)?\s*", re.ASCII)


class Kind(ABC):
    """A kind of value; ``word`` stands for ``None`` in a file, where ``None`` is allowed."""

    word: str | None = None

    @property
    @abstractmethod
    def form(self) -> str:
        """The values that a file may give, in words."""

    @abstractmethod
    def read(self, path: str, given: object) -> Any:
        """Return the value; raises SceneError."""

    def write(self, value: Any) -> Any:
        """Return the value as a file has it."""
        word = getattr(self, "quantity", self).word
        return word if value is None and word is not None else plain(value)

    def show(self, value: Any) -> str:
        """Return the value as text."""
        return str(value).lower() if isinstance(value, bool) else str(self.write(value))

    def refusal(self, path: str, given: object, fault: str) -> SceneError:
        """Return the error for a value with a fault."""
        return SceneError(f"{path} = {quoted(given)} {fault}: give {self.form}")


def plain(value: Any) -> Any:
    """Return SI numbers and plain JSON types; a dataclass becomes a table of its fields."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return float(value) if isinstance(value, Real) and not isinstance(value, bool) else value


@dataclass(frozen=True)
class Quantity(Kind):
    """A number in SI units, text with a unit, or an expression, between two bounds that are themselves allowed.

    ``signed`` bounds the magnitude instead, either sign being allowed, and ``or_zero`` allows 0 below the bounds.
    ``note`` ends the description, where the bounds need a reason.
    """

    dimension: Dimension
    lower: float
    upper: float
    signed: bool = False
    word: str | None = None
    note: str = ""
    or_zero: bool = False

    @property
    def form(self) -> str:
        d = self.dimension
        unit = f" in {d.unit}" if d.unit else ""
        span = f"{'of magnitude' if self.signed else 'from'} {d.show(self.lower)} to {d.show(self.upper)}"
        word = f', or "{self.word}"' if self.word else ""
        return f'a number{unit} or text such as "{d.example}", {span}{word}{self.note}'

    def read(self, path: str, given: object) -> float | None:
        if self.word is not None and isinstance(given, str) and given == self.word:
            return None
        value, fault = self.number(given)
        if not fault and not math.isfinite(value):
            fault = "is not a finite number"
        within = self.lower <= (abs(value) if self.signed else value) <= self.upper
        if not fault and not within and not (self.or_zero and value == 0):
            fault = "is out of range"
        if fault:
            computed = f"= {self.dimension.show(value)} " if value and isinstance(given, str) else ""
            raise self.refusal(path, given, computed + fault)
        return value

    def show(self, value: Any) -> str:
        return self.word or "" if value is None else self.dimension.show(value)

    def number(self, given: object) -> tuple[float, str]:
        """Return the SI value and its fault, one of the two being empty."""
        if isinstance(given, str):
            try:
                value, powers = quantity(given)
            except UnitError as error:
                return 0.0, str(error)
            if powers is not None and powers != self.dimension.powers:
                return 0.0, f"is {called(powers)}, not {self.dimension.name}"
            return value, ""
        if isinstance(given, bool) or not isinstance(given, Real):
            return 0.0, f"is not {self.dimension.name}"
        try:
            return float(given), ""
        except OverflowError:
            return math.inf, ""


@dataclass(frozen=True)
class Count(Kind):
    """A whole number between two bounds that are themselves allowed; text and 3.0 will do, 2.5 will not."""

    lower: int
    upper: int

    @property
    def form(self) -> str:
        return f"a whole number from {self.lower} to {self.upper}"

    def write(self, value: Any) -> Any:
        return value

    def read(self, path: str, given: object) -> int:
        value, fault = Quantity(NUMBER, 0.0, 0.0).number(given)
        if fault or not (value.is_integer() and self.lower <= value <= self.upper):
            raise SceneError(f"{path} = {quoted(given)} must be {self.form}")
        return int(value)


@dataclass(frozen=True)
class Insulator(Quantity):
    """A resistivity that is checked and then left out, for a material that the model takes for an insulator."""

    def read(self, path: str, given: object) -> None:
        super().read(path, given)


@dataclass(frozen=True)
class Choice(Kind):
    """One of some words."""

    options: tuple[str, ...]

    @property
    def form(self) -> str:
        return " or ".join(f'"{o}"' for o in self.options)

    def read(self, path: str, given: object) -> str:
        if isinstance(given, str) and given in self.options:
            return given
        raise SceneError(f"{path} = {quoted(given)} is not known: give {self.form}{did_you_mean(given, self.options)}")


@dataclass(frozen=True)
class Converted(Kind):
    """A value that a function makes of the content of a file, ``None`` where this is unfit; ``fault`` refuses it."""

    fault: str
    convert: Callable[[Any], Any]
    form: str = ""

    def read(self, path: str, given: object) -> Any:
        value = self.convert(given)
        if value is None:
            raise self.refusal(path, given, self.fault)
        return value


def _matching(pattern: str, longest: int = 60) -> Callable[[Any], str | None]:
    """Return the function that accepts texts of a regular expression."""
    return lambda given: (
        given if isinstance(given, str) and len(given) <= longest and re.fullmatch(pattern, given) else None
    )


def _bytes(given: Any) -> float | None:
    match = _MEMORY.fullmatch(str(given))
    size = float(match[1]) * 1e3 ** ["", "kB", "MB", "GB", "TB"].index(match[2] or "") if match else 0.0
    return size if 1e8 <= size <= 1e15 and not isinstance(given, bool) else None


def _number_or_text(given: Any) -> float | str | None:
    if isinstance(given, str):
        return given if given.strip() else None
    number = isinstance(given, Real) and not isinstance(given, bool) and math.isfinite(given)
    return float(given) if number else None


def _group(given: Any) -> str | None:
    whole = isinstance(given, int) and not isinstance(given, bool)
    return str(given) if whole or (isinstance(given, str) and given.strip()) else None


def _metres(given: Any) -> float | None:
    alone = isinstance(given, str) and not given[:1].isdigit()
    value, fault = Quantity(LENGTH, 0.0, 0.0).number(f"1 {given}" if alone else given)
    # From a picometre to a thousand kilometres.
    return value if not fault and 1e-12 <= value <= 1e6 else None


LABEL = Converted(
    "is not a name", _matching(r"\w([\w .+-]*\w)?"),
    "text of 1 to 60 letters, digits, spaces, dots, +, - and _, with a letter or digit at either end",
)  # fmt: skip
"""The name of a scene, safe in a folder's name, or of a part, used by messages, overrides and columns."""
MODEL_FILE = Converted(
    "is no text of one line", _matching(r"[ -~\u00a0-\uffff]*\S[ -~\u00a0-\uffff]*", 4096), "a line of text"
)
MESH_FILE = Converted("is no path of a mesh", _matching(r"[^\0]*[^\0\s][^\0]*", 4096), 'one such as "chip.msh"')
SWITCH = Converted(
    "is neither true nor false", lambda given: given if isinstance(given, bool) else None, "true or false"
)
MEMORY = Converted("is no size of memory", _bytes, 'a number of bytes or text such as "8 GB", at least 0.1 GB')
NUMBER_OR_TEXT = Converted("is not a value", _number_or_text, 'a number, or text such as "2 um"')
"""A finite number, or a text that the user of the value reads."""
GROUP = Converted("is not a group", _group, "its name, or its number where it has none")
"""The name of a group of a mesh, or the number of one that has no name."""
LENGTH_UNIT = Converted("is not a unit of length", _metres, '"um", "mm" or 1e-6')
"""The unit (m) of a file's coordinates."""


@dataclass(frozen=True)
class Numbers(Kind):
    """A table of values by name, of the ``known`` names (any where there are none), each a ``quantity``."""

    quantity: Kind
    known: tuple[str, ...]
    called: str
    form: str = ""

    def read(self, path: str, given: object) -> dict[str, Any]:
        if not isinstance(given, Mapping):
            raise SceneError(f"{path} = {quoted(given)} must be {self.form}")
        for name in given:
            if self.known and name not in self.known:
                raise unknown(f"{path} names an unknown {self.called}", name, self.known)
        return {str(name): self.quantity.read(f"{path}.{name}", value) for name, value in given.items()}

    def show(self, value: Any) -> str:
        return ", ".join(f"{name} {self.quantity.show(number)}" for name, number in value.items())


@dataclass(frozen=True)
class Items(Kind):
    """A list of at most ``most`` values of one kind, ``called`` so; ``example`` is one list, and ``count`` its length,
    if fixed. ``ascending`` values have each once."""

    member: Kind
    called: str
    example: str
    count: int = 0
    ascending: bool = False
    most: int = 10_000  # each output time is a row of traces.csv

    @property
    def form(self) -> str:
        count = f"{self.count} " if self.count else ""
        return f"a list of {count}{self.called}, such as {self.example}"

    def read(self, path: str, given: object) -> tuple[Any, ...]:
        if not isinstance(given, (list, tuple)) or not given or self.count not in (0, len(given)):
            raise self.refusal(path, given, "does not fit")
        if len(given) > self.most:
            raise SceneError(f"{path} has {len(given)} {self.called}: give at most {self.most}")
        places = "xyz" if self.count == 3 else range(1, len(given) + 1)
        values = [self.member.read(f"{path}[{place}]", each) for place, each in zip(places, given, strict=True)]
        return tuple(sorted(set(values)) if self.ascending else values)


INSTANT = Quantity(TIME, 0.0, 1e9)
KELVIN = Quantity(TEMPERATURE, 0.0, 1e6)


def only(path: str, given: Mapping[Any, object], known: tuple[str, ...]) -> None:
    """Refuse an unknown name in a table."""
    for name, value in given.items():
        if name not in known:
            allowed = f"give {', '.join(known)}{did_you_mean(name, known)}"
            raise SceneError(f"unknown key {path}.{name} = {quoted(value)}: {allowed}")
