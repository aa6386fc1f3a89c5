"""The terminal: exit statuses, printing, progress, and what it can show."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Callable
from threading import Event, Thread
from typing import TYPE_CHECKING

from scenes.errors import printable

if TYPE_CHECKING:
    from validate.report.table import Style

FINE, DIFFERS, BAD_INPUT, NUMERICS, INTERRUPTED = 0, 1, 2, 3, 130
_SLOW = 2.0
"""Seconds from which on it is said how long something takes."""


class Progress:
    """Says on a terminal's last line what is being done, and from two seconds on for how long; clears it at the end.

    Says nothing elsewhere, nor where it is to be ``quiet``.
    """

    def __init__(self, quiet: bool = False) -> None:
        self._shown = not quiet and sys.stderr.isatty()
        self._text, self._start = "", 0.0
        self._done = Event()
        self._ticker: Thread | None = None

    def __enter__(self) -> Callable[[str], None]:
        if not self._shown:
            return lambda _: None
        self._start = time.monotonic()
        self._ticker = Thread(target=self._tick, daemon=True)
        self._ticker.start()
        return self._say

    def __exit__(self, *_: object) -> None:
        self._done.set()
        if self._ticker is not None:
            self._ticker.join()
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def _say(self, text: str) -> None:
        self._text = text
        self._draw()

    def _draw(self) -> None:
        spent = time.monotonic() - self._start
        since = f" ({spent:.0f} s)" if spent >= _SLOW else ""
        print(f"\r\x1b[K{printable(self._text, 70)}{since}", end="", file=sys.stderr, flush=True)

    def _tick(self) -> None:
        while not self._done.wait(0.5):
            if time.monotonic() - self._start >= _SLOW:
                self._draw()


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
    from validate.report.table import Style

    colour = sys.stdout.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    try:
        "±✓✗".encode(_encoding())
    except UnicodeEncodeError:
        return Style(colour, ascii_only=True)
    return Style(colour)


def _encoding() -> str:
    return sys.stdout.encoding or "utf-8"
