"""How well the active sink shields the sensor: both powers after a step of the substrate's temperature."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from compare.outcome import Outcome
from compare.report.checks import drawn, with_mu
from reduced1d.device.closed_loop import shielding_response as in_1d
from scenes.device import Device
from validate.report.figures import INK, LAYERS
from validate.report.figures.drawing import legend, new_figure

IN_1D: dict[str, Any] = {"color": "black", "lw": 0.9, "ls": ":", "drawstyle": "steps-post"}
SETTLED = 0.02
"""What is shown ends where both powers stay within this part of the sink's change."""


def over_time(outcome: Outcome[Device]) -> Figure:
    """What has been added to the powers of sensor and sink since the substrate became 1 K warmer, in 3D and 1D."""
    device = outcome.scene
    assert outcome.device_3d is not None
    checks = [drawn(check) for check in outcome.checks if check.id == "dev3d_shielding"]
    figure = new_figure(9.5, 4.6, "Shielding: the substrate 1 K warmer from time 0 on", checks, bottom=0.95, left=0.95)
    fem3d, reduced1d = outcome.device_3d.response, in_1d(device)
    time = fem3d.time_s * 1e3
    last = fem3d.sink_power_W_per_K[-1]
    off = np.maximum(np.abs(fem3d.sink_power_W_per_K - last), np.abs(fem3d.sensor_power_W_per_K))
    late = np.flatnonzero(off > SETTLED * abs(last))
    until = 1.5 * float(time[late[-1]]) if len(late) else float(time[-1])
    shown = time <= max(until, float(time[min(30, len(time) - 1)]))
    ax = figure.subplots()
    for film in ("sensor", "sink"):
        in_3d, other = (getattr(model, f"{film}_power_W_per_K")[: len(time)] * 1e6 for model in (fem3d, reduced1d))
        ax.plot(time[shown], in_3d[shown], color=LAYERS[film], lw=1.9, label=f"{film}, 3D", drawstyle="steps-post")
        ax.plot(time[shown], other[shown], label="the same in 1D" if film == "sink" else None, **IN_1D)
    steady, _ = outcome.device_3d.shielding
    without = steady.sensor_power_per_substrate_sink_off_W_per_K * 1e6
    ax.axhline(without, color=LAYERS["sensor"], ls="--", lw=1.2, label="sensor with the sink off, steady")
    ax.axhline(0.0, color=INK, lw=0.8)
    ax.set(xlabel="time since the step (ms)", ylabel=with_mu("change of the power (uW/K)"))
    legend(figure, ax)
    return figure
