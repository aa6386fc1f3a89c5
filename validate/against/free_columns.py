"""Which column is which probe of a scene of boxes, or on a mesh: by the probe's name."""

from __future__ import annotations

import re

from compare import quantities
from scenes.kinds import Quantity
from scenes.model import AnyScene
from scenes.parameters import SECTION
from scenes.units import Unit
from scenes.varied import kind_of, numbers
from validate.against.quantities import Match, Meaning, Subject, is_rise, temperature
from validate.against.tables import Column, split


def subject(scene: AnyScene) -> Subject:
    """A scene, whose quantities are its probes. A column may stand for a parameter, by its name."""
    catalogue, known = quantities.of(scene), numbers(scene)
    kinds: dict[str, Quantity] = {path: kind_of(scene, path) for path in known if path.startswith(f"{SECTION}.")}

    def place(name: str, unit: Unit, volts: bool) -> tuple[str, str]:
        return named(name) or ("", "is called as no probe")

    def named(name: str) -> tuple[str, str] | None:
        """The probe that a column is called after: with blanks as blanks or as underscores, with or without its unit,
        as a rise, or as the node of a circuit."""
        bare = split(name)[0]
        node = re.sub(r"^[vi]\((.*)\)$", r"\1", name, flags=re.IGNORECASE)
        ways = {_plain(text) for text in (name, bare, node, re.sub(r"\brise\b", "", bare, flags=re.IGNORECASE))}
        probes = [probe for probe in catalogue.units if _plain(probe) in ways]
        return (probes[0], "") if len(probes) == 1 else None

    def bare(column: Column, meaning: Meaning | None, start: float | None) -> Match | None:
        """Values without a unit are in that of the probe."""
        key = meaning.what if meaning else (named(column.name) or ("", ""))[0]
        if not key:
            return None
        note = f"it has no unit and is taken in {catalogue.units[key]}"
        if catalogue.units[key] != "K":
            return Match(key, column.name, column.values, note)
        rise = is_rise(column.name, meaning) and _plain(column.name) != _plain(key)
        return temperature(catalogue, key, column, column.values, rise, note)

    some = [f'"{name} ({unit})"' for name, unit in list(catalogue.units.items())[:3]]
    return Subject(
        catalogue, kinds, known.get, "a probe of the scene", f"as the probes are, such as {', '.join(some)}", place,
        bare, "scene.initial_temperature",
    )  # fmt: skip


def _plain(name: str) -> str:
    return re.sub(r"[\s_]+", " ", name).strip().lower()
