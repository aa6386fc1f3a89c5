"""The rules that decide whether a scene can be solved, for boxes and for mesh files alike; and the extents of boxes.

Each refusal is one sentence that names the part; none needs numerics.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import combinations
from typing import Any, TypeVar

import numpy as np

from scenes import physics
from scenes.errors import SceneError, listed, quoted, unknown
from scenes.free.graph import CellGraph, pairs
from scenes.free.grid import Grid, grid_of
from scenes.free.structure import gaps
from scenes.model import FLOWS, ROUNDING, Boundary, Box, Contact, Point, Probe, Scene, Value, is_zero
from scenes.units import LENGTH

Explain = Callable[[str], str]
T = TypeVar("T", Box, Boundary, Probe)


def check(graph: CellGraph, explain: Explain) -> None:
    """Refuse a scene that cannot be solved; ``explain`` adds to a sentence that parts are apart, where that may matter.

    Raises SceneError for impossible contacts; for conditions that act on nothing, lie on a contact, or contradict each
    other; for probes outside of the solid or the conductors; for floating parts, and for scenes at rest.
    """
    scene = graph.scene
    for material in dict.fromkeys(physics.materials(scene)) if physics.electric(scene) else ():
        where = f"scene.initial_temperature = {scene.initial_temperature:g} K"
        physics.check_resistivity(material, f"material {quoted(material.name)}", where, scene.initial_temperature)
    check_contacts(graph, explain)
    check_boundaries(graph)
    for probe in scene.probes:
        check_probe(graph, probe, explain)
    try:
        check_parts(graph)
    except SceneError as error:
        raise SceneError(explain(str(error))) from None


def check_contacts(graph: CellGraph, explain: Explain) -> None:
    """Refuse contacts between unknown parts, twice between the same parts, of no face, or with an insulator."""
    taken, part = dict[frozenset[str], str](), graph.part_word
    for contact in graph.scene.contacts:
        label, (one, other) = f"contact {quoted(contact.name)}", contact.between
        for name in contact.between:
            if name not in graph.part_names:
                raise unknown(f"{label}.between names no {part}", name, graph.part_names)
        both = f"{label} is between {part} {quoted(one)} and {part} {quoted(other)}"
        if (graph.part(one) & graph.part(other)).any():
            raise SceneError(f"{both}, which have cells in common: give two that touch")
        if before := taken.get(pair := frozenset(contact.between)):
            raise SceneError(f"{both}, as contact {quoted(before)} is: give one contact for both its resistances")
        taken[pair] = contact.name
        if not len(graph.between(contact)):
            raise SceneError(explain(f"{both}, which have no face in common: give two that touch"))
        for name in contact.between if contact.electrical_resistance else ():
            if not graph.conducting[graph.part(name)].any():
                where = f"{label}.electrical_resistance is one with {part} {quoted(name)}"
                raise SceneError(f"{where}, which insulates: leave it out, or give a resistivity")


def check_boundaries(graph: CellGraph) -> None:
    """Refuse conditions that act on nothing, lie on a contact, or contradict each other."""
    place, acting = graph.place_word, [(b, graph.acting(b)) for b in graph.scene.boundaries]
    held = [each for each in acting if each[0].kind == "temperature"]
    fixed = np.concatenate([np.empty(0, int), *(faces for _, faces in held)])
    for b, faces in acting:
        # A temperature behind a contact resistance is a film.
        behind = " behind a contact_resistance" if b.key != b.kind and b.kind == "convection" else ""
        name, electrode = f"boundary {quoted(b.name)}.{b.key}{behind}", b.kind == "voltage"
        if not len(faces):
            why = "has solid on both sides everywhere, and acts on exposed faces only"
            why, where = ("touches nothing that conducts", "a conductor") if electrode else (why, "the surface")
            raise SceneError(f"{name} {why}: give {place} on {where}")
        for contact in graph.scene.contacts if b.kind in ("voltage", "temperature") else ():
            if _jumps(contact, electrode) and np.isin(faces, graph.between(contact)).any():
                where = f"{name} lies on contact {quoted(contact.name)}, which has two sides"
                raise SceneError(f"{where}: give {place} elsewhere, or leave the contact out")
        sides = graph.f2t[:, faces]
        if electrode and b.contact_resistance and (graph.conducting[sides] & (sides >= 0)).all(axis=0).any():
            raise SceneError(
                f"{name} behind a contact_resistance has conductors on both sides: give {place} on a surface"
            )
        if b.kind in ("heat_flux", "convection", "radiation") and np.isin(faces, fixed).all():
            raise SceneError(f"{name} lies where other boundaries fix the temperature: leave it out, or move it")
    # Electrodes of different voltage that touch, even at an edge, would pass an infinite current.
    electrodes = [(b, graph.nodes(faces)) for b, faces in acting if b.kind == "voltage"]
    for unit, meet, places in (("K", "overlap", held), ("V", "touch on a conductor", electrodes)):
        for (a, of_a), (b, of_b) in combinations(places, 2):
            unknown_potential = a.series_resistance or b.series_resistance
            if (unknown_potential or a.value != b.value) and np.isin(of_a, of_b).any():
                why = f"with different {a.kind}s, {_shown(a.value, unit)} and {_shown(b.value, unit)}"
                why = "and the potential of one is not given" if unknown_potential else why
                both = f"boundaries {quoted(a.name)} and {quoted(b.name)}"
                raise SceneError(f"{both} {meet} {why}: leave a gap between them")


def _jumps(contact: Contact, electric: bool) -> bool:
    return bool(contact.electrical_resistance if electric else contact.thermal_resistance)


def _shown(value: Value, unit: str) -> str:
    return f"{value:g} {unit}" if isinstance(value, (int, float)) else "one that varies in time"


def check_probe(graph: CellGraph, probe: Any, explain: Explain) -> None:
    """Refuse a probe where there is no solid or no conductor, or on a contact without a side."""
    name, quantity = f"probe {quoted(probe.name)}", probe.quantity
    if quantity == "resistance":
        return  # `check_parts` pairs its electrodes.
    parts = probe.boxes if isinstance(probe, Probe) else probe.groups or (probe.side,) * bool(probe.side)
    total = quantity in FLOWS or quantity == "power"
    side = np.any([*map(graph.part, parts)] or [graph.solid], axis=0)
    if not total:
        check_side(graph, probe, parts, side)

    def covered(mask: np.ndarray) -> np.ndarray:
        if quantity in FLOWS:
            return graph.bordering(graph.faces(probe), mask)
        return graph.covered(probe, mask)

    in_solid = covered(graph.solid)
    if not in_solid.any() or not (total or in_solid.all()):
        some = "reaches" if in_solid.any() else "lies"
        at = probe.lower if getattr(probe, "lower", 0) == getattr(probe, "upper", 1) else getattr(probe, "at", None)
        where = "everywhere in its place" if at is None else f"at {quoted(at)} m"
        raise SceneError(f"{name} {some} outside the solid: there has to be solid {where}")
    if quantity in ("temperature", "heat_flow"):
        return
    conducts, fixed = (covered(mask & side) for mask in (graph.conducting, graph.fixed))
    if not (conducts.any() if total else conducts.all()):
        asks = "the potential" if quantity == "potential" else f"a {quantity}"
        raise SceneError(f"{name} asks for {asks} where nothing conducts: give a place in a conductor")
    if quantity != "power" and not (fixed.any() if total else fixed.all()):
        raise SceneError(explain(
            f"{name} asks for a {quantity} in a conductor that no electrode touches, so that nothing determines its "
            "potential: give a place in another, or a boundary with a voltage there"
        ))  # fmt: skip


def check_side(graph: CellGraph, probe: Any, parts: tuple[str, ...], side: np.ndarray) -> None:
    """Refuse a probe on a contact without a side, and one that its ``side`` (cells,), the ``parts``, does not cover."""
    name, key = f"probe {quoted(probe.name)}", graph.side_key
    if parts:
        inside = graph.covered(probe, side)
        if not len(inside) or not inside.all():
            where = f"{name}.{key} = {quoted(parts[0])} isn't everywhere at the probe"
            raise SceneError(f"{where}: give a place in it or on its faces")
        return
    for contact in graph.scene.contacts:
        if not _jumps(contact, probe.quantity == "potential"):
            continue
        beside = np.zeros(len(graph.solid), bool)
        beside[graph.f2t[:, graph.between(contact)]] = True
        one, other = (graph.covered(probe, beside & graph.part(part)) for part in contact.between)
        if (one & other).any():
            first, second = map(quoted, contact.between)
            raise SceneError(
                f"{name} lies on contact {quoted(contact.name)}, where the {probe.quantity} jumps: say on which side "
                f"by {key} = {first} or {key} = {second}"
            )


def check_parts(graph: CellGraph) -> None:
    """Refuse conductors without a voltage, floating parts, parts without an exit for heat, and scenes at rest."""
    scene, labels = graph.scene, graph.parts(graph.solid)
    currents = {b.name for b in scene.boundaries if b.key == "current"}
    for names in graph.joined().values():
        if currents.issuperset(names):
            gives = f"a current is given at {listed(sorted(names))}"
            none = "no electrode of that conductor has a voltage to count from"
            raise SceneError(f'{gives}, and {none}: give one a voltage, such as "0 V"')
    pairs(graph)

    def refuse_others(fine: set[int], fault: str, advice: str) -> None:
        """Refuse the first part of the solid without one of the ``fine`` labels."""
        for label in sorted(set(range(1, int(labels.max(initial=0)) + 1)) - fine):
            raise SceneError(f"{fault} {listed(graph.names(labels == label))}: {advice}")

    heated = set(np.unique(labels[graph.heated]).tolist())
    touched = graph.touched(labels, scene.boundaries) | heated
    idle = "no boundary and no heat source acts on"
    refuse_others(touched, idle, "let it touch the rest with a face, or give it a boundary")
    if scene.steady and physics.heat(scene):
        exits = graph.touched(labels, filter(physics.is_exit, scene.boundaries))
        none = "there is no steady state without an exit for heat from"
        refuse_others(exits, none, "give a boundary with a temperature or a convection, or run.end_time")
    if heated or any(physics.heats(b, scene.initial_temperature) for b in scene.boundaries):
        return
    # An electrode without a current takes the potential of its conductor.
    electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
    driving = {physics.potential_of(b) for b in electrodes if not (b.key == "current" and is_zero(b.value))}
    if len(driving) < 2 or not graph.live.any():
        has = "no voltage across a conductor, " if physics.electric(scene) else ""
        raise SceneError(
            f"nothing happens in this scene: it has {has}no heat source, no flux, and no temperature other than "
            f"scene.initial_temperature = {scene.initial_temperature:g} K: give at least one"
        )


def checked(scene: Scene) -> Scene:
    """Return the scene with nearly equal corners made equal, and flat boxes cut to the extent of the solid.

    Raises SceneError for boxes without volume or covered by later boxes, for boundaries and probes without the extent
    that they need, for flows that are infinite, and where `rules.check` does.
    """
    for axis in range(3):
        size = max(b.upper[axis] for b in scene.boxes) - min(b.lower[axis] for b in scene.boxes)
        _check_extents("box", scene.boxes, axis, ROUNDING * size)
    grid = grid_of(scene)
    visible = set(np.unique(grid.owner).tolist())
    if hidden := [box.name for number, box in enumerate(scene.boxes) if number not in visible]:
        raise SceneError(f"box {quoted(hidden[0])} is entirely covered by later ones, which win: put it after them")
    for axis in range(3):
        _check_extents("boundary", scene.boundaries, axis, -grid.small[axis])
        _check_extents("probe", scene.probes, axis, 0.0)
    for b in scene.boundaries:
        name = f"boundary {quoted(b.name)}"
        if len(grid.flat(b.lower, b.upper)) != 1:
            raise SceneError(f"{name} is not flat: give corners that are equal along exactly one of x, y, z")
        if not (grid.f2t[:, grid.faces(b)] >= 0).any():
            raise SceneError(f"{name} touches no solid: give corners on a face of a box, or inside one")
    for probe in scene.probes:
        _check_probe(grid, probe)
    check(grid, lambda sentence: "; ".join([sentence, *gaps(grid)[:1]]))
    return tidy(grid)


def _check_extents(kind: str, items: Iterable[Box | Boundary | Probe], axis: int, least: float) -> None:
    """Refuse items whose extent along an axis is below the ``least`` (m); the extent of a box is above it."""
    for item in items:
        size = item.upper[axis] - item.lower[axis]
        if size < least or (kind == "box" and size <= least):
            ends = f"{'xyz'[axis]} from {LENGTH.show(item.lower[axis])} to {LENGTH.show(item.upper[axis])}"
            has = f"{'a negative' if size < 0 else 'no'} extent, {ends}"
            raise SceneError(f"{kind} {quoted(item.name)} has {has}: give an upper corner above the lower one")


def _check_probe(grid: Grid, probe: Probe) -> None:
    """Refuse a probe of the wrong extent, flows of two directions, and flows past an edge of infinite flux."""
    name, flat = f"probe {quoted(probe.name)}", grid.flat(probe.lower, probe.upper)
    if probe.quantity == "power" and flat:
        raise SceneError(f"{name} asks for a power in what is no volume: give corners of one")
    if probe.quantity not in FLOWS:
        return
    if len(flat) != 1:
        asks = f"{name} asks for a {probe.quantity.replace('_', ' ')} through what is not flat"
        raise SceneError(f"{asks}: give lower and upper corners that are equal along exactly one of x, y, z")
    faces, electric = grid.faces(probe), probe.quantity == "current"
    wanted = faces[grid.bordering(faces, grid.conducting if electric else grid.solid)]
    below, above = grid.f2t[:, wanted] >= 0
    # Inside the solid a flow counts along the axis, on a condition that faces along the axis against it.
    for b in grid.scene.boundaries if (below & above).any() else ():
        if (b.kind == "voltage") == electric and np.isin(wanted[below & ~above], grid.faces(b)).any():
            raise SceneError(
                f"{name} lies partly inside the solid, where it counts along the axis, and partly on boundary "
                f"{quoted(b.name)}, where it counts into the solid: give one probe for each"
            )
    # Near the edge at which two fixed temperatures meet the flux grows like one over the distance; the flow through
    # both boundaries together is finite.
    held = [(b, grid.acting(b)) for b in grid.scene.boundaries if b.kind == "temperature" and not electric]
    for (a, of_a), (b, of_b) in combinations(held, 2):
        edges = np.intersect1d(np.intersect1d(_edges(grid, of_a), _edges(grid, of_b)), _edges(grid, wanted))
        around = [of[np.isin(_edges(grid, of), edges).any(axis=0)] for of in (of_a, of_b)]
        if a.value != b.value and not np.isin(np.concatenate(around), wanted).all():
            raise SceneError(
                f"{name} reaches the edge at which boundaries {quoted(a.name)} and {quoted(b.name)} meet with "
                "different temperatures, where infinite heat flows: leave a gap between them, or cover both or neither"
            )


def _edges(grid: Grid, faces: np.ndarray) -> np.ndarray:
    """(4, faces): a number of each edge of each face, made of its two corners."""
    corners = grid.nodes(faces)
    return corners[[0, 0, 1, 2]] * grid.f2t.shape[1] + corners[[1, 2, 3, 3]]


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

    boxes, boundaries, probes = tidied(grid.scene.boxes), tidied(grid.scene.boundaries), tidied(grid.scene.probes)
    return replace(grid.scene, boxes=boxes, boundaries=boundaries, probes=probes)
