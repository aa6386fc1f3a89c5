"""The figures of a free scene: the axis of time, and which moment's field is drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compare.outcome import Outcome
from scenes.free import load
from scenes.model import Scene
from scenes.plan import Request
from scenes.result import Result, Traces
from validate.report.figures import trace_figure
from validate.report.figures.drawing import style

END = 0.1


def rise(constant: float) -> Result:
    """All probes of the hotplate rise from 293 to 300 with a time constant (s)."""
    time = np.concatenate([[0.0], np.geomspace(1e-6 * END, END, 60)])
    values = 293 + 7 * (1 - np.exp(-time / constant))
    return Result(
        "fem3d",
        {},
        Traces(time, {p.name: values for p in hotplate().probes}, {p.name: 1e-3 for p in hotplate().probes}),
    )


def hotplate(*settings: str) -> Scene:
    scene = load("hotplate", ["run.end_time=0.1", "boundary.drive.voltage=0.2", *settings])
    assert isinstance(scene, Scene)
    return scene


@pytest.mark.parametrize(("constant", "scale"), [(END / 3, "linear"), (END / 100, "log")])
def test_time_is_logarithmic_where_a_rise_is_over_before_it_is_seen(constant: float, scale: str) -> None:
    with style():
        axes = trace_figure.draw(Outcome(hotplate(), Request(), (), rise(constant))).axes
    assert {ax.get_xscale() for ax in axes} == {scale}
    assert axes[-1].get_xlim()[1] == pytest.approx(1e3 * END)
    if scale == "log":
        # A decade that begins before a hundredth of the rise, which is after 1 % of the time constant.
        assert axes[-1].get_xlim()[0] == pytest.approx(1e3 * 1e-5)
        line = axes[0].lines[0]
        exact = 293 + 7 * (1 - np.exp(-line.get_xdata() / 1e3 / constant))
        assert np.abs(line.get_ydata() - exact).max() < 0.05


def test_time_is_linear_where_the_drive_changes_on_the_way() -> None:
    wave = replace(hotplate(), boundaries=load("hotplate").boundaries)
    with style():
        assert trace_figure.draw(Outcome(wave, Request(), (), rise(END / 100))).axes[-1].get_xscale() == "linear"
