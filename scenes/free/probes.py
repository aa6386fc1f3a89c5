"""Probes of what is not there."""

from __future__ import annotations

import numpy as np

from scenes.dimensions import extent, point
from scenes.errors import SceneError, quoted
from scenes.free.conditions import acting, sheet_of
from scenes.free.grid import Grid, Sheet, conducting, flat_axis, solid
from scenes.model import Boundary, Probe, Scene


def check(scene: Scene, grid: Grid) -> None:
    """Refuses, by name, probes outside the solid or the conductors, and flows over what is not flat."""
    for probe in scene.probes:
        for axis in range(3):
            if probe.upper[axis] < probe.lower[axis]:
                raise SceneError(
                    f"probe {quoted(probe.name)} has a negative extent, {extent(axis, probe.lower, probe.upper)}: give "
                    "an upper corner above the lower one"
                )
        if probe.quantity in ("heat_flow", "current"):
            _check_flow(scene, grid, probe)
        else:
            _check_field(scene, grid, probe)


def _check_field(scene: Scene, grid: Grid, probe: Probe) -> None:
    """A temperature or a potential, which is needed everywhere in the probe."""
    there, owners = grid.inside(probe.lower, probe.upper), grid.cells(probe.lower, probe.upper)
    flat = tuple(d for d in range(3) if probe.upper[d] - probe.lower[d] <= grid.small[d])
    found = solid(scene)[owners].any(axis=flat)
    if not there or not found.all():
        where = point(probe.lower) if len(flat) == 3 else "everywhere in its box"
        some = "lies outside the solid" if not there or not found.any() else "reaches outside the solid"
        raise SceneError(f"probe {quoted(probe.name)} {some}: there has to be solid {_at(where)}")
    if probe.quantity == "potential" and not conducting(scene)[owners].any(axis=flat).all():
        raise SceneError(
            f"probe {quoted(probe.name)} asks for the potential where nothing conducts: give a place in a conductor, "
            "or its box's material a resistivity"
        )


def _check_flow(scene: Scene, grid: Grid, probe: Probe) -> None:
    axis = flat_axis(grid, probe.lower, probe.upper)
    what = probe.quantity.replace("_", " ")
    if axis is None:
        raise SceneError(
            f"probe {quoted(probe.name)} asks for a {what} through what is not flat: give lower and upper corners that "
            "are equal along exactly one of x, y, z"
        )
    sheet = grid.sheet(axis, probe.lower, probe.upper)
    if not sheet.beside(solid(scene)).any():
        raise SceneError(f"probe {quoted(probe.name)} lies outside the solid: give corners in it or on its surface")
    if probe.quantity == "current" and not sheet.beside(conducting(scene)).any():
        raise SceneError(
            f"probe {quoted(probe.name)} asks for a current where nothing conducts: give a place in a conductor, or "
            "its box's material a resistivity"
        )
    _refuse_mixed(scene, grid, probe, sheet)
    if probe.quantity == "heat_flow":
        _refuse_infinite(scene, grid, probe, sheet)


def _refuse_mixed(scene: Scene, grid: Grid, probe: Probe, sheet: Sheet) -> None:
    """A sheet that passes through the solid and, elsewhere, along a surface with a condition that faces against the
    axis: the one counts along the axis, the other against it."""
    is_solid = solid(scene)
    wanted = conducting(scene) if probe.quantity == "current" else is_solid
    below, above = is_solid[sheet.below], is_solid[sheet.above]
    inside = (below & above & sheet.beside(wanted)).any()
    against = set(sheet.faces[below & ~above & sheet.beside(wanted)].tolist())
    if not inside or not against:
        return
    electric = probe.quantity == "current"
    for boundary in scene.boundaries:
        if (boundary.kind == "voltage") == electric and against & set(sheet_of(grid, boundary).faces.ravel().tolist()):
            raise SceneError(
                f"probe {quoted(probe.name)} lies partly inside the solid, where it counts along the axis, and partly "
                f"on boundary {quoted(boundary.name)}, where it counts into the solid: give one probe for each"
            )


def _refuse_infinite(scene: Scene, grid: Grid, probe: Probe, sheet: Sheet) -> None:
    """Where two fixed temperatures meet at an edge, heat flows like one over the distance: without bound through one of
    them, or through a section that ends there; what passes both together is finite."""
    through = _borders(grid, probe, sheet, sheet.beside(solid(scene)))
    fixed = [b for b in scene.boundaries if b.kind == "temperature"]
    if len({b.value for b in fixed}) < 2:
        return
    found: list[tuple[Boundary, tuple[np.ndarray, np.ndarray]]] = []
    for b in fixed:
        own = sheet_of(grid, b)
        found.append((b, _borders(grid, b, own, acting(scene, own, b.kind))))
    for number, (a, of_a) in enumerate(found):
        for b, of_b in found[:number]:
            if a.value == b.value:
                continue
            meet = np.intersect1d(np.intersect1d(of_a[0], of_b[0]), through[0])
            around = [faces[np.isin(edges, meet)] for edges, faces in (of_a, of_b)]
            if not np.isin(np.concatenate(around), through[1]).all():
                raise SceneError(
                    f"probe {quoted(probe.name)} reaches the edge at which boundaries {quoted(b.name)} and "
                    f"{quoted(a.name)} meet with different temperatures, where infinite heat flows: leave a gap "
                    "between them, or give corners short of that edge, or such that cover both"
                )


def _borders(grid: Grid, item: Boundary | Probe, sheet: Sheet, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The edges of some faces of a sheet, by number, and which face each belongs to (four of each to a face)."""
    axis = flat_axis(grid, item.lower, item.upper)
    first, second = (d for d in range(3) if d != axis)
    at, across, along = (sheet.vertices[s] for s in (np.s_[:-1, :-1], np.s_[1:, :-1], np.s_[:-1, 1:]))
    edges = [3 * at + first, 3 * along + first, 3 * at + second, 3 * across + second]
    return np.concatenate([e[chosen] for e in edges]), np.tile(sheet.faces[chosen], 4)


def _at(where: str) -> str:
    return where if where.startswith("everywhere") else f"at {where}"
