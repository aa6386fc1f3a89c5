"""Which planes of a scene make its grid large: a plane of one small box crosses the whole scene."""

from __future__ import annotations

from collections import Counter

import numpy as np

from scenes.errors import listed
from scenes.model import Boundary, Box, Probe, Scene


def crowding(scene: Scene, planes: tuple[np.ndarray, ...]) -> str:
    """Say how many planes (m, ascending) cross a scene along each axis, and which items alone use most of them."""
    items: list[Box | Boundary | Probe] = [
        *scene.boxes,
        *scene.boundaries,
        *(p for p in scene.probes if p.lower != p.upper),
    ]
    alone: Counter[str] = Counter()
    for axis, at in enumerate(planes):
        users: dict[int, set[str]] = {}
        for item in items:
            for end in (item.lower[axis], item.upper[axis]):
                users.setdefault(int(np.abs(at - end).argmin()), set()).add(item.name)
        alone.update(next(iter(names)) for names in users.values() if len(names) == 1)
    counts = ", ".join(f"{len(at)} along {'xyz'[axis]}" for axis, at in enumerate(planes))
    said = f"boxes, boundaries and probes begin and end at planes that all cross the whole scene, {counts}"
    if not alone:
        return said
    named = listed([name for name, _ in alone.most_common()])
    return f"{said}; {alone.total()} of these are used once, most by {named}"
