"""What distinguishes a sink from the built-in one, in a few words that are safe in the name of a folder."""

from __future__ import annotations

import re
import zlib
from operator import attrgetter

from scenes.keys import SINK
from scenes.kinds import Quantity
from scenes.sink import Sink

_LONGEST = 80


def distinguishes(sink: Sink) -> str:
    """The voltage, then every key that differs from its default: "1V", "2V-width20um", "1V-pad-edge".

    Different sinks get different texts, but for their name and checks, which are left out. A text longer than 80
    characters ends in a checksum of the whole instead. The values are taken as valid (``scenes.validity.check``).
    """
    default = Sink()
    words: list[str] = []
    for path, key in SINK.paths.items():
        value = attrgetter(key.attribute)(sink)
        section, _, name = path.rpartition(".")
        if section in ("scene", "checks"):
            continue
        if path == "drive.voltage":
            words.insert(0, _safe(key.kind.show(value)))
        elif value != attrgetter(key.attribute)(default):
            owner = section.removeprefix("materials.") + "_" if section.startswith("materials.") else ""
            label = f"{owner}{name}" if isinstance(key.kind, Quantity) else ""
            words.append(label + _safe(key.kind.show(value)))
    slug = "-".join(words)
    if len(slug) > _LONGEST:
        slug = f"{slug[: _LONGEST - 9].rstrip('-.')}-{zlib.crc32(slug.encode()):08x}"
    return slug


def _safe(shown: str) -> str:
    """Without the spaces and signs of compound units: a number, and "20um" where the unit is one word."""
    number, _, unit = shown.partition(" ")
    signed = re.sub("^-", "minus", number)
    return re.sub(r"[^\w.+-]", "", signed + (unit if unit.isalpha() else ""))
