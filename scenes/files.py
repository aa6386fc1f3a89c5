"""Reading files that users name so that none exhausts the machine: real files, of bounded size and TOML depth."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import Any

from scenes.errors import SceneError

DEEPEST = 32
"""Parts of a TOML key at most. Scenes have four; the standard library's parser takes memory that grows with the square
of their number, 9.6 GB for 50,000."""
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_DEEP = re.compile(rf"(?<![\w-])(?:{_PART}[ \t]*+\.[ \t]*+){{{DEEPEST}}}")


def check_regular(path: Path, called: str) -> None:
    """Refuse a pipe, a device or a socket, ``called`` so in the message.

    Raises SceneError, and OSError for a missing file.
    """
    mode = path.stat().st_mode
    if not (S_ISREG(mode) or S_ISDIR(mode)):
        raise SceneError(f"{called} is a pipe or a device: save what it holds as a file, and give that")


def contents(path: Path, most: int, called: str, instead: str) -> bytes:
    """Return the bytes of a file.

    Raises SceneError for a file above ``most`` MB, with the advice ``instead``, or for no regular file; OSError where
    reading fails.
    """
    check_regular(path, called)
    with path.open("rb") as file:
        data = file.read(most * 1_000_000 + 1)
    if len(data) > most * 1_000_000:
        raise SceneError(f"{called} is larger than {most} MB: {instead}")
    return data


def parsed(text: str) -> dict[str, Any]:
    """Parse a TOML text. Raises ValueError, RecursionError; SceneError for keys of over `DEEPEST` parts."""
    if deep := _DEEP.search(text):
        line = text.count("\n", 0, deep.start()) + 1
        raise SceneError(f"line {line} has more than {DEEPEST} names joined by dots: no key of a scene is that long")
    return tomllib.loads(text)
