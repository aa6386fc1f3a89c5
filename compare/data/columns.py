"""Columns of numbers: a name, the unit that stands with the name, and the values."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from scenes.errors import SceneError
from scenes.units import TIME, Powers, Unit, UnitError, parse_unit

ICE_POINT = 273.15  # K, of 0 degC: the definition of the degree Celsius

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
class Column:
    """One column of a file.

    Attributes
    ----------
    name : the header
    unit : the text of the unit, "" for none
    values : (rows,), NaN in empty cells
    spice : whether the column is of a circuit, where volts may stand for kelvins
    role : its meaning by `--column`: "time", "ignore", a quantity or a key of the scene; "" without
    kind : "rise" or "curve" where `--column` adds that word
    """

    name: str
    unit: str
    values: np.ndarray
    spice: bool = False
    role: str = ""
    kind: str = ""

    @property
    def powers(self) -> Powers | None:
        """The powers of SI base units of the unit, ``None`` for none or an unknown one."""
        unit = find_unit(self.unit)
        return None if unit is None else unit.powers

    @property
    def plain(self) -> str:
        """The name without the unit."""
        return split_unit(self.name)[0]

    @property
    def is_time(self) -> bool:
        """Whether the column has a unit of time and the name of one."""
        return self.powers == TIME.powers and is_clock(self.name)

    @property
    def is_celsius(self) -> bool:
        unit = find_unit(self.unit)
        return unit is not None and unit.celsius

    @property
    def si(self) -> np.ndarray:
        """(rows,): the values in SI units, temperatures absolute; numbers without a unit stay."""
        return self.differences + (ICE_POINT if self.is_celsius else 0.0)

    @property
    def differences(self) -> np.ndarray:
        """(rows,): the values in SI units as differences."""
        unit = find_unit(self.unit)
        return self.values if unit is None else self.values * float(unit.factor)

    def at(self, rows: np.ndarray) -> Column:
        """Return some rows of the column."""
        return replace(self, values=self.values[rows])


@contextmanager
def refusing(name: str) -> Iterator[None]:
    """Put the name of a file or an option before every SceneError."""
    try:
        yield
    except SceneError as error:
        raise SceneError(f"{name}: {error}") from None


def parse_number(cell: str, mark: str = ".") -> float:
    """Return the number of a cell, NaN for a missing one; ValueError for a text. Fortran writes 1.0D-06."""
    if cell.lower() in _MISSING or SHEET_ERROR.fullmatch(cell):
        return np.nan
    if "_" in cell or (mark == "," and "." in cell):
        raise ValueError(cell)
    return float(cell.replace(mark, ".").replace("D", "E").replace("d", "e"))


def find_unit(text: str) -> Unit | None:
    """Return the unit of a text such as "ms", "degC", "Volt" or "min"; ``None`` where the text is no unit."""
    spelled = " ".join(text.replace("°", "deg").replace("\N{MASCULINE ORDINAL INDICATOR}", "deg").split())
    if not spelled or spelled[0].isdigit():
        return None
    try:
        return parse_unit(_WORDS.get(spelled.lower(), spelled))
    except UnitError:
        return None


def split_unit(header: str) -> tuple[str, str]:
    """Split a header into the name and the unit, "" where the header has no unit."""
    for place in _UNITS:
        for match in place.finditer(header):
            name = " ".join(f"{header[: match.start()]} {header[match.end() :]}".split())
            minimum = place is _UNITS[-1] and match.group(1).lower() == "min" and not is_clock(name)
            if find_unit(match.group(1)) is not None and not minimum:
                return name, match.group(1).strip()
    return header, ""


def make_column(header: str, values: np.ndarray, unit: str = "") -> Column:
    """Return the column of a header: "Temperature (degC), Point 1", "peak [K]", "V(mid)"."""
    name = " ".join(header.split())
    spice = _VECTOR.match(name) is not None
    if spice and not unit:
        unit = "V" if name[0] in "vV" else "A"
    return Column(name, unit or split_unit(name)[1], values, spice)


def is_clock(name: str) -> bool:
    """Return whether a name is one of the time."""
    words = re.findall(r"[^\W\d_]+", name.lower())
    return bool({"time", "zeit"} & set(words)) or words[:1] == ["t"]
