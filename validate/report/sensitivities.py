"""How both models follow each key, in the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from compare.inputs.sensitivities import PREFIX, QUANTITIES
from scenes.formats import percent
from validate.report.table import Style

if TYPE_CHECKING:
    from compare.inputs.sensitivities import Sensitivities, Slope
    from compare.verdict import Check

SHOWN = {name: QUANTITIES[name] for name in ("peak_rise_K", "end_rise_K", "current_A")}
"""Quantities with what they are called, of which the terminal has room; the page and the summary have all."""


def short(key: str) -> str:
    """A key without its section, where it is as clear: "silicon.density"."""
    return key.removeprefix("materials.").removeprefix("environment.")


def sensitivities_text(
    found: Sensitivities, checks: Iterable[Check], style: Style, names: Mapping[str, str] = SHOWN
) -> str:
    """A line for each key that any of the quantities follows, that first which one follows most: 3D and 1D side by
    side; ``names`` are the quantities with what they are called."""
    judged = {check.id.removeprefix(PREFIX): check for check in checks if check.id.startswith(PREFIX)}
    heads = "".join(f"{called:>15}" for called in names.values())
    sides = "".join(f"{'3D':>8}{'1D':>7}" for _ in names)
    lines = [style.paint(f"  {'% for each percent of':<32}{heads}", "heading"), f"  {'':<32}{sides}"]
    for key in found.sorted(names):
        mark = style.paint(style.mark(judged[key].verdict), judged[key].verdict) if key in judged else " "
        both = "".join(_pair(found.steady[key].get(name)) for name in names)
        lines.append(f"{mark} {short(key):<32}{both}".rstrip())
    if judged:
        differ = sum(check.verdict == "differs" for check in judged.values())
        tolerance = percent(next(iter(judged.values())).tolerance, 1)
        lines.append(
            f"  1D follows {len(judged) - differ} of {len(judged)} keys as 3D does, within {tolerance} of the largest"
        )
    return "\n".join(lines)


def _pair(slope: Slope | None) -> str:
    if slope is None:
        return ""
    left = "" if slope.fem3d is None else f"{slope.fem3d.value:+.3f}"
    right = "" if slope.reduced1d is None else f"{slope.reduced1d:+.3f}"
    return f"{left:>8}{right:>7}"
