"""What the air does to a sink: how far a model is off that leaves it out, or lumps it, by the coefficient."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from compare.air import QUANTITIES, STILL, Limits
from scenes.formats import percent, quantity
from validate.report.table import Section, Style, Table

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.sink import Sink

SHOWN = (1.0, STILL, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 1e4)
"""Coefficients (W/(m2 K)) of which the terminal has room; the page and the summary have all."""


def section(outcome: Outcome[Sink], style: Style) -> Section:
    """The differences at some coefficients, up to which the air may be left out, or lumped; over time until when that
    stays within the tolerance, and how far it is off at most."""
    air = outcome.air
    assert air is not None
    shown = list(range(len(air.coefficients)))
    if not style.page:
        shown = [int(np.abs(np.log(air.coefficients / wanted)).argmin()) for wanted in SHOWN]

    def table(kinds: tuple[str, str], columns: list[list[str]], limits: list[str]) -> Table:
        heads = [f"{kind}\n{name}" for kind in kinds for name in QUANTITIES]
        rows = [[f"{air.coefficients[at]:g}", *(column[at] for column in columns)] for at in shown]
        return Table(("W/(m2 K)", *heads), [*rows, ["up to", *limits]])

    percents = [[f"{100 * v:+.2f}" for v in of[name]] for of in (air.left_out, air.lumped) for name in of]
    limits = [*_up_to(air.limits), *_up_to(air.lumped_limits)]
    worst = min((limit.value for limit in air.limits.values() if limit is not None), default=None)
    said = "The air may be left out at every coefficient tried"
    if worst is not None:
        said = f"It may be left out up to {worst:.3g} W/(m2 K)"
    told = (
        f"Steady, in %. {said}. Still air is usually given {STILL:g} W/(m2 K); at this size it conducts "
        f"{air.conduction:.3g}, with which leaving it out is {percent(air.conducted)} off where it is worst, and "
        f"through a gap below the beam as high as the oxide {float(f'{air.gap:.3g}'):g}."
    )
    parts: list[Table | str] = [table(("left out", "lumped"), percents, limits), told]
    if (course := air.over_time) is not None:
        until = [["the end" if math.isinf(t) else quantity(t, "s", 3) for t in course.until[n]] for n in QUANTITIES]
        most = [[f"{100 * v:+.2f}" for v in course.largest[n]] for n in QUANTITIES]
        parts.append(table(("until", "at most"), until + most, [*[""] * len(QUANTITIES), *_up_to(course.limits)]))
        parts.append(
            "Left out over time: until when it stays within the tolerance, and by how much (%) it is off at most, of "
            "the final value with the air."
        )
    return Section("Air", parts, headed=False)


def _up_to(limits: Limits) -> list[str]:
    return ["all" if limit is None else f"{float(f'{limit.value:.3g}'):g}" for limit in (limits[n] for n in QUANTITIES)]
