"""A solve that is timed again must not find what an earlier one has worked out on the same scene."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

PACKAGES = ("fem3d", "meshes", "scenes")
# Tables of reference elements and rules of integration: they serve every scene, and other programs keep theirs too.
TABLES = (
    "meshes.axis.reference", "meshes.singular._angular", "fem3d.exponential", "fem3d.section", "fem3d.unstructured",
    "meshes.grouped",
)  # fmt: skip


def forget() -> None:
    """Empty every cache of this toolkit's solver but those of TABLES."""
    for cache in kept():
        cache.cache_clear()


def kept() -> Iterator[Any]:
    """The caches, of modules imported so far, that hold something of a scene or a mesh."""
    seen = set()
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] not in PACKAGES:
            continue
        for value in list(vars(module).values()):
            if not callable(getattr(value, "cache_clear", None)) or id(value) in seen:
                continue
            seen.add(id(value))
            if not f"{value.__module__}.{value.__qualname__}".startswith(TABLES):
                yield value
