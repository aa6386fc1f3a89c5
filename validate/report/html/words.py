"""Texts of the page: escaped, with names and units for what a summary calls by a key."""

from __future__ import annotations

import math
import re
from html import escape
from typing import Any

from scenes.formats import quantity
from validate.report.claims import NAMES as DEVICE
from validate.report.sink import QUANTITIES as SINK

_NAMED = SINK | DEVICE
_UNITS = {
    "_K_per_W": "K/W", "_W_per_m2": "W/m2", "_A_per_m2": "A/m2", "_K": "K", "_A": "A", "_W": "W", "_V": "V", "_s": "s",
    "_m3": "m3", "_m": "m", "_J": "J", "_Hz": "Hz", "_ohm": "ohm",
}  # fmt: skip


def text(value: object) -> str:
    """Escaped, with the numbers of an exponent or a unit kept on one line with it."""
    return re.sub(r"(?<=\d) (?=[A-Za-z%\N{PLUS-MINUS SIGN}])", "&nbsp;", escape(str(value)))


def named(key: str) -> tuple[str, str]:
    """A key as a name and its unit: "peak_rise_K" is ("peak rise", "K")."""
    if key in _NAMED:
        return _NAMED[key]
    for ending, unit in _UNITS.items():
        if key.endswith(ending):
            return key.removesuffix(ending).replace("_", " "), unit
    return key.replace("_", " "), ""


def shown(value: Any, unit: str = "") -> str:
    """A value of a summary as a person reads it, escaped."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}".replace(",", "&#8239;")
    if isinstance(value, float):
        if not math.isfinite(value):
            return "infinite"
        # A volume takes no prefix: a "pm3" is a cubic picometre.
        return text(quantity(value, unit, 5) if unit and unit != "m3" else f"{value:.6g} {unit}".rstrip())
    return text(value)
