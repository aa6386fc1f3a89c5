"""Laws of a property that follows the temperature: a power of it, or a table over it.

A *property* is a number, a law, or three of these along x, y and z (anisotropic). Temperatures are absolute (K).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import isclose
from typing import Any

Property = Any
"""A number, a `PowerLaw`, a `Table` or a tuple of three of these: ``Any``, as most models take numbers alone, and
`scenes.physics.refuse_laws` keeps the others from them."""


@dataclass(frozen=True)
class PowerLaw:
    """``value`` (T / ``at``)^``exponent``."""

    value: float
    at: float
    exponent: float

    def __call__(self, temperature: Any) -> Any:
        """The property at a temperature (K), a number or an array."""
        return self.value * (temperature / self.at) ** self.exponent

    def slope(self, temperature: Any) -> Any:
        """Its derivative (per K)."""
        return self.value * self.exponent / self.at * (temperature / self.at) ** (self.exponent - 1)

    def integral(self, temperature: Any) -> Any:
        """Its integral over the temperature, from ``at`` on."""
        import numpy as np

        logarithm, n = np.log(temperature / self.at), self.exponent + 1
        # The power n of the ratio, less one, over n: its logarithm where n is none.
        return self.value * self.at * (np.expm1(n * logarithm) / n if n else logarithm)


@dataclass(frozen=True)
class Table:
    """Linear between ``values`` at rising ``temperatures`` (K), constant outside of them."""

    temperatures: tuple[float, ...]
    values: tuple[float, ...]

    @cached_property
    def _slopes(self) -> Any:
        """The slope between each two rows (per K), and zero outside of the table, in front and behind."""
        import numpy as np

        return np.pad(np.diff(self.values) / np.diff(self.temperatures), 1)

    def __call__(self, temperature: Any) -> Any:
        """The property at a temperature (K), a number or an array."""
        import numpy as np

        return np.interp(temperature, self.temperatures, self.values)

    def slope(self, temperature: Any) -> Any:
        """Its derivative (per K): at a row that of the interval above."""
        import numpy as np

        return self._slopes[np.searchsorted(self.temperatures, temperature, side="right")]

    def integral(self, temperature: Any) -> Any:
        """Its integral over the temperature, from the first of the table on."""
        import numpy as np

        rows, values = np.array(self.temperatures), np.array(self.values)
        sums = np.append(0.0, np.cumsum(np.diff(rows) * (values[1:] + values[:-1]) / 2))
        at = np.clip(np.searchsorted(rows, temperature, side="right") - 1, 0, None)
        return sums[at] + (temperature - rows[at]) * (values[at] + self(temperature)) / 2


@dataclass(frozen=True)
class Inverse:
    """One over a ``table``: a resistivity whose inverse, the electrical conductivity, is given."""

    table: Table

    def __call__(self, temperature: Any) -> Any:
        """The resistivity at a temperature (K), a number or an array."""
        return 1 / self.table(temperature)

    def slope(self, temperature: Any) -> Any:
        """Its derivative (per K)."""
        return -self.table.slope(temperature) / self.table(temperature) ** 2


Law = PowerLaw | Table | Inverse


def inverse(given: Property) -> Property:
    """Return one over a property: of an electrical conductivity the resistivity."""
    if isinstance(given, tuple):
        return tuple(map(inverse, given))
    if isinstance(given, PowerLaw):
        return PowerLaw(1 / given.value, given.at, -given.exponent)
    return Inverse(given) if isinstance(given, Table) else 1 / given


@dataclass(frozen=True)
class Line:
    """``value`` (1 + ``coefficient`` (T - ``at``)): a resistivity with a temperature coefficient, beside laws."""

    value: float
    coefficient: float
    at: float

    def __call__(self, temperature: Any) -> Any:
        """The property at a temperature (K), a number or an array."""
        return self.value * (1 + self.coefficient * (temperature - self.at))

    def slope(self, temperature: Any) -> Any:
        """Its derivative (per K)."""
        return self.value * self.coefficient + 0.0 * temperature


def along(given: Property) -> tuple[Property, Property, Property]:
    """The property along x, y and z."""
    return given if isinstance(given, tuple) else (given, given, given)


def ratio(law: Property, other: Property) -> float | None:
    """How many times as large as a law, or a number, another one is at every temperature; None where that varies."""
    if isinstance(law, PowerLaw) and isinstance(other, PowerLaw):
        return float(other(law.at) / law.value) if law.exponent == other.exponent else None
    if isinstance(law, Inverse) and isinstance(other, Inverse):
        return ratio(other.table, law.table)
    if isinstance(law, Table) and isinstance(other, Table):
        quotients = [b / a for a, b in zip(law.values, other.values, strict=False)]
        alike = law.temperatures == other.temperatures and isclose(max(quotients), min(quotients))
        return quotients[0] if alike else None
    return other / law if not isinstance(law, Law) and not isinstance(other, Law) else None


def of(given: Property) -> Iterator[Law]:
    """The laws in a property."""
    return (each for each in along(given) if isinstance(each, Law))


def at(given: Property, temperature: float) -> Property:
    """The property at a temperature (K): a number, or three."""
    if isinstance(given, tuple):
        return tuple(at(each, temperature) for each in given)
    return float(given(temperature)) if isinstance(given, Law) else given


def varies(given: Property) -> bool:
    """Whether a property follows the temperature."""
    return any(True for _ in of(given))
