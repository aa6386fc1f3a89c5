"""The planes of a scene, which must be breakpoints of every mesh."""

from __future__ import annotations

from scenes.model import Scene


def scene_planes(scene: Scene, axis: int) -> list[float]:
    """Coordinates (m) along an axis that must be breakpoints: faces of boxes, conditions and extended probes."""
    found = [c for b in scene.boxes for c in (b.lower[axis], b.upper[axis])]
    low, high = min(found), max(found)
    small = 1e-9 * (high - low)
    extended = [p for p in scene.probes if p.lower != p.upper]
    corners = [(b.lower, b.upper) for b in scene.boundaries] + [(p.lower, p.upper) for p in extended]
    found += [c for pair in corners for c in (pair[0][axis], pair[1][axis]) if low - small <= c <= high + small]
    found.sort()
    return [c for i, c in enumerate(found) if i == 0 or c - found[i - 1] > small]
