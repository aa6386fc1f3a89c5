"""The kind of a key that may follow the temperature: a quantity, a law of it, or three of these along the axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from scenes.condition_kinds import MOST_POINTS
from scenes.errors import SceneError, quoted
from scenes.kinds import Kind, Quantity, only
from scenes.laws import PowerLaw, Property, Table
from scenes.units import NUMBER, TEMPERATURE

STEEPEST = 20.0
"""The largest exponent of a power law; larger ones are slips."""
_ABSOLUTE = Quantity(TEMPERATURE, 1.0, 1e5)


@dataclass(frozen=True)
class Following(Kind):
    """A quantity, or a law of the temperature: {value, at, exponent}, or {temperatures = [...], values = [...]}; where
    ``axes``, also three of these along x, y and z."""

    quantity: Quantity
    axes: bool = False

    def read(self, path: str, given: object) -> Property:
        if isinstance(given, Mapping):
            return self._table(path, given) if {"temperatures", "values"} & set(given) else self._power(path, given)
        if not isinstance(given, (list, tuple)):
            return self.quantity.read(path, given)
        if not self.axes:
            raise SceneError(f"{path} = {quoted(given)} is a list, and has no directions: give one value, or a law")
        if len(given) != 3:
            raise SceneError(f"{path} = {quoted(given)} is not [x, y, z]: give one value, or three along the axes")
        # An insulator is one along all axes.
        of_axis = Following(replace(self.quantity, word=None))
        return tuple(of_axis.read(f"{path}[{'xyz'[d]}]", each) for d, each in enumerate(given))

    def _power(self, path: str, given: Mapping[Any, object]) -> PowerLaw:
        only(path, given, ("value", "at", "exponent", "temperatures", "values"))
        for name in ("value", "at", "exponent"):
            if name not in given:
                example = f'{{value = "{self.quantity.dimension.example}", at = "293 K", exponent = -1.3}}'
                raise SceneError(f"{path}.{name} is missing: give {example}, a table over the temperature or one value")
        exponent = Quantity(NUMBER, 0.0, STEEPEST, signed=True).read(f"{path}.exponent", given["exponent"])
        at = _ABSOLUTE.read(f"{path}.at", given["at"])
        return PowerLaw(self._positive(f"{path}.value", given["value"]), at or 0.0, exponent or 0.0)

    def _table(self, path: str, given: Mapping[Any, object]) -> Table:
        only(path, given, ("temperatures", "values"))
        lists = []
        for name in ("temperatures", "values"):
            each = given.get(name)
            if not isinstance(each, (list, tuple)) or len(each) < 2:
                shown = f"{path}.{name} = {quoted(each)} is" if name in given else f"{path}.{name} is missing,"
                raise SceneError(f"{shown} not a list of two or more: give temperatures and as many values")
            if len(each) > MOST_POINTS:
                raise SceneError(f"{path}.{name} has {len(each)} points: give at most {MOST_POINTS}")
            lists.append(each)
        temperatures = tuple(_ABSOLUTE.read(f"{path}.temperatures[{i}]", t) or 0.0 for i, t in enumerate(lists[0], 1))
        values = tuple(self._positive(f"{path}.values[{i}]", v) for i, v in enumerate(lists[1], 1))
        if len(temperatures) != len(values):
            raise SceneError(
                f"{path} has {len(temperatures)} temperatures and {len(values)} values: give as many of each"
            )
        for i, (before, after) in enumerate(pairwise(temperatures), 2):
            if not after > before:
                raise SceneError(
                    f"{path}.temperatures[{i}] = {quoted(lists[0][i - 1])} is not above the one in front of it: give "
                    "temperatures that rise"
                )
        return Table(temperatures, values)

    def _positive(self, path: str, given: object) -> float:
        """A value of a law: an insulator has none."""
        return replace(self.quantity, word=None).read(path, given) or 0.0

    def write(self, value: Any) -> Any:
        if isinstance(value, tuple):
            return [self.write(each) for each in value]
        if isinstance(value, PowerLaw):
            return {"value": float(value.value), "at": float(value.at), "exponent": float(value.exponent)}
        if isinstance(value, Table):
            return {"temperatures": list(value.temperatures), "values": list(value.values)}
        return self.quantity.write(value)

    def show(self, value: Any) -> str:
        if isinstance(value, tuple):
            return f"[{', '.join(map(self.show, value))}]"
        if isinstance(value, PowerLaw):
            return f"{self.quantity.show(value.value)} (T/{value.at:g} K)^{value.exponent:g}"
        if isinstance(value, Table):
            points = zip(value.temperatures, value.values, strict=True)
            return ", ".join(f"{self.quantity.show(v)} at {t:g} K" for t, v in points)
        return self.quantity.show(value)


def number_of(kind: object) -> Quantity | None:
    """What a number has to be like that a key of a kind may have; ``None`` where it may have none."""
    number = kind.quantity if isinstance(kind, Following) else kind
    return number if isinstance(number, Quantity) else None
