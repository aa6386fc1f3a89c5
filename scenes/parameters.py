"""The [parameters] of a scene file: named numbers with units, w = "10 um", and expressions of them, half = "w/2".

Wherever the file takes a number it takes an expression of parameters in a string, so that one parameter moves
everything that is made of it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, fields, is_dataclass, replace
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from keyword import kwlist
from numbers import Real
from types import MappingProxyType
from typing import Any

from scenes.errors import SceneError, printable, quoted, unknown
from scenes.expressions import FUNCTIONS, PI, Measure, measured
from scenes.units import PLAIN, UNITS, Powers, UnitError, called, dimension_of

SECTION = "parameters"
_NAME = re.compile(r"(?<![\w.])[A-Za-z]\w{0,59}(?!\w)", re.ASCII)
_FORM = 'give a number with a unit, such as "20 um", or an expression of other parameters, such as "w/2"'
_KNOWN = ContextVar[Mapping[str, Measure]]("parameters of the scene that is read", default=MappingProxyType({}))


class Names(dict[str, Measure]):
    """The values of the names in a [parameters] section.

    ``parts`` are the parameters that each one is made of, which are before it in ``order``; ``used`` are the ones that
    expressions of the rest of the file take. Raises SceneError for invalid names and values, and for parameters that
    are made of themselves.
    """

    def __init__(self, given: object) -> None:
        super().__init__()
        if not isinstance(given, Mapping):
            raise SceneError(f'{SECTION} = {quoted(given)} must be a section: {SECTION}.w = "10 um" and so on')
        for name in given:
            _check_name(name)
        texts = {name: text if isinstance(text, str) else "" for name, text in given.items()}
        self.parts = {name: set(_NAME.findall(text)) & set(given) for name, text in texts.items()}
        self.used: set[str] = set()
        try:
            self.order = list(TopologicalSorter(self.parts).static_order())
        except CycleError as error:
            circle = error.args[1][::-1]
            by = ", ".join(f"{a} of {b}" for a, b in pairwise(circle))
            raise SceneError(f"{SECTION}.{circle[0]} is made of itself, {by}: {_FORM}") from None
        for name in self.order:
            try:
                self[name] = _measure(given[name], self)
            except UnitError as error:
                raise SceneError(f"{SECTION}.{name} = {quoted(given[name])} {error}: {_FORM}") from None
        for name in given:  # in the order of the file
            self[name] = self.pop(name)
        self.used.clear()

    def __getitem__(self, name: str) -> Measure:
        self.used.add(name)
        return super().__getitem__(name)

    def free(self) -> tuple[str, ...]:
        """Return the parameters that are plain numbers and that the scene uses, directly or through others."""
        reached = set(self.used)
        for name in reversed(self.order):
            if name in reached:
                reached |= self.parts[name]
        return tuple(name for name in self if name in reached and not self.parts[name])


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        fault = "is no name: give letters, digits and _, a letter first, 60 at most"
    elif name in (*FUNCTIONS, PI, *kwlist):
        fault = f"is called like a function or a word of Python: give another name, such as {name}_0"
    elif name in UNITS:
        fault = f"is called like a unit, and 2 {name} would be two things: give another name, such as {name}_0"
    else:
        return
    raise SceneError(f"{SECTION}.{printable(name)} {fault}")


def _measure(given: Any, names: Names) -> Measure:
    value, powers = measured(str(given), names)
    return Measure.from_float(value, powers or PLAIN)


@contextmanager
def known(names: Mapping[str, Measure]) -> Iterator[None]:
    """Let expressions use these names while the values of one file are read."""
    token = _KNOWN.set(names)
    try:
        yield
    finally:
        _KNOWN.reset(token)


def quantity(text: str) -> tuple[float, Powers | None]:
    """Return the SI value of a quantity or of an expression of the current parameters, and its powers.

    The powers are ``None`` for a number without a unit, which is in SI units. Raises UnitError.
    """
    return measured(text, _KNOWN.get())


@dataclass(frozen=True)
class Parameters:
    """The parameters of a scene that was read: their ``measures`` by name, the ``free`` ones (`Names.free`), and the
    ``flat`` scene with its expressions."""

    measures: Mapping[str, Measure]
    free: tuple[str, ...]
    flat: Mapping[str, Any]

    @property
    def values(self) -> dict[str, float]:
        """The values by name, in SI units."""
        return {name: float(measure.value) for name, measure in self.measures.items()}

    def key(self, path: str) -> str | None:
        """Return the free parameter that a path such as "parameters.w" names, ``None`` where the path names none.

        Raises SceneError for a parameter that is zero or not free.
        """
        name = path.removeprefix(f"{SECTION}.")
        if name == path or name not in self.measures:
            return None
        if name in self.free and self.measures[name].value:
            return name
        given, others = self.flat[SECTION][name], ", ".join(f"{SECTION}.{n}" for n in self.free) or "another key"
        raise SceneError(f"{path} = {quoted(given)} is zero, is made of others, or moves nothing: give {others}")

    def scaled(self, name: str, factor: float) -> dict[str, object]:
        """Return the flat scene with a parameter multiplied by a factor."""
        unit = dimension_of(self.measures[name].powers).unit
        return {**self.flat, SECTION: {**self.flat[SECTION], name: f"{self.values[name] * factor!r} {unit}"}}


def _si_unit(given: object) -> str:
    """Return the unit of a text "0.1 V" where it is an SI unit without a prefix; else nothing."""
    found = re.fullmatch(r"\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*([^\W\d].*)", given) if isinstance(given, str) else None
    return found[1] if found and quantity(f"1 {found[1]}")[0] == 1 else ""


def put(table: Any, name: str, value: object) -> dict[str, object]:
    """Return the table with another value of one of its parameters, read as in a file.

    A plain number takes the unit of the file where that is an SI unit without a prefix, 0.2 in place of "0.1 V".
    Raises SceneError for an unknown parameter, and for another kind of quantity."""
    names = Names({} if table is None else table)
    path = f"{SECTION}.{printable(name)}"
    if name not in names:
        raise unknown("the [parameters] of this scene have no", name, names)
    powers = names[name].powers
    try:
        other = _measure(value, names)
    except UnitError as error:
        raise SceneError(f"{path} = {quoted(value)} {error}: {_FORM}") from None
    if other.powers == PLAIN != powers and (unit := _si_unit(table[name])):
        return {**table, name: f"{value} {unit}"}
    if other.powers != powers:
        raise SceneError(f"{path} = {quoted(value)} is {called(other.powers)}, not {called(powers)}: {_FORM}")
    return {**table, name: value}


def transferred(value: Any, before: Any, after: Any, part: float = 1.0) -> Any:
    """Return a scene, or a value of a scene, with a ``part`` of the change of another from ``before`` to ``after``.

    Numbers change by that part of the difference, any other changed value becomes as in ``after``.
    """
    if before == after:
        return value
    if part == 1 and value == before:
        return after
    if isinstance(value, tuple) and isinstance(after, tuple) and len(value) == len(before) == len(after):
        return tuple(transferred(*each, part) for each in zip(value, before, after, strict=True))
    if is_dataclass(value) and not isinstance(value, type) and type(value) is type(before) is type(after):
        parts = ((f.name, *(getattr(x, f.name) for x in (value, before, after))) for f in fields(value) if f.compare)
        return replace(value, **{name: transferred(g, b, a, part) for name, g, b, a in parts})
    if all(isinstance(x, Real) and not isinstance(x, bool) for x in (value, before, after)):
        return value + part * (after - before)
    return after
