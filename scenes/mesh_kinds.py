"""Values of the keys of a scene on a mesh file: the file, the unit of its coordinates, and groups of its cells."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.errors import SceneError, quoted
from scenes.kinds import Kind, Text
from scenes.units import LENGTH, UnitError, parse_quantity

_LENGTHS = (1e-12, 1e6)


@dataclass(frozen=True)
class GroupName(Kind):
    """The name of a group of a mesh, or the number of one that has no name."""

    def read(self, path: str, given: object) -> str:
        if isinstance(given, int) and not isinstance(given, bool):
            return str(given)
        if isinstance(given, str) and given.strip():
            return given
        raise SceneError(f"{path} = {quoted(given)} is not a group: give its name, or its number where it has none")


@dataclass(frozen=True)
class LengthUnit(Kind):
    """The unit of a file's coordinates: "um", or the length in m."""

    def read(self, path: str, given: object) -> float:
        text = f"1 {given}" if isinstance(given, str) and not given[:1].isdigit() else given
        try:
            value, unit = parse_quantity(text) if isinstance(text, str) else (float(text), None)  # type: ignore[arg-type]
        except (UnitError, TypeError, ValueError):
            value, unit = 0.0, None
        fine = unit is None or unit.powers == LENGTH.powers
        if isinstance(given, bool) or not fine or not _LENGTHS[0] <= value <= _LENGTHS[1]:
            raise SceneError(f'{path} = {quoted(given)} is not a unit of length: give "um", "mm" or 1e-6')
        return value


GROUP = GroupName()
MESH_FILE = Text(r"[^\0]*[^\0\s][^\0]*", 'is no path of a mesh: give one such as "chip.msh"', longest=4096)
