"""The terminal: exit statuses, printing, progress, colours and signs."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread
from typing import TYPE_CHECKING

from scenes.errors import SceneError, columns, printable, reason

if TYPE_CHECKING:
    from compare.report import Style

FINE, DIFFERS, BAD_INPUT, NUMERICS, INTERRUPTED = 0, 1, 2, 3, 130  # Exit statuses.
_SLOW = 2.0  # Seconds from which on progress is shown with the time spent.
_EVERY = 10.0  # Seconds between lines of progress in a file or a pipe.


@contextmanager
def progress(quiet: bool = False) -> Iterator[Callable[[str], None]]:
    """Yield a function that shows the current step.

    On a terminal it is the last line, with the time from two seconds on, cleared at the end; elsewhere a line every ten
    seconds. Nothing is shown if ``quiet``."""
    if quiet:
        yield lambda _: None
        return
    start, said, done, shown = time.monotonic(), "", Event(), sys.stderr.isatty()

    def draw() -> None:
        spent = time.monotonic() - start
        since = f" ({spent:.0f} s)" if said and spent >= _SLOW else ""
        # A line that the terminal breaks could not be cleared.
        line = printable(said, columns(sys.stderr, 80) - len(since) - 1) + since
        with suppress(OSError, ValueError):
            print(f"\r\x1b[K{line}" if shown else line, end="" if shown else "\n", file=sys.stderr, flush=True)

    def say(text: str) -> None:
        nonlocal said
        said = text
        if shown:
            draw()

    def tick() -> None:
        while not done.wait(0.5 if shown else _EVERY):
            if said and time.monotonic() - start >= _SLOW:
                draw()

    ticker = Thread(target=tick, daemon=True)
    ticker.start()
    try:
        yield say
    finally:
        done.set()
        ticker.join()
        if shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def fill_streams() -> None:
    """Opens the standard streams that this process was started without (`>&-`) on nothing, in place of the next files
    to be opened, into which a library's words would go."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            # The lowest free descriptor is the stream's, as all below are open.
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115 - open until the end


def complain(sentence: str, status: int) -> int:
    with suppress(OSError, ValueError):
        print(f"validate: {' '.join(sentence.split())}", file=sys.stderr)
    return status


def show(text: str) -> None:
    """Prints, and doesn't mind a reader that has had enough (`| head`)."""
    encoding = sys.stdout.encoding or "utf-8"
    try:
        print(text.encode(encoding, "replace").decode(encoding), flush=True)
    except BrokenPipeError:
        # Python flushes standard output once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        raise SceneError(f"standard output cannot be written ({reason(error)})") from None


def style() -> Style:
    """As the terminal can show it: colours unless it is none or NO_COLOR is set, signs where its encoding has them."""
    from compare.report import Style

    colour = sys.stdout.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    try:
        "±✓✗".encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        return Style(colour, ascii_only=True)
    return Style(colour)
