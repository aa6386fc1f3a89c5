"""Figures 6 and 7: rises and current against time, on a logarithmic and on a linear axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from compare.verdict import PAPERS
from scenes.formats import quantity, scale, sink_text
from scenes.result import Result
from scenes.sink import OF_A_SINK
from validate.report.figures import LINES
from validate.report.figures.drawing import band, legend, logarithmic, new_figure, smooth

if TYPE_CHECKING:
    from compare.against import Data
    from compare.outcome import Outcome
    from scenes.sink import Sink

_NAMES = {asked.trace: name for name, asked in OF_A_SINK.items()}
_MARKS = 25
"""How many marks of a user's own trace are drawn."""
_VISIBLE = 0.004
"""The part of the axis from which on an error band is wider than a line."""


@dataclass(frozen=True)
class _Axis:
    """The vertical axis: traces less ``zero``, times ``factor``."""

    label: str
    unit: str
    factor: float
    zero: float

    def show(self, result: Result, key: str, times: np.ndarray) -> np.ndarray:
        """A trace between its times without overshoot: straight pieces would show as bends on a logarithmic axis."""
        assert result.traces is not None
        time, values = result.traces.time, result.traces.values[key]
        return self.factor * (smooth(time, values, times) - self.zero)


def rises(outcome: Outcome[Sink]) -> Figure:
    """Figure 6: the rises of peak, mean (what the paper's model calls the equivalent temperature) and end."""
    text = f"Figure 6: rise against time, {sink_text(outcome.scene)}"
    axis = _Axis("rise above room (K)", "K", 1.0, outcome.scene.room_temperature)
    return _draw(outcome, "fig6", text, ("peak_K", "mean_K", "end_K"), axis)


def current(outcome: Outcome[Sink]) -> Figure:
    """Figure 7: the current."""
    text = f"Figure 7: current against time, {sink_text(outcome.scene)}"
    model = outcome.fem3d or outcome.reduced1d
    assert model is not None
    factor, unit = scale(model.steady["current_A"].value, "A")
    return _draw(outcome, "fig7", text, ("current_A",), _Axis(f"current ({unit})", "A", factor, 0.0))


def _draw(outcome: Outcome[Sink], family: str, text: str, keys: tuple[str, ...], axis: _Axis) -> Figure:
    end = outcome.scene.end_time
    own = {f"against_{_NAMES[key]}" for key in keys}
    checks = [check for check in outcome.checks if check.id.startswith(family) or check.id in own]
    # A third row of the legend, under a third kind of curve.
    more = 0.2 if own & {check.id for check in checks} else 0.0
    figure = new_figure(9.5, 4.8, text, checks, bottom=1.25 + more)
    axes = figure.subplots(1, 2, sharey=True, gridspec_kw={"wspace": 0.07})
    # Before a microsecond nothing has happened yet that could be seen.
    first = min(1e-6, end / 1e4)
    dense = (np.geomspace(first, end, 300), np.linspace(0.0, end, 300))
    models = [r for r in (outcome.fem3d, outcome.reduced1d) if r is not None and r.traces is not None]
    for ax, times in zip(axes, dense, strict=True):
        for key in keys:
            for result in models:
                _curve(ax, result, key, times, axis)
            if outcome.against is not None and key in outcome.against.values:
                _points(ax, outcome.against, key, times, axis)
        ax.set_xlabel("time (ms)")
    axes[0].set_ylabel(axis.label)
    logarithmic(axes[0], "x")
    axes[0].set_xlim(first * 1e3, end * 1e3)
    axes[1].set_xlim(0.0, end * 1e3)
    axes[1].xaxis.set_major_locator(MaxNLocator(5))
    _limit(axes[0], axis)
    note = _bands(axes, outcome.fem3d, keys, dense, axis) if outcome.fem3d is not None else ""
    legend(figure, axes[0], columns=len(keys) if len(keys) > 1 else 0)
    figure.text(0.5, (0.62 + more) / 4.8, note, ha="center", va="center", fontsize=9.5)
    return figure


def _limit(ax: Any, axis: _Axis) -> None:
    """The vertical axis from 0 for rises; a current that hardly changes is shown as an offset and its change."""
    if axis.zero:
        ax.set_ylim(bottom=0.0)
        return
    low, high = ax.get_ylim()
    if high - low < 1e-4 * abs(high):
        ax.ticklabel_format(axis="y", useOffset=True)


def _curve(ax: Any, result: Result, key: str, times: np.ndarray, axis: _Axis) -> None:
    solid = result.model == "fem3d"
    style: dict[str, Any] = {"ls": "-", "lw": 2.0} if solid else {"ls": (0, (5, 2.5)), "lw": 1.6}
    name = f"{_NAMES[key]}, {'3D' if solid else '1D' if result.model in PAPERS else result.model}"
    ax.plot(times * 1e3, axis.show(result, key, times), color=LINES[key], label=name, **style)


def _points(ax: Any, data: Data, key: str, times: np.ndarray, axis: _Axis) -> None:
    """A user's own trace as marks at times of its own, so few that they can be told apart."""
    wanted = times[:: len(times) // _MARKS]
    inside = np.flatnonzero((data.time >= times[0]) & (data.time <= times[-1]))
    if not len(inside):
        return
    shown = inside[np.unique(np.abs(data.time[inside, None] - wanted).argmin(axis=0))]
    values = axis.factor * (data.values[key][shown] - axis.zero)
    ax.plot(
        data.time[shown] * 1e3, values, color=LINES[key], marker="o", ms=4.5, mfc="white", ls="none", zorder=3,
        label=f"{_NAMES[key]}, {data.name[:24]}",
    )  # fmt: skip


def _bands(axes: Any, result: Result, keys: tuple[str, ...], dense: tuple[np.ndarray, ...], axis: _Axis) -> str:
    """The 3D error as a band where it is wider than a line; in words in any case, which are returned."""
    assert result.traces is not None
    low, high = axes[0].get_ylim()
    errors = {key: result.traces.errors[key] for key in keys}
    visible = [key for key in keys if errors[key] * axis.factor > _VISIBLE * (high - low)]
    for key in visible:
        half = errors[key] * axis.factor
        for ax, times in zip(axes, dense, strict=True):
            band(ax, times * 1e3, axis.show(result, key, times), half, LINES[key])
    where = "shaded where wider than a line" if visible else "narrower than the lines"
    return f"estimated error of the 3D traces at most ±{quantity(max(errors.values()), axis.unit, 2)}, {where}"
