"""The probes of a free scene against time: a panel for each quantity."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from compare.outcome import Outcome
from compare.report.checks import with_mu
from scenes import physics
from scenes.formats import cut, quantity, scale
from scenes.model import UNITS, AnyScene, Schedule
from scenes.result import Traces
from validate.report.figures.drawing import VISIBLE, band, new_figure, smooth

_COLOURS = ("#8b1a1a", "#3a86c8", "#f0a030", "#5e3c99", "#2a7f62", "#b04f8c", "#707070")
_DASHES = ("-", (0, (5, 2.5)), (0, (1.5, 1.5)))
_TIMES = ((1.0, "s"), (1e3, "ms"), (1e6, "µs"), (1e9, "ns"))
MOST_NAME = 24
"""Characters of a name that there is room for."""
_PANEL = 2.4  # Inches of a panel.
_EARLY = 0.05  # A trace that has half its change within this part of the run is drawn on a logarithmic axis.
_SEEN = 0.01  # A change below this part of a trace's range can't be seen.


def draw(outcome: Outcome[AnyScene]) -> Figure:
    """Draw every probe from the start on, with a band for its errors, a model's dotted, a user's data as dots.

    The axis of time is logarithmic where a trace has done half of all it does in the first twentieth of the run, and
    nothing that drives the scene changes later.
    """
    scene, traces = outcome.scene, outcome.solved.over_time
    model = outcome.reduced1d
    model_traces = None if model is None else model.traces
    first = _first(scene, traces)
    times = np.geomspace(first, scene.end_time, 400) if first else traces.time
    bounds = {name: traces.error_at(name, times) for name in traces.values}
    panels = [q for q in UNITS if any(probe.quantity == q for probe in scene.probes)]
    height = 1.1 + _PANEL * len(panels)
    figure = new_figure(9.5, height, f"{scene.name}: probes against time", [], left=0.9, bottom=0.8)
    figure.subplots_adjust(right=0.78)
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    data, wider = outcome.options.against, list[str]()
    factor, unit = next((f, u) for f, u in _TIMES if scene.end_time * f >= 1 or u == "ns")
    for ax, name in zip(axes, panels, strict=True):
        probes = [probe.name for probe in scene.probes if probe.quantity == name]
        largest = max(float(np.abs(traces.values[probe][traces.sure(traces.time)]).max()) for probe in probes)
        per, shown = scale(largest, UNITS[name])
        for number, probe in enumerate(probes):
            values = traces.values[probe]
            # Rows are few where a straight line over time does, which a logarithmic axis bends.
            course, bound = smooth(traces.time, values, times) if first else values, bounds[probe] * per
            drawn = np.where(np.isfinite(bound), per * course, np.nan)
            colour, dash = _COLOURS[number % len(_COLOURS)], _DASHES[number // len(_COLOURS) % len(_DASHES)]
            ax.plot(times * factor, drawn, color=colour, ls=dash, label=cut(probe, MOST_NAME))
            band(ax, times * factor, drawn, bound, colour)
            if data is not None and probe in data.values:
                label = None if number else cut(data.name, MOST_NAME)
                ax.plot(data.time * factor, data.values[probe] * per, ".", color=colour, ms=5, zorder=1, label=label)
            if model is not None and model_traces is not None and probe in model_traces.values:
                label = None if number else model.model
                ax.plot(
                    model_traces.time * factor,
                    model_traces.values[probe] * per,
                    color=colour,
                    ls=":",
                    lw=2.4,
                    label=label,
                )
        low, high = ax.get_ylim()
        wider += [probe for probe in probes if traces.errors[probe] * per > VISIBLE * (high - low)]
        ax.set_ylabel(f"{name.replace('_', ' ')} ({shown})")
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    axes[-1].set(xlabel=f"time ({unit})", xscale="log" if first else "linear")
    axes[-1].set_xlim(first * factor, scene.end_time * factor)
    listed = ", ".join(cut(probe, MOST_NAME) for probe in wider[:3]) + (" and more" if len(wider) > 3 else "")
    note = f"is shaded where it is wider than the line: {listed}" if wider else "is narrower than the lines"
    if not traces.sure(times).all():
        starts = "the start and each jump of a given temperature" if traces.jumps else "the start"
        note += f"; it is larger until {quantity(traces.since, 's', 2)} after {starts}"
    figure.text(0.5, 0.12 / height, with_mu(f"the estimated error of the 3D traces {note}"), ha="center", fontsize=9)
    return figure


def _first(scene: AnyScene, traces: Traces) -> float:
    """Where a logarithmic axis starts (s): before any trace has moved visibly; 0 where a linear one is better."""
    if any(t > 0 for value in physics.driving(scene) if isinstance(value, Schedule) for t in value.times):
        return 0.0
    halves, starts = [], []
    for values in traces.values.values():
        moved = np.abs(values - values[0])
        if moved.max() > 1e-9 * np.abs(values).max():
            halves.append(traces.time[np.argmax(moved > 0.5 * moved.max())])
            starts.append(traces.time[np.argmax(moved > _SEEN * moved.max())])
    if not halves or min(halves) > _EARLY * scene.end_time:
        return 0.0
    return max(10.0 ** np.floor(np.log10(min(starts))), 1e-6 * scene.end_time)
