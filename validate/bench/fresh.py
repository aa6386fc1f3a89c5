"""A solve that is timed again must not find what an earlier one has worked out on the same scene."""

from __future__ import annotations

from meshes import connected, singular

# What is kept of scenes. Tables of reference elements serve every scene, and other programs keep theirs too.
KEPT = (connected.coarsest, connected.anchored, connected._electrified, singular.exponent)


def forget() -> None:
    """Empty the caches of what belongs to a scene."""
    for cache in KEPT:
        cache.cache_clear()
