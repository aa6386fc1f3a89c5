"""What the air does to a sink, in the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from compare.air import QUANTITIES, STILL
from scenes.formats import percent
from validate.report.table import Style, wrapped

if TYPE_CHECKING:
    from compare.air import Air

SHOWN = (1.0, STILL, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 1e4)
"""Coefficients (W/(m2 K)) of which the terminal has room; the page and the summary have all."""


def air_text(air: Air, style: Style) -> str:
    """The differences at some coefficients, and up to which the air may be left out, or lumped."""
    names = "".join(f"{name:>9}" for name in QUANTITIES)
    lines = [
        style.paint(f"  {'air, W/(m2 K)':<20}{'left out, of 3D with it':>32}{'lumped, of 3D':>30}", "heading"),
        f"  {'':<18}{names}  {names}",
    ]
    for wanted in SHOWN:
        at = int(np.abs(np.log(air.coefficients / wanted)).argmin())
        parts = ["".join(f"{100 * of[n][at]:>+9.2f}" for n in QUANTITIES) for of in (air.left_out, air.lumped)]
        lines.append(f"  {air.coefficients[at]:<18.4g}{parts[0]}  {parts[1]}")
    limits = ["".join(f"{_limit(of[n]):>9}" for n in QUANTITIES) for of in (air.limits, air.lumped_limits)]
    lines.append(f"  {'within, up to':<18}{limits[0]}  {limits[1]}")
    worst = min((limit for limit in air.limits.values() if limit is not None), default=None)
    said = (
        "The air may be left out at every coefficient tried"
        if worst is None
        else f"It may be left out up to {worst:.3g} W/(m2 K)"
    )
    share = max(abs(float(np.interp(air.conduction, air.coefficients, values))) for values in air.left_out.values())
    lines.append(
        wrapped(
            f"In %. {said}. Still air is usually given {STILL:g} W/(m2 K); at this size it conducts "
            f"{air.conduction:.3g}, with which leaving it out is {percent(share)} off where it is worst, and through a "
            f"gap below the beam as high as the oxide {air.gap:.3g}."
        )
    )
    return "\n".join(lines)


def _limit(limit: float | None) -> str:
    return "all" if limit is None else f"{limit:.3g}"
