"""Tables of markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

Lines = list[str]


def table(head: Sequence[str], body: Iterable[Sequence[str]]) -> Lines:
    """The lines of a table, and an empty one after it."""
    rule = "|".join(["---"] * len(head))
    return [f"| {' | '.join(head)} |", f"|{rule}|", *(f"| {' | '.join(row)} |" for row in body), ""]
