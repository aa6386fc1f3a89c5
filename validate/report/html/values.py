"""Values of a summary, with their names, units and errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scenes.formats import quantity, with_error
from validate.report.html.words import named, text

Document = Mapping[str, Any]
PLUS_MINUS = "\N{PLUS-MINUS SIGN}"


def steady_of(document: Document, model: str) -> Mapping[str, Any]:
    found = (document.get(model) or {}).get("steady") or {}
    return found if isinstance(found, Mapping) else {}


def value_of(item: Mapping[str, Any] | None) -> float | None:
    return None if item is None else item.get("value")


def number(value: Any) -> float:
    """A summary has null where a number is not finite."""
    return float("inf") if value is None else float(value)


def value_with_error(item: Mapping[str, Any] | None, unit: str) -> str:
    if item is None or item.get("value") is None:
        return ""
    if item.get("error") is None:
        return text(quantity(item["value"], unit, 6))
    value, error, shown_unit, _, _ = with_error(item["value"], item["error"], unit)
    return text(f"{value} {PLUS_MINUS} {error} {shown_unit}")


def error_text(error: float, unit: str) -> str:
    return text(quantity(error, unit, 2))


def probe_or_quantity(document: Document, key: str) -> tuple[str, str]:
    """Name and unit of a key of a model's values: a probe has its own, a quantity's are in the key."""
    units = (document.get("fem3d") or {}).get("units") or {}
    return (key, units[key]) if key in units else named(key)
