"""Header rows whose names hold spaces and commas: taken apart by whichever way gives as many as there are columns."""

from __future__ import annotations

import csv
import re

_SPACED = (
    r"\t+|\s{2,}",
    # Each name but the first starts after what closes the one before, a unit or a place.
    r"(?<=[)\]])\s+(?=[A-Za-z])",
    # Each name but the first stands before a unit.
    r"\s+(?=\S+ [(\[])",
    r"\s+",
)


def names(line: str, count: int, separator: str | None) -> list[str] | None:
    """The names in a header row above rows whose cells are apart by ``separator`` (``None`` is any blank space);
    ``None`` where no way of reading it gives ``count`` of them."""
    bare = line.strip()
    if separator is None:
        ways = [[name.strip('"') for name in re.split(pattern, bare)] for pattern in _SPACED]
    else:
        ways = [[name.strip() for name in next(csv.reader([bare], delimiter=separator, skipinitialspace=True))]]
        if separator == ",":
            # Inside a name without quotes a comma is followed by a space.
            ways.append([name.strip('"') for name in re.split(r",(?! )", bare)])
    return next((found for found in ways if len(found) == count), None)
