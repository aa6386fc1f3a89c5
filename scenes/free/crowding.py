"""Which planes of a scene make a grid of it large, in words: a plane of one small box crosses the whole scene."""

from __future__ import annotations

from collections import Counter

import numpy as np

from scenes.errors import listed
from scenes.formats import quantity
from scenes.model import Boundary, Box, Probe, Scene


def crowding(scene: Scene, planes: tuple[np.ndarray, ...]) -> str:
    """How many planes (m, ascending) of a scene there are along each axis, which boxes, boundaries and probes most of
    those belong to that no other shares, and which two planes lie nearest to one another."""
    items: list[Box | Boundary | Probe] = [*scene.boxes, *scene.boundaries]
    items += [p for p in scene.probes if p.lower != p.upper]
    alone: Counter[str] = Counter()
    nearest: tuple[float, str] = (np.inf, "")
    for axis, at in enumerate(planes):
        ends = np.array([[item.lower[axis], item.upper[axis]] for item in items])
        plane = np.clip(np.searchsorted(at, ends), 1, max(len(at) - 1, 1))
        plane -= abs(ends - at[plane - 1]) < abs(ends - at[np.minimum(plane, len(at) - 1)])
        # A flat box has one plane where others have two.
        users = np.bincount(np.concatenate([plane[:, 0], plane[plane[:, 1] > plane[:, 0], 1]]), minlength=len(at))
        for item, (low, high) in zip(items, plane.tolist(), strict=True):
            if count := int(users[low] == 1) + int(users[high] == 1 and high > low):
                alone[item.name] += count
        gaps = np.diff(at)
        if len(gaps) and gaps.min() < nearest[0]:
            i = int(gaps.argmin())
            ends_at = [{items[k].name for k in np.flatnonzero((plane == j).any(axis=1))} for j in (i, i + 1)]
            apart = f"{quantity(float(gaps[i]), 'm', 3)} apart along {'xyz'[axis]}"
            if both := sorted(ends_at[0] & ends_at[1]):
                nearest = float(gaps[i]), f"both ends of {listed(both)}, {apart}"
            else:
                nearest = float(gaps[i]), f"ends of {listed([min(names) for names in ends_at])}, {apart}"
    counts = ", ".join(f"{len(at)} along {'xyz'[axis]}" for axis, at in enumerate(planes))
    said = f"boxes, boundaries and probes begin and end at planes that all cross the whole scene, {counts}"
    if alone:
        named = listed([name for name, _ in alone.most_common()])
        said += f"; {alone.total()} of these are used once, most by {named}"
    return f"{said}; the nearest two are {nearest[1]}" if nearest[1] else said
