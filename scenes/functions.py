"""Kinds of value that depend on something: on time, on the temperature, on a face's surroundings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from scenes.errors import SceneError, quoted
from scenes.kinds import INSTANT, Kind, Quantity, only
from scenes.laws import PowerLaw, Property, Table
from scenes.model import ROUNDING, Schedule, Value
from scenes.units import NUMBER, TEMPERATURE

_ABSOLUTE = Quantity(TEMPERATURE, 1.0, 1e5)
_LEAST = 1e-9  # of a law, in SI units, where one value may be zero
EXPONENT = Quantity(NUMBER, 0.0, 20.0, signed=True)  # larger ones are slips


def _columns(
    path: str, given: Mapping[Any, object], names: tuple[str, str], kinds: tuple[Quantity, Quantity], example: str,
    rising: bool,
) -> tuple[tuple[float, ...], tuple[float, ...]]:  # fmt: skip
    """The two lists of a table of equal length, the first of which does not decrease, or rises."""
    only(path, given, names)
    columns = []
    for name, kind in zip(names, kinds, strict=True):
        items = given.get(name)
        if not isinstance(items, (list, tuple)) or len(items) < 1 + rising:
            shown = f"{path}.{name} = {quoted(items)} is not" if name in given else f"{path}.{name} is missing, not"
            raise SceneError(f"{shown} a list{' of two or more' * rising}: give {example}")
        if len(items) > 2000:  # a time step ends at each; 1,000 take half a minute
            raise SceneError(f"{path}.{name} has {len(items)} points: give at most 2000")
        columns.append(tuple(kind.read(f"{path}.{name}[{i}]", each) or 0.0 for i, each in enumerate(items, 1)))
    places, values = columns
    if len(places) != len(values):
        raise SceneError(f"{path} has {len(places)} {names[0]} and {len(values)} values: give as many of each")
    for i, (before, after) in enumerate(pairwise(places), 2):
        if after < before or (rising and after == before):
            fault = "is not above" if rising else "is before"
            then = "that rise" if rising else "that do not decrease (two equal ones make a jump)"
            value = quoted(given[names[0]][i - 1])  # type: ignore[index]
            raise SceneError(f"{path}.{names[0]}[{i}] = {value} {fault} the one in front: give {names[0]} {then}")
    return places, values


@dataclass(frozen=True)
class Varying(Kind):
    """A quantity, or {times = [...], values = [...]}: linear between, equal times for a jump."""

    quantity: Quantity

    @property
    def form(self) -> str:
        return f"{self.quantity.form}, or {{times = [...], values = [...]}}"

    def read(self, path: str, given: object) -> Value:
        if not isinstance(given, Mapping):
            return self.quantity.read(path, given) or 0.0
        example = "{times = [0, 1e-3], values = [0, 1]}, or one value"
        times, values = _columns(path, given, ("times", "values"), (INSTANT, self.quantity), example, False)
        # Two times that are equal but for rounding make a jump.
        joined = list(times[:1])
        for time in times[1:]:
            joined.append(joined[-1] if time - joined[-1] <= ROUNDING * time else time)
        return Schedule(tuple(joined), values)


@dataclass(frozen=True)
class Following(Kind):
    """A quantity, or a law of the temperature: {value, at, exponent}, or {temperatures = [...], values = [...]}; where
    ``axes``, also three of these along x, y and z; ``proportional`` laws have one exponent."""

    quantity: Quantity
    axes: bool = False
    proportional: bool = False

    @property
    def form(self) -> str:
        axes = ", or three along [x, y, z]" if self.axes else ""
        return f"{self.quantity.form}, {{value, at, exponent}} or {{temperatures = [...], values = [...]}}{axes}"

    def read(self, path: str, given: object) -> Property:
        # An insulator has no law and no axes, and a law is nowhere zero.
        positive = replace(self.quantity, word=None, lower=self.quantity.lower or _LEAST)
        if isinstance(given, Mapping):
            example = f'{{value = "{self.quantity.dimension.example}", at = "293 K", exponent = -1.3}}'
            if {"temperatures", "values"} & set(given):
                names, kinds = ("temperatures", "values"), (_ABSOLUTE, positive)
                return Table(*_columns(path, given, names, kinds, "temperatures and as many values", True))
            only(path, given, ("value", "at", "exponent", "temperatures", "values"))
            for name in ("value", "at", "exponent"):
                if name not in given:
                    raise SceneError(f"{path}.{name} is missing: give {example}, a table, or one value")
            exponent = EXPONENT.read(f"{path}.exponent", given["exponent"])
            value, at = positive.read(f"{path}.value", given["value"]), _ABSOLUTE.read(f"{path}.at", given["at"])
            return PowerLaw(value or 0.0, at or 0.0, exponent or 0.0)
        if not isinstance(given, (list, tuple)):
            return self.quantity.read(path, given)
        if not self.axes:
            raise SceneError(f"{path} = {quoted(given)} is a list, and has no directions: give one value, or a law")
        if len(given) != 3:
            raise SceneError(f"{path} = {quoted(given)} is not [x, y, z]: give one value, or three along the axes")
        return tuple(Following(positive).read(f"{path}[{'xyz'[d]}]", each) for d, each in enumerate(given))

    def show(self, value: Any) -> str:
        if isinstance(value, tuple):
            return f"[{', '.join(map(self.show, value))}]"
        if isinstance(value, PowerLaw):
            return f"{self.quantity.show(value.value)} (T/{value.at:g} K)^{value.exponent:g}"
        if isinstance(value, Table):
            points = zip(value.temperatures, value.values, strict=True)
            return ", ".join(f"{self.quantity.show(v)} at {t:g} K" for t, v in points)
        return self.quantity.show(value)


@dataclass(frozen=True)
class Surroundings(Kind):
    """A table with a face's ``coefficient``, under a ``name``, and the ambient temperature, each of its kind."""

    name: str
    coefficient: Quantity | Following
    ambient: Varying | Quantity
    example: str

    @property
    def quantity(self) -> Quantity:
        """The quantity of the coefficient."""
        return self.coefficient.quantity if isinstance(self.coefficient, Following) else self.coefficient

    @property
    def form(self) -> str:
        return f'{{{self.name} = {self.example}, ambient = "293 K"}}'

    def read(self, path: str, given: object) -> tuple[Any, Value]:
        if not isinstance(given, Mapping):
            raise self.refusal(path, given, "is not a table")
        only(path, given, (self.name, "ambient"))
        values = list[Any]()
        for name, kind, example in (self.name, self.coefficient, self.example), ("ambient", self.ambient, '"293 K"'):
            if name not in given:
                raise SceneError(f"{path}.{name} is missing: give {self.form}")
            if not isinstance(kind, Varying) and isinstance(given[name], Mapping) and "times" in given[name]:
                raise SceneError(f"{path}.{name} may not vary in time: give one, such as {example}")
            values.append(kind.read(f"{path}.{name}", given[name]))
        return values[0], values[1]

    def write(self, value: Any) -> Any:
        return {self.name: self.coefficient.write(value[0]), "ambient": self.ambient.write(value[1])}
