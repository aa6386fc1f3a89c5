"""What distinguishes a scene from the built-in one, in a few words that are safe in the name of a folder."""

from __future__ import annotations

import re
import zlib
from operator import attrgetter

from scenes.keys import type_of
from scenes.kinds import Choice

_LONGEST = 80


def distinguishes(scene: object) -> str:
    """The leading key (a sink's voltage, a device's final outer temperature), then every key that differs from its
    default: "1V", "2V-width20um", "1V-pad-edge", "273K".

    Different scenes get different texts, but for their name and checks, which are left out. A text longer than 80
    characters ends in a checksum of the whole instead. The values are taken as valid (``scenes.validity.check``).
    """
    kind = type_of(scene)
    words: list[str] = []
    for path, key in kind.schema.paths.items():
        value = attrgetter(key.attribute)(scene)
        section, _, name = path.rpartition(".")
        if section in ("scene", "checks"):
            continue
        if path == kind.leading:
            words.insert(0, _safe(key.kind.show(value)))
        elif value != attrgetter(key.attribute)(kind.default):
            owner = section.removeprefix("materials.") + "_" if section.startswith("materials.") else ""
            label = "" if isinstance(key.kind, Choice) else f"{owner}{name}"
            words.append(label + _safe(key.kind.show(value)))
    return shortened("-".join(words))


def shortened(text: str) -> str:
    """A text of at most 80 characters: a longer one ends in a checksum of the whole."""
    if len(text) <= _LONGEST:
        return text
    return f"{text[: _LONGEST - 9].rstrip('-.')}-{zlib.crc32(text.encode()):08x}"


def _safe(shown: str) -> str:
    """Without the spaces and signs of compound units: a number, and "20um" where the unit is one word."""
    number, _, unit = shown.partition(" ")
    signed = re.sub("^-", "minus", number)
    return re.sub(r"[^\w.+-]", "", signed + (unit if unit.isalpha() else ""))
