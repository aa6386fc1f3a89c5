"""Columns of numbers: a name, the unit that stands with the name, and the values."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from scenes.units import TIME, Powers, UnitError, parse_unit

_UNITS = (
    re.compile(r"(?:^|(?<=\s))\(([^()\[\]]{1,20})\)"),
    re.compile(r"\[([^()\[\]]{1,20})\]"),
    re.compile(r"\(([^()\[\]]{1,20})\)"),
    re.compile(r"(?<!\s)\s*+/\s*+([^\s/()\[\]]{1,20})$"),
    re.compile(r"_([^\W_]{1,20})$"),
)
"""The unit in a header, surest place first: "maxop1(T) (K)", "peak [K]", "T(K)", "T / K", "peak_K"."""
_NAMES = {"second": "s", "sec": "s", "volt": "V", "ampere": "A", "amp": "A", "watt": "W", "kelvin": "K", "ohm": "ohm"}
_PREFIXES = {"": "", "milli": "m", "micro": "u", "nano": "n", "m": "m", "u": "u"}
_CELSIUS = ("c", "oc", "degc", "deg c", "celsius", "deg celsius", "degrees celsius", "degree celsius")
_WORDS = {
    f"{prefix}{name}{plural}": f"{sign}{unit}"
    for prefix, sign in _PREFIXES.items() for name, unit in _NAMES.items() for plural in ("", "s")
} | dict.fromkeys(("mins", "minute", "minutes"), "min") | dict.fromkeys(_CELSIUS, "degC") | {"s": "s"}  # fmt: skip
"""Units in words, as instruments write them in any case: "second", "Volts", "millisec", "S"."""
_MISSING = {"", "nan", "-nan", "na", "n/a", "null", "none", "-", "--", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind"}
SHEET_ERROR = re.compile(r"#(N/?[AV]\b|[^\W\d_/]+(/0)?[!?])")
_VECTOR = re.compile(r"(v|i\w{0,2})\([^()]*\)$|.*#branch$|@.*\[\w+\]$", re.IGNORECASE)


@dataclass(frozen=True)
class Scale:
    """A unit of a column: SI base units with their ``powers``, the ``factor`` to SI and the ``offset`` of degC."""

    powers: Powers
    factor: float
    offset: float = 0.0

    def to_si(self, values: np.ndarray) -> np.ndarray:
        """Convert numbers to SI; temperatures are absolute."""
        return values * self.factor + self.offset


@dataclass(frozen=True)
class Column:
    """One column of a file.

    ``unit`` is the text of its unit ("" for none), ``values`` (rows,) has NaN in empty cells, ``spice`` says that the
    column is of a circuit, where volts may stand for kelvins.
    """

    name: str
    unit: str
    values: np.ndarray
    spice: bool = False


@dataclass(frozen=True)
class Table:
    """The columns of a file and its ``kind`` in words; ``unnamed`` where the file has no names of columns."""

    kind: str
    columns: tuple[Column, ...]
    unnamed: bool = False
    notes: tuple[str, ...] = ()


def parse_number(cell: str, mark: str = ".") -> float:
    """The number of a cell, NaN for a missing one; ValueError for a text. Fortran writes 1.0D-06."""
    if cell.lower() in _MISSING or SHEET_ERROR.fullmatch(cell):
        return np.nan
    if "_" in cell or (mark == "," and "." in cell):
        raise ValueError(cell)
    return float(cell.replace(mark, ".").replace("D", "E").replace("d", "e"))


def scale_of(text: str) -> Scale | None:
    """Look up the unit of a text such as "ms", "degC", "Volt" or "min"; ``None`` where the text is no unit."""
    spelled = " ".join(text.replace("°", "deg").replace("\N{MASCULINE ORDINAL INDICATOR}", "deg").split())
    if not spelled or spelled[0].isdigit():
        return None
    try:
        unit = parse_unit(_WORDS.get(spelled.lower(), spelled))
    except UnitError:
        return None
    return Scale(unit.powers, float(unit.factor), 273.15 if unit.celsius else 0.0)


def split_unit(header: str) -> tuple[str, str]:
    """Split a header into the name and the unit, "" where the header has no unit."""
    for place in _UNITS:
        for match in place.finditer(header):
            name = " ".join(f"{header[: match.start()]} {header[match.end() :]}".split())
            minimum = place is _UNITS[-1] and match.group(1).lower() == "min" and not is_clock(name)
            if scale_of(match.group(1)) is not None and not minimum:
                return name, match.group(1).strip()
    return header, ""


def make_column(header: str, values: np.ndarray, unit: str = "") -> Column:
    """Make a column from a header: "Temperature (degC), Point 1", "peak [K]", "V(mid)"."""
    name = " ".join(header.split())
    spice = _VECTOR.match(name) is not None
    if spice and not unit:
        unit = "V" if name[0] in "vV" else "A"
    return Column(name, unit or split_unit(name)[1], values, spice)


def is_time(column: Column) -> bool:
    """Whether a column has a unit of time and the name of one."""
    return has_time(column) and is_clock(column.name)


def has_time(column: Column) -> bool:
    """Whether a column has a unit of time."""
    scale = scale_of(column.unit)
    return scale is not None and scale.powers == TIME.powers


def is_clock(name: str) -> bool:
    """Whether a name is one of the time."""
    words = re.findall(r"[^\W\d_]+", name.lower())
    return bool({"time", "zeit"} & set(words)) or words[:1] == ["t"]
