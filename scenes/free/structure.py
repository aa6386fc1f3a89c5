"""The structure of a scene of boxes, in words before and after a run: bodies, gaps that are likely slips, volumes lost
to later boxes, conductors with their electrodes, cut currents, and the area that each boundary touches."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from scenes import laws, physics
from scenes.errors import listed, quoted
from scenes.formats import area, percent, quantity
from scenes.free.grid import VOID, Grid, grid_of
from scenes.free.tables import CURRENT_CONTACT, HEAT_CONTACT
from scenes.model import Boundary, Box, Scene
from scenes.units import TIME

NARROW = 0.1  # A gap narrower than this part of the thinner box beside it is reported as a likely slip.
MOST = 20  # Bodies, boundaries and the like that one line names at most.
_LOST = 1e-6  # A loss below this part of a box's volume is rounding of its corners.


def described(scene: Scene) -> list[tuple[str, str]]:
    """Return the lines of a plan on a scene: subject and text."""
    grid = grid_of(scene)
    lines = [("bodies", _bodies(grid))]
    lines += [("gap", text) for text in gaps(grid)]
    if texts := losses(grid):
        lines.append(("overlaps", f"the later box wins: {_joined(texts)}"))
    if physics.electric(scene):
        lines.append(("conductors", _joined(_conductors(grid))))
        potentials = {physics.potential_of(b) for b in scene.boundaries if b.kind == "voltage"}
        if len(potentials) > 1 and not grid.live.any():
            lines.append(("current", "no current passes, for no conductor joins electrodes of different voltages"))
    if scene.contacts:
        lines.append(("contacts", _joined(_contacts(grid))))
    lines += [("end time", text) for text in _hurried(scene)]
    return [*lines, ("boundaries", _joined(_areas(grid)))]


def remarks(scene: Scene) -> list[str]:
    """Return remarks on likely slips: bodies, gaps, overlaps, a current that is cut, a run that is too short."""
    slips = ("gap", "overlaps", "current", "end time")
    lines = [(of, text) for of, text in described(scene) if of in slips or (of == "bodies" and text[:3] != "one")]
    return [f"{of}: {text}" for of, text in lines]


def _hurried(scene: Scene) -> list[str]:
    """A remark on a run that ends before heat diffuses through a box."""
    if scene.steady or not physics.heat(scene):
        return []
    cold = [b.material.at(scene.initial_temperature) for b in scene.boxes]
    fastest = max(max(laws.along(m.thermal_conductivity)) / (m.density * m.specific_heat) for m in cold)
    reach = float(np.sqrt(fastest * scene.end_time))
    thinnest = min(u - v for b in scene.boxes for u, v in zip(b.upper, b.lower, strict=True))
    if reach >= thinnest / 100:  # below that only surfaces warm
        return []
    return [
        f"heat diffuses {quantity(reach, 'm', 2)} in the {TIME.show(scene.end_time)} of run.end_time, and no box is "
        f"thinner than {quantity(thinnest, 'm', 2)}: temperatures change in layers at surfaces alone, which take many "
        "cells and much time"
    ]


def _bodies(grid: Grid) -> str:
    """The connected parts of the solid, and the boxes of each."""
    labels = grid.parts(grid.solid)
    bodies = [listed(grid.names(labels == label), MOST) for label in range(1, int(labels.max()) + 1)]
    return f"one: {bodies[0]}" if len(bodies) == 1 else f"{len(bodies)} that nothing passes between: {_joined(bodies)}"


def gaps(grid: Grid) -> list[str]:
    """Return a sentence for every two boxes with an empty gap below `NARROW` of the thinner one.

    Two boxes that lie diagonally from one another count where they belong to two bodies.
    """
    boxes, small, labels = grid.scene.boxes, np.array(grid.small), grid.parts(grid.solid)
    lower, upper = np.array([b.lower for b in boxes]), np.array([b.upper for b in boxes])
    body = np.zeros(len(boxes) + 1, int)
    body[grid.owner.ravel()] = labels
    sentences = []
    for a in range(len(boxes)):
        apart = np.maximum(lower[a] - upper[a + 1 :], lower[a + 1 :] - upper[a])
        thinner = np.minimum(upper[a] - lower[a], upper[a + 1 :] - lower[a + 1 :])
        near = (apart < NARROW * thinner).all(axis=1) & (apart > small).any(axis=1)
        for i in np.flatnonzero(near).tolist():
            b, axes = a + 1 + i, np.flatnonzero(apart[i] > -small)
            if len(axes) > 1:
                shown = quantity(float(np.linalg.norm(apart[i].clip(0.0))), "m", 3)
                if body[a] != body[b]:
                    sentences.append(_gap(boxes[a], boxes[b], f"lie diagonally at {shown} from one another"))
                continue
            axis, ends = int(axes[0]), (np.maximum(lower[a], lower[b]), np.minimum(upper[a], upper[b]))
            window = tuple(slice(*sorted(grid.span(d, *sorted((ends[0][d], ends[1][d]))))) for d in range(3))
            if (grid.owner[window] == VOID).all(axis=axis).any():
                shown, thin = (quantity(float(size), "m", 3) for size in (apart[i, axis], thinner[i, axis]))
                where = f"are {shown} apart along {'xyz'[axis]}, where the thinner one has {thin}"
                sentences.append(_gap(boxes[a], boxes[b], where))
    return sentences


def _gap(one: Box, other: Box, where: str) -> str:
    ends = "and nothing passes there: if they should touch, let their faces coincide"
    return f"boxes {listed([one.name, other.name])} {where}, {ends}"


def losses(grid: Grid) -> list[str]:
    """Return the part of its volume that each box loses to later boxes of another material or heat source."""
    sizes = [np.diff(p) for p in grid.planes]
    boxes, sentences = grid.scene.boxes, []
    for number, box in enumerate(boxes):
        window = tuple(slice(*grid.span(d, box.lower[d], box.upper[d])) for d in range(3))
        owner = grid.owner[window]
        if (owner == number).all():
            continue
        x, y, z = (size[w] for size, w in zip(sizes, window, strict=True))
        volumes = np.bincount(owner.ravel(), (x[:, None, None] * y[:, None] * z).ravel(), len(boxes)) / (
            x.sum() * y.sum() * z.sum()
        )
        others = [
            n for n in np.flatnonzero(volumes > _LOST).tolist()
            if n != number and (boxes[n].material, boxes[n].heat_source) != (box.material, box.heat_source)
        ]  # fmt: skip
        if others:
            part = percent(float(volumes[others].sum()))
            sentences.append(f"{quoted(box.name)} loses {part} to {listed([boxes[n].name for n in others])}")
    return sentences


def _conductors(grid: Grid) -> Iterable[str]:
    """The boxes and the electrodes of each conductor."""
    labels = grid.parts(grid.conducting)
    for label in range(1, int(labels.max()) + 1):
        names = [b.name for b in grid.scene.boundaries if b.kind == "voltage" and label in grid.touched(labels, [b])]
        what = "touches no electrode and is solved for heat alone"
        if names:
            what = f"joins {listed(names, MOST)}" if len(names) > 1 else f"touches {listed(names)} alone"
        yield f"{listed(grid.names(labels == label), MOST)} {what}"


def _contacts(grid: Grid) -> Iterable[str]:
    """The boxes, the area and the jumps of each contact."""
    for c in grid.scene.contacts:
        jumps = [f"the temperature by {HEAT_CONTACT.show(c.thermal_resistance)}"] if c.thermal_resistance else []
        if c.electrical_resistance:
            jumps.append(
                f"the potential by {CURRENT_CONTACT.show(c.electrical_resistance)}, half of its heat to each side"
            )
        where = f"{quoted(c.name)} between {listed(list(c.between))}, {area(float(grid.areas(grid.between(c)).sum()))}"
        yield f"{where}: {' and '.join(jumps) or 'perfect'}"


def _areas(grid: Grid) -> Iterable[str]:
    """The area of each boundary."""
    for b in grid.scene.boundaries:
        acts, whole = touches(grid, b), float(np.prod([u - v for u, v in zip(b.upper, b.lower, strict=True) if u > v]))
        part = f", {percent(acts / whole, 3)} of its flat box" if acts < (1 - _LOST) * whole else ""
        yield f"{quoted(b.name)} touches {area(acts)}{part}"


def touches(grid: Grid, boundary: Boundary) -> float:
    """Return the area (m2) on which a boundary acts."""
    return float(grid.areas(grid.acting(boundary)).sum())


def _joined(texts: Iterable[str]) -> str:
    """Texts joined, at most `MOST` of them."""
    every = list(texts)
    more = [f"{len(every) - MOST} more"] if len(every) > MOST else []
    return "; ".join([*every[:MOST], *more])
