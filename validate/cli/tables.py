"""What the commands that print a table of cases have in common."""

from __future__ import annotations

from pathlib import Path

from scenes.errors import SceneError, quoted, reason


def jobs(given: str | None) -> int:
    """How many processes to use; SceneError for what is no positive number."""
    from validate.verify.cases import processors

    return processors() if given is None else whole("--jobs", given, 1, 256)


def whole(option: str, given: str, least: int, most: int) -> int:
    """A whole number that was given; SceneError for what is none, or out of range."""
    if not given.isascii() or not given.isdigit() or not least <= int(given) <= most:
        raise SceneError(f"{option} is {quoted(given)}: give a whole number from {least} to {most}")
    return int(given)


def write_page(path: str, page: str) -> None:
    """Writes a page of markdown; SceneError where that can't be done."""
    try:
        Path(path).write_text(page.rstrip("\n") + "\n", encoding="utf-8")
    except OSError as error:
        raise SceneError(f"--markdown {quoted(path)} can't be written: {reason(error)}") from None
