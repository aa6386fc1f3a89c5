"""Columns of numbers: a name, the unit that stands with the name, and the values."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from scenes.errors import SceneError
from scenes.model import ROUNDING
from scenes.units import TEMPERATURE, TIME, WORDS, Powers, Unit, UnitError, parse_unit

_UNIT = re.compile(
    r"[(\[]([^()\[\]]{1,20})[)\]]|\s*+[/,]\s*+([^\s/,()\[\]]{1,20})$|_(?!min$)([^\W_]{1,20})$"
    r"|\sin\s+(\S.{0,19})$|\s((?:[°º˚℃]|deg) ?\w?)$"
)
"""A unit in a header: "maxop1(T) (K)", "peak [K]", "T / K", "T, K", "T_K", "T in K" or "T °C"; the last one counts."""
_MISSING = re.compile(r"|[-*?.]+|#?n/?a|-?1\.#(qnan|ind)|#[\w/]+[!?]", re.IGNORECASE)
"""Cells without a number, such as "", Fortran's "***", and a sheet's "#N/A" and "#DIV/0!"; `text` takes words so."""
_HOUR, _FAHRENHEIT = Unit(TIME.powers, Fraction(3600)), Unit(TEMPERATURE.powers, Fraction(5, 9), Fraction(45967, 180))
_OF_DATA = dict.fromkeys(("h", "hr", "hour", "hours", "std"), _HOUR) | dict.fromkeys(
    ("degf", "deg f", "°f"), _FAHRENHEIT
)
"""Units of data alone: in a scene "h" is many a height."""
_CLOCK = re.compile("(elapsed |relative |flow-)?time|zeit|temps|t|sec(ond)?s?|x_value", re.IGNORECASE)
_VECTOR = re.compile(r"(v|i\w{0,2})\([^()]*\)$|.*#branch$|@.*\[\w+\]$", re.IGNORECASE)


@dataclass(frozen=True)
class Column:
    """One column of a file.

    Attributes
    ----------
    name : the header
    unit : ``None`` without one
    values : (rows,), NaN in empty cells
    spice : whether the column is of a circuit, where volts may stand for kelvins
    called : the name that `--column` gives it, read in place of the header
    role : "time", "ignore", a quantity or a key of the scene; "" where its name is none of these
    note : how it was read where that is not plain
    """

    name: str
    unit: Unit | None
    values: np.ndarray
    spice: bool = False
    called: str = ""
    role: str = ""
    note: str = ""

    @property
    def plain(self) -> str:
        """The header without the unit."""
        return self.name if self.spice else split_unit(self.name)[0]

    @property
    def is_curve(self) -> bool:
        """Whether `--column` makes the column the abscissa of a curve."""
        return split_unit(self.called)[0].lower().endswith(" curve")

    @property
    def powers(self) -> Powers | None:
        """The powers of SI base units of the unit, ``None`` without a unit."""
        return None if self.unit is None else self.unit.powers

    @property
    def si(self) -> np.ndarray:
        """(rows,): the values in SI units, temperatures absolute; numbers without a unit stay."""
        return self.differences + (0.0 if self.unit is None else float(self.unit.offset))

    @property
    def differences(self) -> np.ndarray:
        """(rows,): the values in SI units as differences."""
        return self.values if self.unit is None else self.values * float(self.unit.factor)


@contextmanager
def refusing(name: str) -> Iterator[None]:
    """Put the name of a file or an option before every SceneError."""
    try:
        yield
    except SceneError as error:
        raise SceneError(f"{name}: {error}") from None


def parse_number(cell: str, mark: str = ".") -> float:
    """Return the number of a cell, NaN for a missing or infinite one (of SCPI from 9.9E37 on), infinity for a text."""
    if _MISSING.fullmatch(cell):
        return np.nan
    if "_" in cell or (mark == "," and "." in cell):
        return np.inf
    try:
        # Fortran writes 1.0D-06, COMSOL 293.15+0.0i, Graphtec "+   20.1".
        plain = cell.replace(mark, ".").replace("D", "E").replace("d", "e")
        plain = re.sub("^([-+]) +", r"\1", plain) if " " in plain else plain
        number = complex(plain.removesuffix("i") + "j" * plain.endswith("i"))
    except ValueError:
        return np.inf
    if abs(number.imag) > ROUNDING * abs(number.real):
        return np.inf
    return number.real if abs(number.real) < 9.9e37 else np.nan


def find_unit(text: str) -> Unit | None:
    """Return the unit of a text such as "ms", "degC" or "Volts"; ``None`` where the text is no unit."""
    text = re.sub("[º˚]", "°", text)
    word = text.strip().lower().replace(".", "")
    if not word or word[0].isdigit() or word in _OF_DATA:
        return _OF_DATA.get(word)
    with suppress(UnitError):
        return parse_unit(WORDS.get(word) or WORDS.get(word.removesuffix("s"), text))
    return None


def split_unit(header: str) -> tuple[str, Unit | None]:
    """Split a header into the name and the unit."""
    for match in reversed([*_UNIT.finditer(header)]):
        if unit := find_unit(match[match.lastindex or 0]):
            return " ".join(f"{header[: match.start()]} {header[match.end() :]}".split()), unit
    return header, None


def plain_name(name: str) -> str:
    """Return the name of a probe, a column, a node or a variable in small letters, without v( ), signs and blanks."""
    bare = re.sub(r"^[vi]\((.*)\)$", r"\1", name.strip().lower()).removesuffix("#branch")
    return re.sub(r"\W+", "_", bare)


def make_column(header: str, values: np.ndarray, unit: str = "") -> Column:
    """Return the column of a header: "Temperature (degC), Point 1", "peak [K]", "V(mid)"."""
    name = " ".join(header.split())
    if _VECTOR.match(name):
        return Column(name, find_unit(unit or ("V" if name[:2] in ("v(", "V(") else "A")), values, spice=True)
    if unit and find_unit(unit) is None:
        name += f" ({unit})"
    own = split_unit(name)[1]  # in brackets it counts before a row of units
    return Column(name, (own if name.endswith((")", "]")) else None) or find_unit(unit) or own, values)


def find_times(columns: Sequence[Column]) -> list[Column]:
    """Return the columns of times: by their names, else by a unit of time."""
    timed = [c for c in columns if c.powers in (None, TIME.powers) and not np.isnan(c.values).all()]
    return [c for c in timed if _CLOCK.fullmatch(c.plain)] or [c for c in timed if c.unit is not None]
