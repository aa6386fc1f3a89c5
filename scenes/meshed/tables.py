"""The tables of a scene file on a mesh: those of a free scene, with groups in place of boxes and corners."""

from __future__ import annotations

from dataclasses import dataclass

from scenes import dimensions as d
from scenes.errors import SceneError, quoted
from scenes.free import tables as free
from scenes.free.document import Tables
from scenes.free.kinds import Label, Varying
from scenes.kinds import Kind, Quantity
from scenes.units import UnitError, parse_quantity

LENGTHS = (1e-12, 1e6)


@dataclass(frozen=True)
class FileName:
    """The path of a mesh file, relative to the scene's."""

    def read(self, path: str, given: object) -> str:
        """The text itself."""
        if isinstance(given, str) and given.strip() and "\0" not in given:
            return given
        raise SceneError(f'{path} = {quoted(given)} is no path of a mesh: give one such as "chip.msh"')

    def write(self, value: object) -> object:
        """The text itself."""
        return value

    def show(self, value: object) -> str:
        """The text itself."""
        return str(value)


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
        fine = unit is None or unit.powers == d.LENGTH.powers
        if isinstance(given, bool) or not fine or not LENGTHS[0] <= value <= LENGTHS[1]:
            raise SceneError(f'{path} = {quoted(given)} is not a unit of length: give "um", "mm" or 1e-6')
        return value

    def write(self, value: object) -> object:
        """The unit in m."""
        return value

    def show(self, value: object) -> str:
        """As a length."""
        return d.LENGTH.show(float(str(value)))


@dataclass(frozen=True)
class Labels:
    """A list of names of groups."""

    def read(self, path: str, given: object) -> tuple[str, ...]:
        """The names."""
        if isinstance(given, (list, tuple)) and given:
            return tuple(GROUP.read(f"{path}[{i}]", name) for i, name in enumerate(given, 1))
        raise SceneError(f'{path} = {quoted(given)} is not a list of groups: give some, such as ["silicon"]')

    def write(self, value: tuple[str, ...]) -> list[str]:
        """A list of names."""
        return list(value)

    def show(self, value: tuple[str, ...]) -> str:
        """With commas between."""
        return ", ".join(value)


@dataclass(frozen=True)
class GroupName:
    """The name of a group, or the number of one that has no name."""

    def read(self, path: str, given: object) -> str:
        """The name as text."""
        if isinstance(given, int) and not isinstance(given, bool):
            return str(given)
        if isinstance(given, str) and given.strip():
            return given
        raise SceneError(f"{path} = {quoted(given)} is not a group: give its name, or its number where it has none")

    def write(self, value: str) -> str:
        """The text itself."""
        return value

    def show(self, value: str) -> str:
        """The text itself."""
        return value


GROUP = GroupName()
_MATERIAL: dict[str, Kind] = {**free.LISTS["material"], "groups": Labels()}
_BOUNDARY: dict[str, Kind] = {"name": Label(), "group": GROUP, **free.CONDITIONS}
_PROBE: dict[str, Kind] = {
    **{key: kind for key, kind in free.LISTS["probe"].items() if key not in ("lower", "upper")},
    "group": GROUP,
}
_SOURCE: dict[str, Kind] = {
    "name": Label(),
    "group": GROUP,
    "heat_source": Varying(Quantity(d.HEAT_SOURCE, 0.0, 1e20, signed=True)),
}

TABLES = Tables(
    "a scene on a mesh",
    {"scene": free.SECTIONS["scene"], "mesh": {"file": FileName(), "unit": LengthUnit()}, "run": free.SECTIONS["run"]},
    {"material": _MATERIAL, "source": _SOURCE, "boundary": _BOUNDARY, "probe": _PROBE},
    {"material": ("name",), "source": ("group", "heat_source"), "boundary": ("group",), "probe": ("name",)},
)
"""What a file with a [mesh] may say."""
