"""Laws of a property that follows the temperature: a power of it, or a table over it.

A *property* is a number, a law, or three of these along x, y and z (anisotropic). Temperatures are absolute (K).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
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
    """A monotone cubic through ``values`` at rising ``temperatures`` (K), constant outside of them.

    Between two rows the cubic has no larger and no smaller value than these rows, and its slope is continuous from row
    to row (Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 1984; SciPy's PCHIP). A table of two rows is a line.
    """

    temperatures: tuple[float, ...]
    values: tuple[float, ...]

    @cached_property
    def _cubics(self) -> tuple[Any, Any, Any]:
        """The interpolant, its derivative and its integral from the first temperature on."""
        from scipy.interpolate import PchipInterpolator

        cubic = PchipInterpolator(self.temperatures, self.values)
        return cubic, cubic.derivative(), cubic.antiderivative()

    def __call__(self, temperature: Any) -> Any:
        """The property at a temperature (K), a number or an array."""
        return self._cubics[0](self._inside(temperature))

    def slope(self, temperature: Any) -> Any:
        """Its derivative (per K): zero outside of the table."""
        inside = self._inside(temperature)
        return self._cubics[1](inside) * (inside == temperature)

    def integral(self, temperature: Any) -> Any:
        """Its integral over the temperature, from the first of the table on."""
        inside = self._inside(temperature)
        return self._cubics[2](inside) + (temperature - inside) * self._cubics[0](inside)

    def _inside(self, temperature: Any) -> Any:
        """The nearest temperature of the table."""
        import numpy as np

        return np.clip(temperature, self.temperatures[0], self.temperatures[-1])


class Inverse(Table):
    """One over a table: a resistivity whose inverse, the electrical conductivity, is given."""

    def __call__(self, temperature: Any) -> Any:
        """The resistivity at a temperature (K), a number or an array."""
        return 1 / super().__call__(temperature)

    def slope(self, temperature: Any) -> Any:
        """Its derivative (per K)."""
        return -super().slope(temperature) / super().__call__(temperature) ** 2

    def integral(self, temperature: Any) -> Any:
        """No model needs the integral of a resistivity."""
        raise NotImplementedError


Law = PowerLaw | Table


def inverse(given: Property) -> Property:
    """Return one over a property: of an electrical conductivity the resistivity."""
    if isinstance(given, tuple):
        return tuple(map(inverse, given))
    if isinstance(given, PowerLaw):
        return PowerLaw(1 / given.value, given.at, -given.exponent)
    return Inverse(given.temperatures, given.values) if isinstance(given, Table) else 1 / given


SMALL = 1e-4
"""Part of the way from one table to another over which a difference stands for the derivative."""
SAME = 1e-9
"""Relative: values of two tables whose quotients differ by less are proportional."""


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
    if isinstance(law, Table) and type(law) is type(other):
        pairs = zip(law.values, other.values, strict=False)
        quotients = [a / b if isinstance(law, Inverse) else b / a for a, b in pairs]
        alike = law.temperatures == other.temperatures and max(quotients) <= (1 + SAME) * min(quotients)
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


def is_plain(given: Property) -> bool:
    """Whether a property is one number, or nothing."""
    return not isinstance(given, (Law, tuple))


def numbers(given: Property) -> Iterator[tuple[str, float, Callable[[float], Property]]]:
    """The numbers that a property is varied by: what each is called behind its key, its value, and what makes the
    property with it some times as large. A law is one as a whole (a power by its value, a table by its largest), its
    exponent another; of three along the axes each has its own."""
    if isinstance(given, tuple):
        for d, each in enumerate(given):
            for name, value, times in numbers(each):
                yield f"[{'xyz'[d]}]{name}", value, _along(given, d, times)
    elif isinstance(given, PowerLaw):
        yield "", given.value, lambda factor: replace(given, value=factor * given.value)
        yield ".exponent", given.exponent, lambda factor: replace(given, exponent=factor * given.exponent)
    elif isinstance(given, Table):
        yield "", max(given.values), lambda factor: replace(given, values=tuple(factor * v for v in given.values))
    else:
        yield "", given, lambda factor: factor * given


def in_proportion(given: Property) -> Iterator[tuple[str, float, Callable[[float], Property]]]:
    """`numbers`, but of power laws along x, y and z that are proportional: these have one exponent."""
    if not isinstance(given, tuple):
        yield from numbers(given)
        return
    yield from (number for number in numbers(given) if not number[0].endswith(".exponent"))
    powers = [each for each in given if isinstance(each, PowerLaw)]
    if powers:
        exponent = powers[0].exponent
        yield ".exponent", exponent, lambda factor: tuple(replace(each, exponent=factor * exponent) for each in powers)


def _along(
    given: tuple[Property, ...], axis: int, times: Callable[[float], Property]
) -> Callable[[float], tuple[Property, ...]]:
    return lambda factor: (*given[:axis], times(factor), *given[axis + 1 :])


def towards(law: Any, other: Any, temperature: Any) -> Any:
    """First-order change of a property at a temperature (K) from a law, or number, to another of its kind."""
    import numpy as np

    if isinstance(law, PowerLaw):
        logarithm = np.log(temperature / law.at)
        share = (other.value - law.value) / law.value + (other.exponent - law.exponent) * logarithm
        return law(temperature) * (share - law.exponent * (other.at - law.at) / law.at)
    if isinstance(law, Inverse):
        given, target = (Table(each.temperatures, each.values) for each in (law, other))
        return -towards(given, target, temperature) * law(temperature) ** 2
    if isinstance(law, Table):
        # The cubic is no linear function of its rows: a central difference, small beside the step between the tables.
        by = [np.subtract(getattr(other, n), getattr(law, n)) for n in ("temperatures", "values")]
        ahead, behind = (
            Table(tuple(law.temperatures + step * by[0]), tuple(law.values + step * by[1])) for step in (SMALL, -SMALL)
        )
        return (ahead(temperature) - behind(temperature)) / (2 * SMALL)
    if isinstance(law, Line):
        of_line = (other.coefficient - law.coefficient) * (temperature - law.at)
        of_line = of_line - law.coefficient * (other.at - law.at)
        return (other.value - law.value) * (law(temperature) / law.value) + law.value * of_line
    return np.full_like(temperature, other - law)
