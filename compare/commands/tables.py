"""What the commands that print a table of cases have in common."""

from __future__ import annotations

from pathlib import Path

from scenes.errors import SceneError, quoted, reason


def jobs(given: str | None) -> int:
    """How many processes to use; SceneError for what is no positive number."""
    from compare.verification.run import processors

    if given is None:
        return processors()
    if not given.isascii() or not given.isdigit() or not 0 < int(given) <= 256:
        raise SceneError(f"--jobs is {quoted(given)}: give a whole number from 1 to 256")
    return int(given)


def write_page(path: str, page: str) -> None:
    """Writes a page of markdown; SceneError where that can't be done."""
    try:
        Path(path).write_text(page.rstrip("\n") + "\n", encoding="utf-8")
    except OSError as error:
        raise SceneError(f"--markdown {quoted(path)} can't be written: {reason(error)}") from None
