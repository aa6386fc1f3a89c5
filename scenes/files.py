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
    """Refuses, ``called`` so in the message, a pipe, a device or a socket, of which nobody knows when it ends. Raises
    SceneError, and OSError where there is nothing of that name."""
    mode = path.stat().st_mode
    if not (S_ISREG(mode) or S_ISDIR(mode)):
        raise SceneError(f"{called} is a pipe or a device: save what it holds as a file, and give that")


def contents(path: Path, most: int, called: str, instead: str) -> bytes:
    """The bytes of a file. Raises SceneError, with what to give ``instead``, for one of more than ``most`` MB and for
    what is no file; OSError where it cannot be read."""
    check_regular(path, called)
    with path.open("rb") as file:
        data = file.read(most * 1_000_000 + 1)
    if len(data) > most * 1_000_000:
        raise SceneError(f"{called} is larger than {most} MB: {instead}")
    return data


def parsed(text: str) -> dict[str, Any]:
    """The document of a TOML text. ValueError, RecursionError; SceneError for keys of over `DEEPEST` parts."""
    if deep := _DEEP.search(text):
        line = text.count("\n", 0, deep.start()) + 1
        raise SceneError(f"line {line} has more than {DEEPEST} names joined by dots: no key of a scene is that long")
    return tomllib.loads(text)
