"""Errors of scenes that cannot be solved, words for messages, and files of users that are read within bounds."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from math import floor, log10
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import Any, TextIO

_LONGEST = 60  # Characters of a user's text that a message repeats at most.
_LONGEST_REASON = 200  # Characters of another library's message that a message repeats at most.
_MOST, _MOST_KNOWN = 4, 12  # Names that a list in a message has at most, and a list of valid names.
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_DEEP = re.compile(rf"(?<![\w-])(?:{_PART}[ \t]*+\.[ \t]*+){{32}}")
"""A TOML key of over 32 parts. Scenes have four; the standard library's parser takes memory that grows with the square
of their number, 9.6 GB for 50,000."""


class SceneError(ValueError):
    """Bad input: the message is one line with the key, the value and the allowed values."""


class NumericsError(ArithmeticError):
    """Failed numerics; the message gives the reason."""


class TooLargeError(NumericsError):
    """A mesh would take more memory than may be taken."""


class RunawayError(NumericsError):
    """Thermal runaway: the heating grows with temperature faster than the losses.

    No steady state below 100,000 K is found above the ``limit``: a voltage (V), for a given current a current (A), else
    a fraction of the heating. ``whole`` is the drive itself in the same ``unit``. ``error`` estimates the error of the
    limit: 0 if unknown, infinite if a finer mesh may have states above. ``named`` is the limit in words, or "".
    """

    def __init__(self, message: str, limit: float, named: str = "", unit: str = "", whole: float = 1.0) -> None:
        super().__init__(message)
        self.limit, self.whole, self.error, self._named, self.unit = limit, whole, 0.0, named, unit

    @property
    def largest(self) -> str:
        """A sentence on the limit, or ""."""
        if not self._named:
            return ""
        shown = f"{self.limit:.4g}"
        if self.error:
            places = max(1 - floor(log10(self.error)), 0)  # the error has two digits
            shown = f"{self.limit:.{places}f} ± {self.error:.{places}f}"
        return f"{self._named} is {shown} {self.unit}".rstrip()

    def __str__(self) -> str:
        return "; ".join(filter(None, (super().__str__(), self.largest)))


class RunawayInTimeError(RunawayError):
    """A transient without a solution from some ``time`` (s) on: the heating grows beyond all bounds, or a resistivity
    reaches zero. An unknown ``limit`` is infinite."""

    def __init__(self, message: str, time: float, limit: float = float("inf")) -> None:
        super().__init__(message, limit)
        self.time = time


class BeyondLawError(NumericsError):
    """A state, over time from some ``time`` (s) on, at which a linear resistivity is not positive, perhaps because the
    discrete field overshoots on a coarse mesh."""

    def __init__(self, time: float = 0.0) -> None:
        super().__init__(
            "a temperature coefficient makes the resistivity zero or less at the temperatures that are reached: give "
            "the resistivity there as a table, or by an exponent"
        )
        self.time = time


def quoted(value: object) -> str:
    """Return a value as a person would type it, on one line and of bounded length; a path may be longer."""
    if isinstance(value, Path):
        return f'"{printable(str(value), _LONGEST_REASON)}"'
    if isinstance(value, str):
        return f'"{printable(value)}"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return printable("{" + ", ".join(f"{key} = {quoted(item)}" for key, item in value.items()) + "}")
    if isinstance(value, list | tuple):
        return printable("[" + ", ".join(map(quoted, value)) + "]")
    return printable(str(value))


def reason(error: Exception) -> str:
    """Return the message of another library's error, on one line."""
    said = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return printable(said, _LONGEST_REASON)


def printable(text: str, longest: int = _LONGEST) -> str:
    """Return the text on one line, safe for a terminal, cut to a bounded length."""
    safe = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return safe if len(safe) <= longest else safe[: longest - 3] + "..."


def columns(stream: TextIO, most: int) -> int:
    """Return the columns of a stream's terminal, from 20 to ``most``; ``most`` without a terminal."""
    try:
        return max(min(os.get_terminal_size(stream.fileno()).columns or most, most), 20)
    except (OSError, ValueError, AttributeError):
        return most


def did_you_mean(word: object, known: Iterable[str]) -> str:
    """Return the end of a message, ', did you mean "..."?', with the known word that is nearest in spelling, or ""."""
    import difflib

    by_case = {k.lower(): k for k in known}
    near = difflib.get_close_matches(str(word).lower(), by_case, n=1)
    return f', did you mean "{printable(by_case[near[0]], _LONGEST_REASON)}"?' if near else ""


def unknown(said: str, name: object, known: Iterable[str]) -> SceneError:
    """Return the error for an unknown name, with the first of the valid names and the nearest one."""
    names = list(known)
    shown = [*map(quoted, names[:_MOST_KNOWN]), *["..."] * (len(names) > _MOST_KNOWN)]
    give = f"give {', '.join(shown)}" if shown else "there is none to give"
    return SceneError(f"{said} {quoted(name)}: {give}{did_you_mean(name, names)}")


def listed(names: Sequence[str], most: int = _MOST) -> str:
    """Return names in quotation marks, at most four by default."""
    shown = [quoted(name) for name in names[:most]]
    if len(names) > most:
        shown.append(f"{len(names) - most} more")
    return " and ".join(filter(None, (", ".join(shown[:-1]), shown[-1])))


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
    """Parse a TOML text. Raises ValueError, RecursionError; SceneError for keys of over 32 parts."""
    if deep := _DEEP.search(text):
        line = text.count("\n", 0, deep.start()) + 1
        raise SceneError(f"line {line} has more than 32 names joined by dots: no key of a scene is that long")
    return tomllib.loads(text)
