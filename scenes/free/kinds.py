"""The kinds of value that only a free scene has: points, lists of times, values that vary in time, convection, groups
of a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from scenes.dimensions import LENGTH, TEMPERATURE, TIME
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.kinds import Quantity, Text
from scenes.model import Schedule, Value
from scenes.units import UnitError, parse_quantity

INSTANT = Quantity(TIME, 0.0, 1e9)
_LENGTHS = (1e-12, 1e6)


@dataclass(frozen=True)
class Place:
    """A point [x, y, z]."""

    coordinate: Quantity

    def read(self, path: str, given: object) -> tuple[float, float, float]:
        """The coordinates in m."""
        if not isinstance(given, (list, tuple)) or len(given) != 3:
            raise SceneError(
                f'{path} = {quoted(given)} is not a point: give [x, y, z], such as [0, "-50 um", 2e-6]'
            )  # fmt: skip
        x, y, z = (self.coordinate.read(f"{path}[{'xyz'[d]}]", c) or 0.0 for d, c in enumerate(given))
        return x, y, z


@dataclass(frozen=True)
class Instants:
    """A list of times; the value has each once, ascending."""

    def read(self, path: str, given: object) -> tuple[float, ...]:
        """The times in s."""
        if not isinstance(given, (list, tuple)) or not given:
            raise SceneError(f'{path} = {quoted(given)} is not a list of times: give some, such as [0.1, "200 ms"]')
        return tuple(sorted({INSTANT.read(f"{path}[{i}]", t) or 0.0 for i, t in enumerate(given, 1)}))


@dataclass(frozen=True)
class Varying:
    """A quantity, or {times = [...], values = [...]}: linear between, equal times for a jump."""

    quantity: Quantity

    def read(self, path: str, given: object) -> Value:
        """A number in SI units, or a Schedule of such."""
        if not isinstance(given, Mapping):
            return self.quantity.read(path, given) or 0.0
        _only(path, given, ("times", "values"))
        lists = []
        for name in ("times", "values"):
            found = given.get(name)
            if not isinstance(found, (list, tuple)) or not found:
                shown = f"{path}.{name} = {quoted(found)} is not" if name in given else f"{path}.{name} is missing, not"
                raise SceneError(f"{shown} a list: give {{times = [0, 1e-3], values = [0, 1]}}, or one value")
            lists.append(found)
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
        """A number, or a table of two lists."""
        if isinstance(value, Schedule):
            return {"times": list(value.times), "values": list(value.values)}
        return self.quantity.write(value)


@dataclass(frozen=True)
class Convection:
    """{coefficient, ambient}: the ambient temperature may vary in time, the coefficient may not."""

    coefficient: Quantity
    ambient: Varying

    def read(self, path: str, given: object) -> tuple[float, Value]:
        """The coefficient in W/(m2 K) and the ambient temperature in K."""
        example = '{coefficient = "10 W/(m2 K)", ambient = "293 K"}'
        if not isinstance(given, Mapping):
            raise SceneError(f"{path} = {quoted(given)} is not a table: give {example}")
        _only(path, given, ("coefficient", "ambient"))
        for name in ("coefficient", "ambient"):
            if name not in given:
                raise SceneError(f"{path}.{name} is missing: give {example}")
        if isinstance(given["coefficient"], Mapping):
            raise SceneError(
                f"{path}.coefficient may not vary in time: give one {self.coefficient.dimension.name[2:]}, such as "
                f'"{self.coefficient.dimension.example}"'
            )
        coefficient = self.coefficient.read(f"{path}.coefficient", given["coefficient"]) or 0.0
        return coefficient, self.ambient.read(f"{path}.ambient", given["ambient"])

    def write(self, value: Any) -> Any:
        """A table."""
        return {"coefficient": self.coefficient.write(value[0]), "ambient": self.ambient.write(value[1])}


@dataclass(frozen=True)
class GroupName:
    """The name of a group of a mesh, or the number of one that has no name."""

    def read(self, path: str, given: object) -> str:
        """The name as text."""
        if isinstance(given, int) and not isinstance(given, bool):
            return str(given)
        if isinstance(given, str) and given.strip():
            return given
        raise SceneError(f"{path} = {quoted(given)} is not a group: give its name, or its number where it has none")


@dataclass(frozen=True)
class GroupNames:
    """A list of names of groups."""

    def read(self, path: str, given: object) -> tuple[str, ...]:
        """The names."""
        if isinstance(given, (list, tuple)) and given:
            return tuple(GROUP.read(f"{path}[{i}]", name) for i, name in enumerate(given, 1))
        raise SceneError(f'{path} = {quoted(given)} is not a list of groups: give some, such as ["silicon"]')


@dataclass(frozen=True)
class LengthUnit:
    """The unit of a file's coordinates: "um", or the length in m."""

    def read(self, path: str, given: object) -> float:
        """The unit in m."""
        text = f"1 {given}" if isinstance(given, str) and not given[:1].isdigit() else given
        try:
            value, unit = parse_quantity(text) if isinstance(text, str) else (float(text), None)  # type: ignore[arg-type]
        except (UnitError, TypeError, ValueError):
            value, unit = 0.0, None
        fine = unit is None or unit.powers == LENGTH.powers
        if isinstance(given, bool) or not fine or not _LENGTHS[0] <= value <= _LENGTHS[1]:
            raise SceneError(f'{path} = {quoted(given)} is not a unit of length: give "um", "mm" or 1e-6')
        return value


LABEL = Text(
    r"\w([\w .+-]*\w)?",
    "is not a name: give text of 1 to 60 letters, digits, spaces, dots, +, - and _, with a letter or digit at either "
    "end",
)
"""The name of a part, by which messages, overrides and columns call it."""
MESH_FILE = Text(r"[^\0]*[^\0\s][^\0]*", 'is no path of a mesh: give one such as "chip.msh"', longest=4096)
GROUP = GroupName()
KELVIN = Quantity(TEMPERATURE, 0.0, 1e6)


def _only(path: str, given: Mapping[Any, object], known: tuple[str, ...]) -> None:
    for name, value in given.items():
        if name not in known:
            raise SceneError(
                f"unknown key {path}.{name} = {quoted(value)}: give {' and '.join(known)}{did_you_mean(name, known)}"
            )
