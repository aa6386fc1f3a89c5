"""How both models follow each key, in the terminal."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from compare.inputs.sensitivities import PREFIX, QUANTITIES
from scenes.formats import percent
from validate.report.table import Style

if TYPE_CHECKING:
    from compare.inputs.sensitivities import Sensitivities, Slope
    from compare.verdict import Check

SHOWN = ("peak_rise_K", "end_rise_K", "current_A")
"""Of which the terminal has room; the page and the summary have all."""


def short(key: str) -> str:
    """A key without its section, where it is as clear: "silicon.density"."""
    return key.removeprefix("materials.").removeprefix("environment.")


def sensitivities_text(found: Sensitivities, checks: Iterable[Check], style: Style) -> str:
    """A line for each key that rises or current follow, that first which one follows most: 3D and 1D side by side."""
    judged = {check.id.removeprefix(PREFIX): check for check in checks if check.id.startswith(PREFIX)}
    heads = "".join(f"{QUANTITIES[name]:>15}" for name in SHOWN)
    sides = "".join(f"{'3D':>8}{'1D':>7}" for _ in SHOWN)
    lines = [style.paint(f"  {'% for each percent of':<32}{heads}", "heading"), f"  {'':<32}{sides}"]
    for key in found.sorted(SHOWN):
        mark = style.paint(style.mark(judged[key].verdict), judged[key].verdict) if key in judged else " "
        both = "".join(_pair(found.steady[key].get(name)) for name in SHOWN)
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
