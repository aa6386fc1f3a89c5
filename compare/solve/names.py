"""The default results folder of a free scene: its name, and what overrides have made of it."""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence
from pathlib import Path

from scenes.free.asks import AnyScene

_LONGEST = 80


def results_folder(scene: AnyScene, settings: Sequence[str]) -> Path:
    """ "results/bridge", or with an override "results/bridge-left-electrode.voltage2"."""
    words = [scene.name]
    for setting in settings:
        key, _, value = setting.partition("=")
        if value.strip() == "true":
            value = ""  # "results/hotplate-steady"
        short = key.strip().partition(".")[2] or key
        words.append(re.sub(r"[^\w.+-]", "", re.sub(r"\s+", "-", short.strip()) + re.sub("^-", "minus", value.strip())))
    slug = "-".join(words)
    if len(slug) > _LONGEST:
        slug = f"{slug[: _LONGEST - 9].rstrip('-.')}-{zlib.crc32(slug.encode()):08x}"
    return Path("results") / slug
