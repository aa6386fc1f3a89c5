"""The terminal: exit statuses, printing, progress, and what it can show."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from scenes.errors import printable

if TYPE_CHECKING:
    from compare.table import Style

FINE, DIFFERS, BAD_INPUT, NUMERICS, INTERRUPTED = 0, 1, 2, 3, 130


class Progress:
    """Says on a terminal's last line what is being done, and clears it at the end; says nothing elsewhere."""

    def __enter__(self) -> Callable[[str], None]:
        self._shown = sys.stderr.isatty()
        return self._say if self._shown else lambda _: None

    def __exit__(self, *_: object) -> None:
        if self._shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def _say(self, text: str) -> None:
        print(f"\r\x1b[K{printable(text, 78)}", end="", file=sys.stderr, flush=True)


def complain(sentence: str, status: int) -> int:
    """Prints one sentence on standard error and returns the status."""
    with contextlib.suppress(OSError, ValueError):
        print(f"validate: {' '.join(sentence.split())}", file=sys.stderr)
    return status


def show(text: str) -> None:
    """Prints, and doesn't mind a reader that has had enough (`| head`)."""
    try:
        print(text.encode(_encoding(), "replace").decode(_encoding()), flush=True)
    except BrokenPipeError:
        # Python flushes standard output once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def style() -> Style:
    """As the terminal can show it: colours unless it is none or NO_COLOR is set, signs where its encoding has them."""
    from compare.table import Style

    colour = sys.stdout.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    try:
        "±✓✗".encode(_encoding())
    except UnicodeEncodeError:
        return Style(colour, ascii_only=True)
    return Style(colour)


def _encoding() -> str:
    return sys.stdout.encoding or "utf-8"
