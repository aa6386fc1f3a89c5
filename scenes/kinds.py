"""The kinds of value that a key of a scene may take: how each is read and checked, written back and shown.

``read`` turns what stands in a file into the value of a scene or raises SceneError; ``path`` is the key's full name,
such as "sink.width". A kind of the parametric scenes also has ``write``, which turns the value into what ``read`` takes
(SI numbers, plain JSON types), and ``show``, which is for a person.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any, Protocol

from scenes.dimensions import Dimension, named
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.units import UnitError, parse_quantity


class Readable(Protocol):
    """What a key's values are like."""

    def read(self, path: str, given: object) -> Any: ...


class Kind(Readable, Protocol):
    """The same, of a value that is also written and shown."""

    def write(self, value: Any) -> Any: ...
    def show(self, value: Any) -> str: ...


@dataclass(frozen=True)
class Quantity:
    """A number in SI units, or text with a unit, between two bounds that are themselves allowed.

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
        """The value in SI units, or ``None`` for the word that stands for it."""
        if self.word is not None and isinstance(given, str) and given == self.word:
            return None
        value, fault = self._number(given)
        if not fault and not math.isfinite(value):
            fault = "is not a finite number"
        if not fault and not self.lower <= (abs(value) if self.signed else value) <= self.upper:
            fault = "is out of range"
        if fault:
            raise SceneError(f"{path} = {quoted(given)} {fault}: give {self._allowed()}")
        return value

    def write(self, value: Any) -> Any:
        """A plain float, or the word for ``None``; what is no number stays as it is, for ``read`` to refuse."""
        if value is None and self.word is not None:
            return self.word
        return float(value) if isinstance(value, Real) and not isinstance(value, bool) else value

    def show(self, value: Any) -> str:
        """The value with its unit."""
        return self.word or "" if value is None else self.dimension.show(value)

    def _number(self, given: object) -> tuple[float, str]:
        """The SI value and what is wrong with it, one of the two being empty."""
        if isinstance(given, str):
            try:
                value, unit = parse_quantity(given)
            except UnitError as error:
                return 0.0, str(error)
            if unit is not None and unit.powers != self.dimension.powers:
                return 0.0, f"is {named(unit.powers) or 'another quantity'}, not {self.dimension.name}"
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
class Insulator:
    """A resistivity that is checked and then left out, for a material that the model takes for an insulator."""

    quantity: Quantity

    def read(self, path: str, given: object) -> None:
        """Always ``None``; refuses a resistivity below the quantity's lower bound."""
        self.quantity.read(path, given)

    def write(self, value: Any) -> Any:
        """The word for an insulator."""
        return self.quantity.write(value)

    def show(self, value: Any) -> str:
        """The word for an insulator."""
        return self.quantity.show(value)


@dataclass(frozen=True)
class Choice:
    """One of a few words."""

    options: tuple[str, ...]

    def read(self, path: str, given: object) -> str:
        """The word itself."""
        if isinstance(given, str) and given in self.options:
            return given
        known = " or ".join(f'"{o}"' for o in self.options)
        hint = did_you_mean(given, self.options) if isinstance(given, str) else ""
        raise SceneError(f"{path} = {quoted(given)} is not known: give {known}{hint}")

    def write(self, value: Any) -> Any:
        """The word itself."""
        return value

    def show(self, value: Any) -> str:
        """The word itself."""
        return str(value)


@dataclass(frozen=True)
class Switch:
    """True or false."""

    def read(self, path: str, given: object) -> bool:
        """The boolean itself."""
        if isinstance(given, bool):
            return given
        raise SceneError(f"{path} = {quoted(given)} is neither true nor false: give one of these")

    def write(self, value: Any) -> Any:
        """The boolean itself."""
        return value

    def show(self, value: Any) -> str:
        """As a file has it."""
        return str(value).lower()


@dataclass(frozen=True)
class Text:
    """A text of a form (a regular expression); ``refusal`` ends the sentence on any other."""

    form: str
    refusal: str
    longest: int = 60

    def read(self, path: str, given: object) -> str:
        """The text itself."""
        if isinstance(given, str) and len(given) <= self.longest and re.fullmatch(self.form, given):
            return given
        raise SceneError(f"{path} = {quoted(given)} {self.refusal}")

    def write(self, value: Any) -> Any:
        """The text itself."""
        return value

    def show(self, value: Any) -> str:
        """The text itself."""
        return str(value)


NAME = Text(
    r"\w([\w .-]*\w)?",
    "cannot name a results folder: give text of 1 to 60 letters, digits, spaces, dots, - and _, with a letter or digit "
    "at either end",
)
"""A short text that is safe as part of a folder's name."""


def _type_name(given: object) -> str:
    if given is None:
        return "missing"
    names: tuple[tuple[type | tuple[type, ...], str], ...] = (
        (bool, "a boolean"),
        (Mapping, "a table"),
        ((list, tuple), "a list"),
    )
    return next((name for kind, name in names if isinstance(given, kind)), f"a {type(given).__name__}")
