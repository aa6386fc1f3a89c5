"""Whether a free scene can be solved: every refusal that needs no numerics, each one sentence that names the part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from scenes import physics, readouts
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.free import contacts
from scenes.free.grid import ROUNDING, Grid, Sheet, cut, grid_of
from scenes.free.rules import UNFIXED, Acting, check_conditions, refuse_idle, refuse_part
from scenes.model import FLOWS, Boundary, Box, Point, Probe, Scene, is_zero
from scenes.units import extent, point

T = TypeVar("T", Box, Boundary, Probe)


def check(scene: Scene) -> Scene:
    """Return the scene with nearly equal corners made equal, and flat boxes cut to the extent of the solid.

    Raises SceneError for boxes without volume or covered by later ones; boundaries that are not flat, that have nothing
    to act on, or that contradict each other; probes outside the solid; floating parts, and scenes at rest.
    """
    _check_extents(scene)
    grid = grid_of(scene)
    seen = set(np.unique(grid.owner).tolist())
    if hidden := [box.name for number, box in enumerate(scene.boxes) if number not in seen]:
        raise SceneError(
            f"box {quoted(hidden[0])} is entirely covered by later ones, which win: leave it out, or put it after them"
        )
    physics.check_resistivities(scene)
    contacts.check(grid)
    _check_boundaries(grid)
    for probe in scene.probes:
        _check_probe(grid, probe)
    _check_parts(grid)
    return tidy(grid)


def _check_extents(scene: Scene) -> None:
    for axis in range(3):
        low, high = min(b.lower[axis] for b in scene.boxes), max(b.upper[axis] for b in scene.boxes)
        for box in scene.boxes:
            if not box.upper[axis] - box.lower[axis] > ROUNDING * (high - low):
                kind = "no" if box.upper[axis] >= box.lower[axis] else "a negative"
                _refuse_extent("box", box, kind, axis)


def _refuse_extent(what: str, item: T, kind: str, axis: int) -> None:
    raise SceneError(
        f"{what} {quoted(item.name)} has {kind} extent, {extent(axis, item.lower, item.upper)}: give an upper corner "
        "above the lower one"
    )


def _check_boundaries(grid: Grid) -> None:
    """Refuse boundaries that are not flat, that act on nothing, or that contradict each other."""
    acting = []
    for b in grid.scene.boundaries:
        for axis in range(3):
            if b.upper[axis] - b.lower[axis] < -grid.small[axis]:
                _refuse_extent("boundary", b, "a negative", axis)
        name, sheet = f"boundary {quoted(b.name)}", grid.sheet(b)
        if sheet is None:
            raise SceneError(f"{name} is not flat: give corners that are equal along exactly one of x, y, z")
        if not sheet.beside(grid.solid).any():
            raise SceneError(f"{name} touches no solid: give corners on a face of a box, or inside one")
        acts = grid.acting(sheet, b.kind)
        between = bool((grid.conducting[sheet.below] & grid.conducting[sheet.above]).any())
        acting.append(Acting(b, sheet.faces[acts], np.array(sorted(sheet.corners(acts)), int), between))
    check_conditions(acting, "corners")


def _check_probe(grid: Grid, probe: Probe) -> None:
    """Refuse a probe outside the solid or the conductors, and a flow through a box that is not flat."""
    for axis in range(3):
        if probe.upper[axis] < probe.lower[axis]:
            _refuse_extent("probe", probe, "a negative", axis)
    if probe.quantity in FLOWS:
        _check_flow(grid, probe)
        return
    if probe.quantity == "resistance":
        return  # `_check_parts` does that, which knows what each electrode touches
    if probe.quantity == "power":
        if grid.flat(probe.lower, probe.upper):
            raise SceneError(f"probe {quoted(probe.name)} asks for a power in what is no volume: give corners of one")
        if not grid.conducting[grid.cells(probe.lower, probe.upper)].any():
            _refuse_insulated(probe, "a power")
        return
    # A temperature or a potential is needed everywhere in the probe.
    inside, owners = grid.inside(probe.lower, probe.upper), grid.cells(probe.lower, probe.upper)
    flat = grid.flat(probe.lower, probe.upper)
    solid = grid.solid[owners].any(axis=flat)
    if probe.boxes and not flat:
        _check_side(grid, probe)  # read where these boxes are
    elif not inside or not solid.all():
        where = f"at {point(probe.lower)}" if len(flat) == 3 else "everywhere in its box"
        some = "lies outside the solid" if not inside or not solid.any() else "reaches outside the solid"
        raise SceneError(f"probe {quoted(probe.name)} {some}: there has to be solid {where}")
    _check_side(grid, probe)
    if probe.quantity == "potential" and not grid.conducting[owners].any(axis=flat).all():
        _refuse_insulated(probe, "the potential")
    if probe.quantity == "potential" and not grid.cells(probe.lower, probe.upper, grid.fixed).any(axis=flat).all():
        raise SceneError(f"probe {quoted(probe.name)} {UNFIXED.format('potential')}")


def _check_side(grid: Grid, probe: Probe) -> None:
    """Refuse a probe on a contact without a side, and a probe outside of its boxes."""
    names = [box.name for box in grid.scene.boxes]
    if not probe.boxes:
        if contact := contacts.touched(grid, probe):
            one, other = map(quoted, contact.between)
            raise SceneError(
                f"probe {quoted(probe.name)} lies on contact {quoted(contact.name)}, where the {probe.quantity} jumps: "
                f"say on which side by box = {one} or box = {other}"
            )
        return
    if unknown := next((name for name in probe.boxes if name not in names), None):
        raise SceneError(
            f"probe {quoted(probe.name)}.box = {quoted(unknown)} is no box of the scene: give "
            f"{', '.join(map(quoted, names[:20]))}{did_you_mean(unknown, names)}"
        )
    mask = np.array([*(name in probe.boxes for name in names), False])
    owners, flat = grid.cells(probe.lower, probe.upper), grid.flat(probe.lower, probe.upper)
    there = mask[owners].any(axis=flat)
    if not (there.all() if flat else there.any()):
        raise SceneError(
            f"probe {quoted(probe.name)}.box = {quoted(probe.boxes[0])} isn't everywhere in the probe's box: give a "
            "place in it or on its faces"
        )
    if probe.quantity == "potential" and not (mask & grid.conducting).any():
        _refuse_insulated(probe, "the potential")


def _refuse_insulated(probe: Probe, what: str) -> None:
    raise SceneError(
        f"probe {quoted(probe.name)} asks for {what} where nothing conducts: give a place in a conductor, or its "
        "box's material a resistivity"
    )


def _check_flow(grid: Grid, probe: Probe) -> None:
    sheet, electric = grid.sheet(probe), probe.quantity == "current"
    if sheet is None:
        raise SceneError(
            f"probe {quoted(probe.name)} asks for a {probe.quantity.replace('_', ' ')} through what is not flat: give "
            "lower and upper corners that are equal along exactly one of x, y, z"
        )
    if not sheet.beside(grid.solid).any():
        raise SceneError(f"probe {quoted(probe.name)} lies outside the solid: give corners in it or on its surface")
    wanted = sheet.beside(grid.conducting if electric else grid.solid)
    if not wanted.any():
        _refuse_insulated(probe, "a current")
    if electric:
        face_sheet = grid.sheet(probe, grid.fixed.astype(int))
        if face_sheet is None or not ((face_sheet.below > 0) | (face_sheet.above > 0)).any():
            raise SceneError(f"probe {quoted(probe.name)} {UNFIXED.format('current')}")
    # A sheet through the solid that elsewhere lies on a condition which faces against the axis: the one counts along
    # the axis, the other against it.
    below, above = grid.solid[sheet.below], grid.solid[sheet.above]
    against = sheet.faces[below & ~above & wanted]
    for b in grid.scene.boundaries if (below & above & wanted).any() else ():
        face_sheet = grid.sheet(b)
        if (b.kind == "voltage") == electric and face_sheet is not None and np.isin(against, face_sheet.faces).any():
            raise SceneError(
                f"probe {quoted(probe.name)} lies partly inside the solid, where it counts along the axis, and partly "
                f"on boundary {quoted(b.name)}, where it counts into the solid: give one probe for each"
            )
    if not electric:
        _refuse_infinite(grid, probe, sheet)


def _refuse_infinite(grid: Grid, probe: Probe, sheet: Sheet) -> None:
    """Refuse a flow past the edge at which two fixed temperatures meet, which is infinite.

    Near the edge the flux grows like one over the distance; the flow through both boundaries together is finite.
    """
    crossing = sheet.edges(sheet.beside(grid.solid))
    earlier: list[tuple[Boundary, tuple[np.ndarray, np.ndarray]]] = []
    for a in (b for b in grid.scene.boundaries if b.kind == "temperature"):
        face_sheet = grid.sheet(a)
        assert face_sheet is not None
        of_a = face_sheet.edges(grid.acting(face_sheet, a.kind))
        for b, of_b in earlier:
            if a.value == b.value:
                continue
            meet = np.intersect1d(np.intersect1d(of_a[0], of_b[0]), crossing[0])
            around = [faces[np.isin(edges, meet)] for edges, faces in (of_a, of_b)]
            if not np.isin(np.concatenate(around), crossing[1]).all():
                raise SceneError(
                    f"probe {quoted(probe.name)} reaches the edge at which boundaries {quoted(b.name)} and "
                    f"{quoted(a.name)} meet with different temperatures, where infinite heat flows: leave a gap "
                    "between them, or give corners short of that edge, or such that cover both"
                )
        earlier.append((a, of_a))


def _check_parts(grid: Grid) -> None:
    """Refuses, by their boxes' names, floating parts and parts without an exit; and
    a scene that stays as it starts: all at the initial temperature, and no voltage across a conductor."""
    scene = grid.scene

    def touched(labels: np.ndarray, which: Callable[[Boundary], bool]) -> set[int]:
        return set().union(*(grid.parts_at(labels, b) for b in scene.boundaries if which(b)))

    def refuse(labels: np.ndarray, fine: set[int], kept: bool) -> None:
        for label in set(range(1, int(labels.max()) + 1)) - fine:
            names = [scene.boxes[number].name for number in np.unique(grid.owner[labels == label])]
            refuse_part(names, "box", kept, _nearly(grid))

    physics.refuse_ungrounded(scene.boundaries, grid.joined().values())
    readouts.pairs(scene, grid.joined().values())
    labels = grid.parts(grid.solid)
    hot = np.array([*(not is_zero(box.heat_source) for box in scene.boxes), False])
    heated = set(np.unique(labels[hot[grid.owner]]).tolist())
    refuse(labels, touched(labels, lambda b: True) | heated, False)
    if scene.steady and physics.heat(scene):
        refuse(labels, touched(labels, physics.is_exit), True)
    driven = hot.any() or any(physics.heats(b, scene.initial_temperature) for b in scene.boundaries)
    # An electrode without a current takes the potential of what it touches.
    acting = {
        physics.potential_of(b)
        for b in scene.boundaries
        if b.kind == "voltage" and not (b.key == "current" and is_zero(b.value))
    }
    flows = len(acting) > 1 and any(len(voltages) > 1 for voltages in grid.electrified()[1].values())
    if not driven and not flows:
        if where := cut(grid):
            raise SceneError(
                f"nothing happens in this scene: {where}, between electrodes of different voltages: give its "
                "material a resistivity, or let the conductors touch"
            )
        refuse_idle(scene, _nearly(grid))


def _nearly(grid: Grid) -> str:
    """The end of a sentence on a lonely part: the first two boxes that nearly touch."""
    from scenes.free.structure import gaps

    return "".join(f"; {sentence}" for sentence in gaps(grid)[:1])


def tidy(grid: Grid) -> Scene:
    """Return the scene with its corners on the planes of the grid, where they are within rounding, and none beyond the
    solid. A tidy scene stays as it is."""

    def coordinate(axis: int, c: float) -> float:
        planes = grid.planes[axis]
        nearest = float(planes[abs(planes - c).argmin()])
        if abs(nearest - c) <= 1.5 * grid.small[axis]:
            return nearest
        return min(max(c, float(planes[0])), float(planes[-1]))

    def corner(at: Point) -> Point:
        x, y, z = (coordinate(axis, c) for axis, c in enumerate(at))
        return x, y, z

    def tidied(items: tuple[T, ...]) -> tuple[T, ...]:
        return tuple(replace(item, lower=corner(item.lower), upper=corner(item.upper)) for item in items)

    scene = grid.scene
    return replace(
        scene, boxes=tidied(scene.boxes), boundaries=tidied(scene.boundaries), probes=tidied(scene.probes)
    )  # fmt: skip
