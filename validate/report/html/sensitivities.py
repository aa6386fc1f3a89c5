"""The section of how the models follow the keys of the scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from validate.report.html.parts import PLUS_MINUS, Document, named, section, table, text

_LEAST = 5e-5  # of a slope: less is shown as nothing


def sensitivities(document: Document) -> str:
    """A row for each key, that first which any quantity follows most, and a column for each quantity."""
    found = document.get("sensitivities")
    if not isinstance(found, Mapping) or not found:
        return ""
    names = list(dict.fromkeys(name for of in found.values() for name in of))
    sizes = {key: max((_size(slope) for slope in of.values()), default=0.0) for key, of in found.items()}
    rows = [
        [f"<code>{text(key)}</code>", *(_cell(found[key].get(name)) for name in names)]
        for key in sorted(found, key=lambda key: -sizes[key])
        if sizes[key] > _LEAST
    ]
    still = [key for key in found if sizes[key] <= _LEAST]
    note = (
        "<p>Logarithmic derivatives, d ln(quantity) / d ln(key): by how many percent a quantity of the steady state, "
        "over time of a free scene what it is at most, changes for each percent of a key; temperatures as rises, a "
        "coordinate in percent of its box's size. 3D with its numerical error; where there are both models, 1D below "
        "it.</p>"
    )
    rest = f"<p>Nothing steady follows {text(', '.join(still))}.</p>" if still else ""
    heads = ["key", *(named(name)[0] for name in names)]
    return section("Sensitivities", note, f'<div class="wide">{table(heads, rows, range(1, len(heads)))}</div>', rest)


def _size(slope: Mapping[str, Any]) -> float:
    return max((abs(model.get("value") or 0.0) for model in slope.values()), default=0.0)


def _cell(slope: Mapping[str, Any] | None) -> str:
    if not slope:
        return ""
    three, one = slope.get("fem3d"), slope.get("reduced1d")
    lines = [f"{three['value']:+.4f} {PLUS_MINUS} {three['error']:.4f}"] if three else []
    lines += [f"{one['value']:+.4f}"] if one else []
    return "<br>".join(text(line) for line in lines)
