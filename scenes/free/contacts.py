"""The faces of contacts on a grid of the scene's boxes, and the refusal of impossible contacts."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence

import numpy as np

from scenes.errors import SceneError, did_you_mean, quoted
from scenes.free.grid import Grid
from scenes.model import Boundary, Contact, GroupBoundary, Probe, Scene

THERMAL, ELECTRIC = 0, 1
"""First index of the table of `resistances`."""


def resistances(scene: Scene) -> np.ndarray:
    """(2, boxes + 1, boxes + 1): the thermal (m2 K/W) and the electrical (ohm m2) resistance between every two boxes,
    by number; 0 where they touch perfectly, and for the void, whose number is the last or -1."""
    resistances = np.zeros((2, len(scene.boxes) + 1, len(scene.boxes) + 1))
    numbers = {box.name: number for number, box in enumerate(scene.boxes)}
    for contact in scene.contacts:
        one, other = (numbers.get(name) for name in contact.between)
        # In the symmetric part of a scene a box may be missing.
        if one is not None and other is not None:
            resistances[:, one, other] = resistances[:, other, one] = (
                contact.thermal_resistance,
                contact.electrical_resistance,
            )
    return resistances


def across(owner: np.ndarray, axis: int, between: np.ndarray) -> np.ndarray:
    """Return the entries of a table (boxes + 1, boxes + 1) at the faces between neighbouring cells of these owners.

    The result is one shorter along the axis, which comes first.
    """
    owners = np.moveaxis(owner, axis, 0)
    return between[owners[:-1], owners[1:]]


def check(grid: Grid) -> None:
    """Refuse impossible contacts, and temperatures and voltages that lie on one."""
    scene = grid.scene
    insulators = {box.name for box in scene.boxes if box.material.resistivity is None}
    refuse(scene.contacts, ("box", "boxes"), [box.name for box in scene.boxes], lambda c: area(grid, c) > 0, insulators)
    for b in scene.boundaries if scene.contacts else ():
        _check_boundary(grid, b)


def refuse(
    given: Iterable[Contact],
    called: tuple[str, str],
    names: Sequence[str],
    touch: Callable[[Contact], bool],
    insulators: Collection[str],
) -> None:
    """Refuse contacts of unknown parts, of one part with itself, of the same two parts twice, of parts that don't
    ``touch``, and of a current with an insulator. ``called`` is the word for one part and for many."""
    taken, (part, parts) = dict[frozenset[str], str](), called
    for contact in given:
        label = f"contact {quoted(contact.name)}"
        for name in contact.between:
            if name not in names:
                listed = ", ".join(map(quoted, names[:20]))
                raise SceneError(
                    f"{label}.between names no {part} {quoted(name)}: give {listed}{did_you_mean(name, names)}"
                )
        one, other = contact.between
        if one == other:
            raise SceneError(f"{label} is of {part} {quoted(one)} with itself: give two {parts} that touch")
        pair = frozenset(contact.between)
        if pair in taken:
            raise SceneError(
                f"{label} is between {parts} {quoted(one)} and {quoted(other)}, as contact {quoted(taken[pair])} is: "
                "give one contact for both its resistances"
            )
        taken[pair] = contact.name
        if not touch(contact):
            raise SceneError(
                f"{label} is between {parts} {quoted(one)} and {quoted(other)}, which have no face in common: give two "
                "that touch"
            )
        insulator = next((name for name in names if name in pair and name in insulators), None)
        if contact.electrical_resistance and insulator is not None:
            raise SceneError(
                f"{label}.electrical_resistance is one with {part} {quoted(insulator)}, which insulates: leave it out, "
                "or give its material a resistivity"
            )


def _check_boundary(grid: Grid, boundary: Boundary) -> None:
    sheet = grid.sheet(boundary)
    kind = {"temperature": THERMAL, "voltage": ELECTRIC}.get(boundary.kind)
    if sheet is None or kind is None:
        return
    on = resistances(grid.scene)[kind][sheet.below, sheet.above] > 0
    if on.any():
        at = sheet.below[on].flat[0], sheet.above[on].flat[0]
        contact = grid.scene.contact(int(at[0]), int(at[1]))
        assert contact is not None
        raise SceneError(on_one(boundary, contact, "corners"))


def on_one(boundary: Boundary | GroupBoundary, contact: Contact, place: str) -> str:
    """Return the sentence on a boundary that lies on a contact."""
    return (
        f"boundary {quoted(boundary.name)}.{boundary.kind} lies on contact {quoted(contact.name)}, where nothing says "
        f"on which side of it: give {place} elsewhere, or leave the contact out"
    )


def area(grid: Grid, contact: Contact) -> float:
    """Return the area (m2) of a contact."""
    numbers = [number for number, box in enumerate(grid.scene.boxes) if box.name in contact.between]
    table = np.zeros((len(grid.scene.boxes) + 1,) * 2)
    table[np.ix_(numbers, numbers)] = 1.0 - np.eye(len(numbers))
    total, lengths = 0.0, [np.diff(planes) for planes in grid.planes]
    for axis in range(3):
        first, second = (lengths[d] for d in range(3) if d != axis)
        total += float((across(grid.owner, axis, table).sum(axis=0) * np.outer(first, second)).sum())
    return total


def touched(grid: Grid, probe: Probe) -> Contact | None:
    """Return a contact at which the quantity of a probe jumps, or None."""
    kind = ELECTRIC if probe.quantity == "potential" else THERMAL
    owners, table = grid.cells(probe.lower, probe.upper), resistances(grid.scene)[kind]
    for axis in grid.flat(probe.lower, probe.upper):
        if owners.shape[axis] == 2 and (on := across(owners, axis, table).ravel() > 0).any():
            low, high = np.moveaxis(owners, axis, 0).reshape(2, -1)[:, on.argmax()].tolist()
            return grid.scene.contact(low, high)
    return None
