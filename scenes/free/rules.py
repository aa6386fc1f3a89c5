"""The rules for conditions and parts that hold for boxes and mesh files alike: can a scene be solved?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from scenes import physics
from scenes.errors import SceneError, listed, quoted
from scenes.model import AnyScene, Boundary, GroupBoundary, Value

UNFIXED = (
    "asks for a {} in a conductor that no electrode touches, which is solved for heat alone, as nothing determines "
    "its potential: give a place in another, or a boundary with a voltage there"
)  # The refusal of a probe in a conductor without a determined potential.


@dataclass(frozen=True, eq=False)
class Acting:
    """A condition with the numbers of the ``faces`` on which it acts and of their corners (``nodes``); ``between``
    where a conductor is on both sides of one of them."""

    boundary: Boundary | GroupBoundary
    faces: np.ndarray
    nodes: np.ndarray
    between: bool


def check_conditions(acting: Sequence[Acting], place: str) -> None:
    """Refuse conditions that act on nothing or contradict each other; ``place`` is the word for a place in a file."""
    for each in acting:
        b, name = each.boundary, f"boundary {quoted(each.boundary.name)}"
        if not len(each.faces) and b.kind == "voltage":
            raise SceneError(
                f"{name}.{b.key} touches nothing that conducts: give its material a resistivity, or {place} on a "
                "conductor"
            )
        if not len(each.faces):
            raise SceneError(
                f"{name}.{b.key}{_behind(b)} has solid on both sides everywhere, and acts on exposed faces only: give "
                f"{place} on the surface"
            )
        if b.kind == "voltage" and b.contact_resistance and each.between:
            raise SceneError(
                f"{name}.voltage behind a contact_resistance has conductors on both sides: give {place} on the surface "
                "of one, or leave the resistance out"
            )
    _check_electrodes([each for each in acting if each.boundary.kind == "voltage"])
    held = [each for each in acting if each.boundary.kind == "temperature"]
    for one, other in combinations(held, 2):
        a, b = one.boundary, other.boundary
        if a.value != b.value and np.isin(one.faces, other.faces).any():
            raise SceneError(
                f"boundaries {quoted(a.name)} and {quoted(b.name)} overlap with different temperatures, "
                f"{_shown(a.value, 'K')} and {_shown(b.value, 'K')}: give {place} that do not overlap"
            )
    fixed = np.concatenate([np.empty(0, int), *(each.faces for each in held)])
    for each in acting:
        b = each.boundary
        if b.kind in ("heat_flux", "convection", "radiation") and np.isin(each.faces, fixed).all():
            raise SceneError(
                f"boundary {quoted(b.name)}.{b.key}{_behind(b)} lies where other boundaries fix the temperature, and "
                f"changes nothing: leave it out, or give {place} that do not overlap theirs"
            )


def _check_electrodes(electrodes: Sequence[Acting]) -> None:
    """Refuse electrodes of different voltage that touch, though but at an edge: an infinite current would flow."""
    nodes = [set(each.nodes.tolist()) for each in electrodes]
    for (i, one), (j, other) in combinations(enumerate(electrodes), 2):
        a, b = one.boundary, other.boundary
        unknown = a.series_resistance or b.series_resistance
        if (unknown or a.value != b.value) and not nodes[i].isdisjoint(nodes[j]):
            why = f"with different voltages, {_shown(a.value, 'V')} and {_shown(b.value, 'V')}"
            why = ", and the potential of one is not given" if unknown else f" {why}"
            raise SceneError(
                f"boundaries {quoted(a.name)} and {quoted(b.name)} touch on a conductor{why}: leave a gap between them"
            )


def _behind(boundary: Boundary | GroupBoundary) -> str:
    """The words for a temperature behind a contact resistance, which is a film."""
    return "" if boundary.key == boundary.kind else " behind a contact_resistance"


def _shown(value: Value, unit: str) -> str:
    return f"{value:g} {unit}" if isinstance(value, (int, float)) else "one that varies in time"


def refuse_part(names: Sequence[str], part: str, kept: bool, hint: str = "") -> None:
    """Refuse a part of the solid, by the names of its boxes or groups: nothing acts on it, or it is ``kept`` without an
    exit for heat in a steady state."""
    one = len(names) == 1
    said = f"{part if one else {'box': 'boxes', 'volume group': 'volume groups'}[part]} {listed(names)}"
    if kept:
        has = f"{said} {'has' if one else 'have'} no exit for heat, so there is no steady state"
        raise SceneError(f"{has}: give a boundary with a temperature or a convection, or run.end_time{hint}")
    is_ = f"{said} {'is' if one else 'are'} joined to nothing that a boundary or a heat source acts on"
    raise SceneError(f"{is_}: let it touch the rest with a face, or give it a boundary{hint}")


def refuse_idle(scene: AnyScene, hint: str = "") -> None:
    """Refuse a scene that stays as it starts."""
    has = "no voltage across a conductor, " if physics.electric(scene) else ""
    raise SceneError(
        f"nothing happens in this scene: it has {has}no heat source, no flux, and no temperature other than "
        f"scene.initial_temperature = {scene.initial_temperature:g} K: give at least one{hint}"
    )
