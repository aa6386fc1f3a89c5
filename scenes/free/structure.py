"""The structure of a scene of boxes in words: bodies, gaps that are likely slips, volumes lost to later boxes, and
currents that are cut."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from scenes import physics
from scenes.errors import listed, quoted
from scenes.formats import percent, quantity
from scenes.free.grid import VOID, Grid, grid_of
from scenes.model import Box, Scene

_LOST = 1e-6  # A loss below this part of a box's volume is rounding of its corners.


def described(scene: Scene) -> list[tuple[str, str]]:
    """Return the lines of a plan on a scene: subject and text."""
    grid = grid_of(scene)
    labels = grid.parts(grid.solid)
    bodies = [listed(grid.names(labels == label), 20) for label in range(1, int(labels.max()) + 1)]
    said = f"one: {bodies[0]}" if len(bodies) == 1 else f"{len(bodies)} that nothing passes between: {_joined(bodies)}"
    lines = [("bodies", said), *(("gap", text) for text in gaps(grid))]
    if texts := losses(grid):
        lines.append(("overlaps", f"the later box wins: {_joined(texts)}"))
    potentials = {physics.potential_of(b) for b in scene.boundaries if b.kind == "voltage"}
    if len(potentials) > 1 and not grid.live.any():
        lines.append(("current", "no current passes, for no conductor joins electrodes of different voltages"))
    return lines


def remarks(scene: Scene) -> list[str]:
    """Return remarks on likely slips: several bodies, gaps, overlaps, a current that is cut."""
    return [f"{of}: {text}" for of, text in described(scene) if of != "bodies" or text[:3] != "one"]


def gaps(grid: Grid) -> list[str]:
    """Return a sentence for every two boxes with an empty gap below a tenth of the thinner one: a likely slip.

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
        near = (apart < 0.1 * thinner).all(axis=1) & (apart > small).any(axis=1)
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
    x, y, z = (np.diff(p) for p in grid.planes)
    volumes, boxes, sentences = x[:, None, None] * y[:, None] * z, grid.scene.boxes, []
    for number, box in enumerate(boxes):
        window = tuple(slice(*grid.span(d, box.lower[d], box.upper[d])) for d in range(3))
        owner, inside = grid.owner[window], volumes[window]
        parts = np.bincount(owner.ravel(), inside.ravel(), len(boxes)) / inside.sum()
        others = [
            n for n in np.flatnonzero(parts > _LOST).tolist()
            if n != number and (boxes[n].material, boxes[n].heat_source) != (box.material, box.heat_source)
        ]  # fmt: skip
        if others:
            part = percent(float(parts[others].sum()))
            sentences.append(f"{quoted(box.name)} loses {part} to {listed([boxes[n].name for n in others])}")
    return sentences


def _joined(texts: Iterable[str]) -> str:
    """Texts joined, at most 20 of them."""
    every = list(texts)
    more = [f"{len(every) - 20} more"] if len(every) > 20 else []
    return "; ".join([*every[:20], *more])
