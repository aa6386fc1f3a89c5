"""Boundaries that are not flat, that act on nothing, or that contradict each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from scenes.dimensions import extent
from scenes.errors import SceneError, quoted
from scenes.free.grid import Grid, Sheet, conducting, flat_axis, solid
from scenes.model import Boundary, Scene, Value


def check(scene: Scene, grid: Grid) -> None:
    """Refuses, by name, boundaries that cannot act as they say."""
    for boundary in scene.boundaries:
        found = sheet_of(grid, boundary)
        if not found.beside(solid(scene)).any():
            raise SceneError(
                f"boundary {quoted(boundary.name)} touches no solid: give corners on a face of a box, or inside one"
            )
        acts = acting(scene, found, boundary.kind)
        if boundary.kind in ("heat_flux", "convection") and not acts.any():
            raise SceneError(
                f"boundary {quoted(boundary.name)}.{boundary.kind} has solid on both sides everywhere, and acts on "
                "exposed faces only: give corners on the surface"
            )
        if boundary.kind == "voltage" and not acts.any():
            raise SceneError(
                f"boundary {quoted(boundary.name)}.voltage touches nothing that conducts: give its box's material a "
                "resistivity, or corners on a conductor"
            )
    _refuse_electrodes(scene, grid)
    _refuse_temperatures(scene, grid)
    _refuse_overridden(scene, grid)


def sheet_of(grid: Grid, boundary: Boundary) -> Sheet:
    """A boundary on the grid; SceneError where it is not flat."""
    for axis in range(3):
        if boundary.upper[axis] - boundary.lower[axis] < -grid.small[axis]:
            raise SceneError(
                f"boundary {quoted(boundary.name)} has a negative extent, "
                f"{extent(axis, boundary.lower, boundary.upper)}: give an upper corner above the lower one"
            )
    axis_ = flat_axis(grid, boundary.lower, boundary.upper)
    if axis_ is None:
        raise SceneError(
            f"boundary {quoted(boundary.name)} is not flat: give corners that are equal along exactly one of x, y, z"
        )
    return grid.sheet(axis_, boundary.lower, boundary.upper)


def acting(scene: Scene, sheet: Sheet, kind: str) -> np.ndarray:
    """The faces of a boundary at which its condition acts."""
    is_solid = solid(scene)
    if kind in ("heat_flux", "convection"):
        return is_solid[sheet.below] ^ is_solid[sheet.above]
    return sheet.beside(conducting(scene) if kind == "voltage" else is_solid)


def _refuse_electrodes(scene: Scene, grid: Grid) -> None:
    """Electrodes of different voltage that overlap, or touch at an edge, where an infinite current would flow."""
    for one, other in _contradicting(scene, grid, "voltage", Sheet.corners):
        raise SceneError(
            f"boundaries {quoted(one.name)} and {quoted(other.name)} touch on a conductor with different voltages, "
            f"{_shown(one.value)} and {_shown(other.value)}: leave a gap between them"
        )


def _refuse_temperatures(scene: Scene, grid: Grid) -> None:
    """Different fixed temperatures over one another; side by side they may be."""
    for one, other in _contradicting(scene, grid, "temperature", lambda sheet, at: set(sheet.faces[at].tolist())):
        raise SceneError(
            f"boundaries {quoted(one.name)} and {quoted(other.name)} overlap with different temperatures, "
            f"{_shown(one.value, 'K')} and {_shown(other.value, 'K')}: give corners that do not overlap"
        )


def _contradicting(
    scene: Scene, grid: Grid, kind: str, places: Callable[[Sheet, np.ndarray], set[int]]
) -> Iterator[tuple[Boundary, Boundary]]:
    """Boundaries of a kind with different values that act on some of the same ``places``, the earlier one first."""
    taken: list[tuple[Boundary, set[int]]] = []
    for boundary in (b for b in scene.boundaries if b.kind == kind):
        sheet = sheet_of(grid, boundary)
        own = places(sheet, acting(scene, sheet, kind))
        yield from ((other, boundary) for other, its in taken if other.value != boundary.value and own & its)
        taken.append((boundary, own))


def _refuse_overridden(scene: Scene, grid: Grid) -> None:
    """Fluxes and convections of which fixed temperatures leave nothing."""
    fixed: set[int] = set()
    for boundary in (b for b in scene.boundaries if b.kind == "temperature"):
        fixed |= set(sheet_of(grid, boundary).faces.ravel().tolist())
    for boundary in (b for b in scene.boundaries if b.kind in ("heat_flux", "convection")):
        sheet = sheet_of(grid, boundary)
        if set(sheet.faces[acting(scene, sheet, boundary.kind)].tolist()) <= fixed:
            raise SceneError(
                f"boundary {quoted(boundary.name)}.{boundary.kind} lies where other boundaries fix the temperature, "
                "and changes nothing: leave it out, or give corners that do not overlap theirs"
            )


def _shown(value: Value, unit: str = "V") -> str:
    return f"{value:g} {unit}" if isinstance(value, (int, float)) else "one that varies in time"
