"""Check whether an accuracy is within reach of memory and of the layers at singular edges."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from fem3d.spaces.size import Size
from meshes import grading
from meshes import grid as grids
from meshes.grading import Features
from meshes.grid import Grid
from scenes.errors import NumericsError, TooLargeError
from scenes.free.grid import crowding
from scenes.model import Scene

ADVICE = "ask for a larger accuracy, let more planes coincide, or leave out what does not matter"
COARSEST = 1e-2  # accuracy from which on a first grid has the fewest layers, and of rough solutions
HARDLY = 0.25  # exponent below which edges need more layers than fit above rounding
LAYER = 0.1  # layers shorter than this fraction of the narrowest length of a scene see their edge alone
_CGROUPS = Path("/sys/fs/cgroup")


def first_grid(scene: Scene, accuracy: float, marks: Features) -> Grid:
    """Return the grid to begin with.

    It is made for a larger accuracy where an edge is so singular that its layers would come close to rounding.
    """
    if marks.sharpest <= HARDLY:
        # The accuracy of a first layer of this length.
        accuracy = max(accuracy, LAYER ** (2 * marks.sharpest) / grading.LAYERS)
    return grading.first_grid(scene, accuracy, marks)


def fits(scene: Scene, size: Size) -> bool:
    """Return whether memory has room for a mesh."""
    return size.memory <= limit(scene)


def check(scene: Scene, size: Size, when: str, why: str = "") -> None:
    """Raise TooLargeError for a grid of bricks that takes too much memory."""
    if not fits(scene, size):
        unknowns, planes = float(f"{size.unknowns:.2g}"), grids.graph(scene).planes
        raise TooLargeError(
            f"the scene takes {unknowns:,.0f} unknowns and {size.memory / 1e9:.3g} GB {when}, and "
            f"{allowed(scene)}{why}; {crowding(planes)}: let more coincide, or leave out what does not "
            "matter"
        )


def check_edges(grid: Grid, marks: Features, goals: Iterable[np.ndarray], accuracy: float) -> None:
    """Raise NumericsError where edges put an accuracy out of reach.

    The error at an edge of exponent s is proportional to the length of its layer to the power 2 s, whatever else is
    refined. So the shortest possible layers leave a fixed part of the indicators of layers that see their edge alone.
    """
    planes = [sorted({*inner, b[0], b[-1]}) for inner, b in zip(marks.planes, grid.breaks, strict=True)]
    longest, parts = LAYER * min(float(np.diff(each).min()) for each in planes), []
    for breaks, near in zip(grid.breaks, marks.near(grid), strict=True):
        s, lengths = np.minimum(near[:-1], near[1:]), np.diff(breaks)
        shrinks = np.minimum(grading.shortest_of(grid) / lengths, 1.0)
        parts.append(np.where(lengths < longest, shrinks ** (2 * s), 0.0))
    kept = [sum(float(i @ part) for i, part in zip(grid.by_interval(g), parts, strict=True)) for g in goals]
    # Solved random scenes keep no more; with only a tenth for all other errors cells would grow without end.
    if max(kept) > 0.75 * accuracy:
        raise not_reached(accuracy, because(marks))


def not_reached(accuracy: float, because: str = "") -> NumericsError:
    """Return the error to raise where no level is accurate enough."""
    return NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene{because}")


def because(marks: Features) -> str:
    """Return the words that name an edge too singular for any grid; empty without such an edge."""
    planes = [(s, "xyz"[d], at) for d in range(3) for at, s in marks.exponents[d].items()]
    sharpest, axis, at = min(planes, default=(1.0, "", 0.0))
    if sharpest > HARDLY:
        return ""
    return (
        f": at {axis} = {at:.4g} m a given value ends, or good conductors meet along an edge only, and the solution "
        f"behaves as a distance to the power {sharpest:.2f} there; ask for a larger accuracy, or let them end elsewhere"
    )


def limit(scene: Any) -> float:
    """Return the bytes that a run of a scene may take in all."""
    words = _words(Path("/proc/self/statm"))
    resident = float(words[1]) * os.sysconf("SC_PAGE_SIZE") if len(words) > 1 else 0.0  # of this process, where known
    # Sizes are foreseen to within 30 %, and other programs need some.
    return float(scene.memory or 0.8 * (free() + resident))


def allowed(scene: Any) -> str:
    """Return the limit in words, for a message."""
    size = f"{limit(scene) / 1e9:.2g} GB"
    return f"run.memory allows {size}" if scene.memory else f"this machine has {size} to spare"


def free() -> float:
    """Return the bytes that are free for new memory on this machine and in the control groups of this process, of
    version 1 or 2."""
    room = [_free_of_machine()]
    inside = [Path(word.rpartition(":")[2].lstrip("/")) for word in _words(Path("/proc/self/cgroup"))]
    places = {Path(), *inside, *(parent for group in inside for parent in group.parents)}
    names = ("memory.max", "memory.current"), ("memory.limit_in_bytes", "memory.usage_in_bytes")
    for group in (root / place for root in (_CGROUPS, _CGROUPS / "memory") for place in places):
        parts = _words(group / "memory.stat")
        for bound, taken in ((_words(group / most), _words(group / used)) for most, used in names if parts):
            if bound and taken and bound[0].isdigit():
                # Pages of files that can be dropped count as taken, and are free.
                cache = float(parts[parts.index("inactive_file") + 1]) if "inactive_file" in parts else 0.0
                room.append(float(bound[0]) - float(taken[0]) + cache)
    return max(min(room), 0.0)


def _free_of_machine() -> float:
    words = _words(Path("/proc/meminfo"))
    if "MemAvailable:" in words:
        return 1024.0 * float(words[words.index("MemAvailable:") + 1])
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")) / 2
    except (AttributeError, OSError, ValueError):
        return 4e9  # the operating system does not say


def _words(file: Path) -> list[str]:
    try:
        return file.read_text(encoding="utf-8").split()
    except (OSError, UnicodeDecodeError):
        return []
