"""The free scenes that come with the toolkit, to copy and edit."""

from __future__ import annotations

from functools import cache
from pathlib import Path

FOLDER = Path(__file__).parent


@cache
def names() -> tuple[str, ...]:
    """Their names."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def text(name: str) -> str:
    """One of them as commented TOML."""
    return (FOLDER / f"{name}.toml").read_text(encoding="utf-8")
