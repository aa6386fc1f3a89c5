"""Kinds of value of conditions: what varies in time, a face's surroundings, a contact's resistance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

from scenes.errors import SceneError, quoted
from scenes.kinds import INSTANT, Kind, Quantity, only
from scenes.model import Schedule, Value
from scenes.parameters import quantity
from scenes.units import PLAIN, Dimension, UnitError

MOST_POINTS = 2_000
"""Points of a schedule: a time step ends at each. One of 1,000 takes half a minute, most of it for its error."""


class Resistance(NamedTuple):
    """That of a contact, times its area, and the dimension of the unit that it was given in, if any."""

    value: float
    dimension: Dimension | None


@dataclass(frozen=True)
class Varying(Kind):
    """A quantity, or {times = [...], values = [...]}: linear between, equal times for a jump."""

    quantity: Quantity

    def read(self, path: str, given: object) -> Value:
        if not isinstance(given, Mapping):
            return self.quantity.read(path, given) or 0.0
        only(path, given, ("times", "values"))
        lists = []
        for name in ("times", "values"):
            items = given.get(name)
            if not isinstance(items, (list, tuple)) or not items:
                shown = f"{path}.{name} = {quoted(items)} is not" if name in given else f"{path}.{name} is missing, not"
                raise SceneError(f"{shown} a list: give {{times = [0, 1e-3], values = [0, 1]}}, or one value")
            if len(items) > MOST_POINTS:
                raise SceneError(
                    f"{path}.{name} has {len(items)} points: give at most {MOST_POINTS}, between which the value is "
                    "linear; of measured ones every so many are enough"
                )
            lists.append(items)
        times = tuple(INSTANT.read(f"{path}.times[{i}]", t) or 0.0 for i, t in enumerate(lists[0], 1))
        values = tuple(self.quantity.read(f"{path}.values[{i}]", v) or 0.0 for i, v in enumerate(lists[1], 1))
        if len(times) != len(values):
            raise SceneError(f"{path} has {len(times)} times and {len(values)} values: give as many of each")
        for i, (before, after) in enumerate(pairwise(times), 2):
            if after < before:
                raise SceneError(
                    f"{path}.times[{i}] = {quoted(lists[0][i - 1])} is before the time in front of it: give times that "
                    "do not decrease (two equal ones make a jump)"
                )
        return Schedule(times, values)

    def write(self, value: Any) -> Any:
        if isinstance(value, Schedule):
            return {"times": list(value.times), "values": list(value.values)}
        return self.quantity.write(value)


@dataclass(frozen=True)
class Surroundings(Kind):
    """A table with a face's coefficient, under a ``name``, and the ambient temperature, which may vary in time where
    its kind allows. ``quantity`` is the coefficient's; ``law`` its kind where it may follow the face's temperature."""

    name: str
    quantity: Quantity
    ambient: Varying | Quantity
    example: str
    law: Kind | None = None

    def read(self, path: str, given: object) -> tuple[Any, Value]:
        example = f'{{{self.name} = {self.example}, ambient = "293 K"}}'
        if not isinstance(given, Mapping):
            raise SceneError(f"{path} = {quoted(given)} is not a table: give {example}")
        only(path, given, self.names)
        for name in self.names:
            if name not in given:
                raise SceneError(f"{path}.{name} is missing: give {example}")
        coefficient = given[self.name]
        if isinstance(coefficient, Mapping) and (self.law is None or "times" in coefficient):
            raise SceneError(f"{path}.{self.name} may not vary in time: give one {self.called}, such as {self.example}")
        if isinstance(given["ambient"], Mapping) and isinstance(self.ambient, Quantity):
            raise SceneError(f'{path}.ambient may not vary in time: give one temperature, such as "293 K"')
        kind = self.law if self.law is not None and isinstance(coefficient, Mapping) else self.quantity
        value: Any = kind.read(f"{path}.{self.name}", coefficient)
        ambient: Any = self.ambient.read(f"{path}.ambient", given["ambient"])
        return value, ambient

    @property
    def names(self) -> tuple[str, str]:
        return self.name, "ambient"

    @property
    def called(self) -> str:
        return self.name if self.quantity.dimension.powers == PLAIN else self.quantity.dimension.name[2:]

    @property
    def outside(self) -> Quantity:
        """What the ambient temperature is, whether it varies or not."""
        return self.ambient if isinstance(self.ambient, Quantity) else self.ambient.quantity

    def write(self, value: Any) -> Any:
        return {self.name: self._kind(value[0]).write(value[0]), "ambient": self.ambient.write(value[1])}

    def shown(self, value: Any) -> str:
        """What is under the name, as text."""
        return self._kind(value).show(value)

    def _kind(self, value: Any) -> Kind:
        return self.quantity if self.law is None or isinstance(value, (int, float)) else self.law


@dataclass(frozen=True)
class ContactResistance(Kind):
    """The resistance of a contact times its area: of heat, of current, or of either where more than one of the
    ``quantities`` is possible. Their lower bound is that of one that is not zero, which is a perfect contact."""

    quantities: tuple[Quantity, ...]

    def read(self, path: str, given: object) -> Resistance:
        """The value, and the dimension of the unit that it has, ``None`` without one."""
        try:
            value, powers = quantity(given) if isinstance(given, str) else (given, None)
        except UnitError:
            value, powers = None, None
        matching = next((q for q in self.quantities if q.dimension.powers == powers), None)
        perfect = value == 0 and not isinstance(value, bool) and (matching is not None or powers is None)
        resistance = 0.0 if perfect else (matching or self.quantities[0]).read(path, given) or 0.0
        return Resistance(resistance, matching.dimension if matching else None)

    def write(self, value: Any) -> Any:
        return self.quantities[0].write(value)

    def show(self, value: Any) -> str:
        return self.quantities[0].show(value)
