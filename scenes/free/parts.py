"""Parts of the solid, and of its conductors, that nothing acts on or that heat cannot leave; scenes in which nothing
happens."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scenes import physics
from scenes.errors import SceneError, listed
from scenes.free.conditions import acting, sheet_of
from scenes.free.grid import VOID, Grid, conducting, solid
from scenes.model import Boundary, Box, GroupBoundary, Scene, Value, is_zero, values


def check(scene: Scene, grid: Grid) -> None:
    """Refuses, by their boxes' names, conductors without a fixed voltage, floating parts and parts without an exit."""
    if physics.electric(scene):
        labels = connected(grid, conducting(scene))
        _refuse(scene, grid, labels, _touched(scene, grid, labels, lambda b: b.kind == "voltage"), UNFIXED)
    labels = connected(grid, solid(scene))
    acted = _touched(scene, grid, labels, lambda b: True)
    acted |= _sources(scene, grid, labels)
    _refuse(scene, grid, labels, acted, FLOATING)
    if scene.steady and physics.heat(scene):
        _refuse(scene, grid, labels, _touched(scene, grid, labels, is_exit), KEPT)


UNFIXED = (
    "conducts, but no boundary fixes a voltage there|conduct, but no boundary fixes a voltage there",
    "give one, or leave out its material's resistivity",
)
FLOATING = (
    "is joined to nothing that a boundary or a heat source acts on|are joined to nothing that a boundary or a heat "
    "source acts on",
    "let it touch the rest with a face, or give it a boundary",
)
KEPT = (
    "has no exit for heat, so there is no steady state|have no exit for heat, so there is no steady state",
    "give a boundary with a temperature or a convection, or run.end_time in place of steady",
)


def connected(grid: Grid, wanted: np.ndarray) -> np.ndarray:
    """(cells): a number from 1 on for each set of wanted cells that faces join, 0 elsewhere."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    inside = wanted[grid.owner]
    number = np.cumsum(inside.ravel()).reshape(inside.shape) * inside
    pairs = []
    for axis in range(3):
        low, high = (np.moveaxis(number, axis, 0)[s].ravel() for s in (slice(None, -1), slice(1, None)))
        joined = (low > 0) & (high > 0)
        pairs.append(np.stack([low[joined], high[joined]]) - 1)
    rows, columns = np.concatenate(pairs, axis=1)
    count = int(inside.sum())
    graph = coo_array((np.ones(len(rows), bool), (rows, columns)), shape=(count, count))
    found = np.zeros(inside.shape, int)
    found[inside] = 1 + connected_components(graph, directed=False)[1]
    return found


def is_exit(boundary: Boundary | GroupBoundary) -> bool:
    """Whether heat can leave by a boundary in the end."""
    return boundary.kind == "temperature" or (boundary.kind == "convection" and boundary.value != 0)


def labels_at(scene: Scene, grid: Grid, labels: np.ndarray, boundary: Boundary) -> set[int]:
    """The labels of the cells on which a boundary acts."""
    sheet = sheet_of(grid, boundary)
    axis = next(d for d in range(3) if boundary.upper[d] - boundary.lower[d] <= grid.small[d])
    # The labels in place of the owners, on the same faces.
    beside = Grid(grid.planes, labels).sheet(axis, boundary.lower, boundary.upper)
    acts = acting(scene, sheet, boundary.kind)
    found = set(np.unique(beside.below[acts]).tolist()) | set(np.unique(beside.above[acts]).tolist())
    return found - {0, VOID}


def _touched(scene: Scene, grid: Grid, labels: np.ndarray, which: Callable[[Boundary], bool]) -> set[int]:
    return set().union(*(labels_at(scene, grid, labels, b) for b in scene.boundaries if which(b)))


def _sources(scene: Scene, grid: Grid, labels: np.ndarray) -> set[int]:
    hot = np.array([*(not is_zero(box.heat_source) for box in scene.boxes), False])
    return set(np.unique(labels[hot[grid.owner]]).tolist()) - {0}


def _refuse(scene: Scene, grid: Grid, labels: np.ndarray, fine: set[int], why: tuple[str, str]) -> None:
    """Refuses the first part whose label is not among the fine ones."""
    for label in range(1, int(labels.max()) + 1):
        if label not in fine:
            names = [scene.boxes[number].name for number in np.unique(grid.owner[labels == label])]
            said = why[0].split("|")[len(names) > 1]
            called = f"{'box' if len(names) == 1 else 'boxes'} {listed(names)}"
            raise SceneError(f"{called} {said}: {why[1]}")


def check_driven(scene: Scene, grid: Grid) -> None:
    """Refuses a scene that stays as it starts: all at the initial temperature, and no voltage across a conductor."""
    if any(heats(b, scene.initial_temperature) for b in scene.boundaries) or any(_generates(b) for b in scene.boxes):
        return
    if _carries_current(scene, grid):
        return
    has = "no voltage across a conductor, " if physics.electric(scene) else ""
    raise SceneError(
        f"nothing happens in this scene: it has {has}no heat source, no flux, and no temperature other than "
        f"scene.initial_temperature = {scene.initial_temperature:g} K: give at least one"
    )


def heats(boundary: Boundary | GroupBoundary, initial: float) -> bool:
    """Whether a boundary changes a solid that is at an initial temperature (K)."""
    if boundary.kind == "temperature":
        return _other_than(boundary.value, initial)
    if boundary.kind == "heat_flux":
        return not is_zero(boundary.value)
    return boundary.kind == "convection" and boundary.value != 0 and _other_than(boundary.ambient, initial)


def _generates(box: Box) -> bool:
    return not is_zero(box.heat_source)


def _other_than(value: Value, fixed: float) -> bool:
    return any(v != fixed for v in values(value))


def _carries_current(scene: Scene, grid: Grid) -> bool:
    electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
    if len({b.value for b in electrodes}) < 2:
        return False
    labels = connected(grid, conducting(scene))
    levels: dict[int, set[Value]] = {}
    for boundary in electrodes:
        for label in labels_at(scene, grid, labels, boundary):
            levels.setdefault(label, set()).add(boundary.value)
    return any(len(found) > 1 for found in levels.values())
