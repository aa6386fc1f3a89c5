"""What the air does to a sink: how far a model is off that leaves it out, or lumps it, by the coefficient."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.air import QUANTITIES, STILL, Limits
from scenes.formats import percent, quantity, sink_text
from validate.report.table import Section, Style, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from compare.air import Air
    from compare.outcome import Outcome
    from scenes.sink import Sink

SHOWN = (1.0, STILL, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 1e4)
"""Coefficients (W/(m2 K)) of which the terminal has room; the page and the summary have all."""
_LEAST = 0.1
"""Percent below which the figure's axis is linear, as the differences change their sign."""


def section(outcome: Outcome[Sink], style: Style) -> Section:
    """The differences at some coefficients, up to which the air may be left out, or lumped, and until when."""
    air = outcome.air
    assert air is not None
    places = [int(np.abs(np.log(air.coefficients / wanted)).argmin()) for wanted in SHOWN]
    shown = list(range(len(air.coefficients))) if style.page else places
    rows = [
        [f"{air.coefficients[at]:g}", *(f"{100 * of[n][at]:+.2f}" for of in (air.left_out, air.lumped) for n in of)]
        for at in shown
    ]
    rows.append(["up to", *_up_to(air.limits), *_up_to(air.lumped_limits)])
    heads = [f"{kind}\n{name}" for kind in ("left out", "lumped") for name in QUANTITIES]
    parts: list[Table | str] = [Table(("W/(m2 K)", *heads), rows), _told(air)]
    if air.over_time is not None:
        parts += _over_time(air, shown)
    return Section("Air", parts, headed=False)


def _over_time(air: Air, shown: list[int]) -> list[Table | str]:
    """Until when leaving out the air stays within the tolerance, and how far it is off at most."""
    course = air.over_time
    assert course is not None
    rows = [
        [
            f"{air.coefficients[at]:g}", *(_time(course.until[n][at]) for n in QUANTITIES),
            *(f"{100 * course.largest[n][at]:+.2f}" for n in QUANTITIES),
        ]
        for at in shown
    ]  # fmt: skip
    rows.append(["up to", *[""] * len(QUANTITIES), *_up_to(course.limits)])
    heads = [f"{kind}\n{name}" for kind in ("until", "at most") for name in QUANTITIES]
    said = "Left out over time: until when it stays within the tolerance, and by how much (%) it is off at most, of the"
    return [Table(("W/(m2 K)", *heads), rows), f"{said} final value with the air."]


def _told(air: Air) -> str:
    worst = min((limit.value for limit in air.limits.values() if limit is not None), default=None)
    said = "The air may be left out at every coefficient tried"
    if worst is not None:
        said = f"It may be left out up to {worst:.3g} W/(m2 K)"
    return (
        f"Steady, in %. {said}. Still air is usually given {STILL:g} W/(m2 K); at this size it conducts "
        f"{air.conduction:.3g}, with which leaving it out is {percent(air.conducted)} off where it is worst, and "
        f"through a gap below the beam as high as the oxide {float(f'{air.gap:.3g}'):g}."
    )


def _up_to(limits: Limits) -> list[str]:
    return ["all" if limit is None else f"{float(f'{limit.value:.3g}'):g}" for limit in (limits[n] for n in QUANTITIES)]


def _time(until: float) -> str:
    return "the end" if math.isinf(until) else quantity(until, "s", 3)


def figure(outcome: Outcome[Sink]) -> Figure:
    """The differences, left out in full and lumped in broken lines, with still air marked; beside it until when."""
    from validate.report.figures import INK, LINES
    from validate.report.figures.drawing import legend, logarithmic, new_figure

    air = outcome.air
    assert air is not None
    panels = 1 if air.over_time is None else 2
    text, width = f"Leaving out the air, {sink_text(outcome.scene)}", 8.5 if panels == 1 else 11.0
    figure = new_figure(width, 5.2, text, air.checks[:1], bottom=1.1, left=1.0)
    axes = np.atleast_1d(figure.subplots(1, panels, gridspec_kw={"wspace": 0.22}))
    colours = {"peak": LINES["peak_K"], "mean": LINES["mean_K"], "end": LINES["end_K"], "current": INK}
    for name, colour in colours.items():
        for of, line, word in ((air.left_out, "-", "left out"), (air.lumped, (0, (4, 3)), "lumped")):
            axes[0].plot(air.coefficients, 100 * of[name], color=colour, ls=line, label=f"{name}, {word}")
    axes[0].set_yscale("symlog", linthresh=_LEAST)
    axes[0].set_yticks(ticks := _ticks(air), [f"{v:+g}" if v else "0" for v in ticks])
    axes[0].set_ylabel("difference from 3D with air, steady (%)")
    axes[0].set_title("dotted: the tolerance of rises", fontsize=9, loc="right")
    for sign in (-1, 1):
        axes[0].axhline(sign * 100 * outcome.scene.tolerance("air_peak"), color="#999999", lw=0.9, ls=":")
    if air.over_time is not None:
        _until(axes[1], air, colours, outcome.scene.end_time)
    for ax in axes:
        _marked(ax, air)
        logarithmic(ax, "x")
    legend(figure, axes[0], columns=4, fontsize=8.5)
    return figure


def _until(ax: Any, air: Air, colours: dict[str, str], end: float) -> None:
    """Until when the air may be left out, for each coefficient at which it may not be to the end."""
    from validate.report.figures.drawing import logarithmic

    assert air.over_time is not None
    for name, colour in colours.items():
        until = np.where(np.isinf(air.over_time.until[name]), np.nan, air.over_time.until[name])
        ax.plot(air.coefficients, 1e3 * until, color=colour, marker="o", ms=3)
    logarithmic(ax, "y")
    ax.set_ylim(top=1e3 * end)
    ax.set_ylabel("may be left out until (ms)")
    ax.set_title("up to the end of the run", fontsize=9, loc="right")


def _marked(ax: Any, air: Air) -> None:
    """The axis of coefficients, with still air marked."""
    for at, word in ((STILL, "still air, large bodies"), (air.conduction, "still air, this size")):
        ax.axvline(at, color="#999999", lw=0.9)
        ax.text(
            at * 0.94, 0.03, word, rotation=90, ha="right", va="bottom", fontsize=8.5,
            transform=ax.get_xaxis_transform(),
        )  # fmt: skip
    ax.set_xlim(air.coefficients[0], air.coefficients[-1])
    ax.set_xlabel("coefficient (W/(m² K))")


def _ticks(air: Air) -> list[float]:
    """Powers of ten as far as the differences go, on both sides."""
    found = np.concatenate([100 * v for of in (air.left_out, air.lumped) for v in of.values()])
    tens = [10.0**n for n in range(-1, 6)]
    low, high = -float(found.min()), float(found.max())
    return [*(-v for v in reversed(tens) if v <= 3 * low), 0.0, *(v for v in tens if v <= 3 * high)]
