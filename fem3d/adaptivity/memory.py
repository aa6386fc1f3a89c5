"""Limit of the memory of a run: the memory that the machine, or the container, has free, or the scene's run.memory."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

SHARE = 0.8  # of the free memory that a run may take: sizes are foreseen to within 30 %, and other programs need some
UNKNOWN = 4e9  # bytes that are assumed free where the operating system does not say
_CGROUPS = Path("/sys/fs/cgroup")


def limit(scene: Any) -> float:
    """Return the bytes that a run of a scene may take in all."""
    return float(scene.memory or SHARE * (free() + resident()))


def allowed(scene: Any) -> str:
    """Return the limit in words, for a message."""
    size = f"{limit(scene) / 1e9:.2g} GB"
    return f"run.memory allows {size}" if scene.memory else f"this machine has {size} to spare"


def free() -> float:
    """Return the bytes that are free for new memory on this machine and in its control groups."""
    return max(min(_free_of_machine(), _free_of_groups()), 0.0)


def resident() -> float:
    """Return the bytes that this process has in memory; 0 where unknown."""
    words = _words(Path("/proc/self/statm"))
    return float(words[1]) * os.sysconf("SC_PAGE_SIZE") if len(words) > 1 else 0.0


def _free_of_machine() -> float:
    words = _words(Path("/proc/meminfo"))
    if "MemAvailable:" in words:
        return 1024.0 * float(words[words.index("MemAvailable:") + 1])
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")) / 2
    except (AttributeError, OSError, ValueError):
        return UNKNOWN


def _free_of_groups() -> float:
    """Return the least room of the control groups that this process is in, version 1 or 2; infinite without a limit."""
    groups = [_CGROUPS / "memory"]
    for word in _words(Path("/proc/self/cgroup")):
        inside = Path(word.rpartition(":")[2].lstrip("/"))
        groups += [root / at for root in (_CGROUPS, _CGROUPS / "memory") for at in (inside, *inside.parents)]
    room = [float("inf")]
    for group in dict.fromkeys(groups):
        for most, used in (("memory.max", "memory.current"), ("memory.limit_in_bytes", "memory.usage_in_bytes")):
            bound, taken, parts = _words(group / most), _words(group / used), _words(group / "memory.stat")
            if bound and taken and bound[0].isdigit():
                # Pages of files that can be dropped count as taken, and are free.
                cache = float(parts[parts.index("inactive_file") + 1]) if "inactive_file" in parts else 0.0
                room.append(float(bound[0]) - float(taken[0]) + cache)
    return min(room)


def _words(file: Path) -> list[str]:
    try:
        return file.read_text(encoding="utf-8").split()
    except (OSError, UnicodeDecodeError):
        return []
