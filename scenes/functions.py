"""Kinds of value that depend on something: on time, on the temperature, on a face's surroundings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from scenes.errors import SceneError, quoted
from scenes.kinds import INSTANT, Items, Kind, Quantity, only
from scenes.laws import PowerLaw, Property, Table
from scenes.model import ROUNDING, Schedule, Value
from scenes.units import NUMBER, TEMPERATURE

_ABSOLUTE = Quantity(TEMPERATURE, 1.0, 1e5)
_LEAST = 1e-9  # of a law, in SI units, where one value may be zero
EXPONENT = Quantity(NUMBER, 0.0, 20.0, signed=True)  # larger ones are slips
_ROWS = 2000  # a time step ends at each; 1,000 take half a minute
_TIMES = Items(INSTANT, "times", "[0, 1e-3]", most=_ROWS)
_TEMPERATURES = Items(_ABSOLUTE, "temperatures", "[300, 400]", most=_ROWS)


def _fields(path: str, given: Mapping[Any, object], kinds: Mapping[str, Kind], form: str) -> list[Any]:
    """The values of a table that has exactly these keys."""
    only(path, given, tuple(kinds))
    for name in kinds:
        if name not in given:
            raise SceneError(f"{path}.{name} is missing: give {form}")
    return [kind.read(f"{path}.{name}", given[name]) for name, kind in kinds.items()]


def _columns(path: str, given: Mapping[Any, object], places: Items, values: Quantity, form: str, rising: bool) -> Any:
    """The places and as many values of a table; the places do not decrease, or rise."""
    called = places.called
    columns = _fields(path, given, {called: places, "values": Items(values, "values", "[0, 1]", most=_ROWS)}, form)
    if len(columns[0]) != len(columns[1]):
        raise SceneError(f"{path} has {len(columns[0])} {called} and {len(columns[1])} values: give as many of each")
    for i, (before, after) in enumerate(pairwise(columns[0]), 2):
        if after < before or (rising and after == before):
            then = "that rise" if rising else "that do not decrease (two equal ones make a jump)"
            value = quoted(given[called][i - 1])  # type: ignore[index]
            raise SceneError(f"{path}.{called}[{i}] = {value} is not above the one in front: give {called} {then}")
    return columns


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
        form = "{times = [0, 1e-3], values = [0, 1]}, or one value"
        times, values = _columns(path, given, _TIMES, self.quantity, form, rising=False)
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
            if {"temperatures", "values"} & set(given):
                table = Table(*_columns(path, given, _TEMPERATURES, positive, self.form, rising=True))
                if len(table.values) == 1:
                    raise SceneError(f"{path} has one row: give two or more, or one value")
                return table
            return PowerLaw(
                *_fields(path, given, {"value": positive, "at": _ABSOLUTE, "exponent": EXPONENT}, self.form)
            )
        if not self.axes or not isinstance(given, (list, tuple)):
            return self.quantity.read(path, given)
        return Items(Following(positive), "values along x, y and z", "[130, 130, 60]", 3).read(path, given)

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
        coefficient, ambient = _fields(path, given, {self.name: self.coefficient, "ambient": self.ambient}, self.form)
        return coefficient, ambient

    def write(self, value: Any) -> Any:
        return {self.name: self.coefficient.write(value[0]), "ambient": self.ambient.write(value[1])}
