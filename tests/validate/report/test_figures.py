"""The content of figures: no kink that is not real, round lengths, nothing in a legend that cannot be seen; of a free
scene an axis of time on which its traces are seen."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from compare.blame import Budget, Part, Split
from compare.options import Options
from compare.outcome import Outcome
from compare.sink_checks import profile
from fem3d.runs.sink import solve
from scenes.loading import load, load_free
from scenes.result import Result, Traces
from validate.report.figures import scene_figures
from validate.report.figures.analysis_figures import seen_parts
from validate.report.figures.drawing import new_figure
from validate.report.figures.offscreen import round_length
from validate.report.figures.sink_figures import without_kinks


def inside(figure: Figure) -> bool:
    """Whether titles and labels lie within the figure."""
    FigureCanvasAgg(figure).draw()
    texts = [*figure.texts, *(axis.label for ax in figure.axes for axis in (ax.xaxis, ax.yaxis))]
    drawn = Bbox.union([text.get_window_extent() for text in texts])
    return bool((drawn.min >= figure.bbox.min).all() and (drawn.max <= figure.bbox.max).all())


def test_a_long_title_is_in_lines():
    title = "3D is off: peak -0.137 to -0.078 K over 4.2 - 5.7 ms; 1D is off: peak -1.4362 to -1.4235 K over 18 - 20 ms"
    figure = new_figure(7.5, 5.0, title, ["and what it is of"])
    assert inside(figure)
    figure.texts[0].set_text(title)
    assert not inside(figure)


def kink(y: np.ndarray, values: np.ndarray) -> float:
    """The largest third difference (K) between 60 and 90 um, where two cells meet at 75 um."""
    return float(np.abs(np.diff(values, 3)[(y[:-3] > 60) & (y[:-3] < 90)]).max())


def test_the_kink_between_cells_goes_and_the_curve_stays():
    """A bump larger than the error, which must be real, stays."""
    sink = load("sink", ["accuracy=1e-3"])
    found = solve(sink, transient=False)
    y, rise, fitted = profile(Outcome(sink, results={"fem3d": found}))
    um, raw = 1e6 * y, rise - fitted
    error = max(found.steady[key].error for key in ("peak_rise_K", "end_rise_K"))
    drawn = without_kinks(um, raw, error / 20)
    assert kink(um, drawn) < 0.1 * kink(um, raw)
    assert np.abs(drawn - raw).max() < 0.5 * error
    bumped = raw + 3 * error * np.exp(-(((um - 75) / 10) ** 2))
    assert np.abs(without_kinks(um, bumped, error / 20) - bumped).max() < 0.5 * error


@pytest.mark.parametrize(("wanted", "found"), [(260.0, 200.0), (5.0, 5.0), (1.99, 1.0), (0.06, 0.05)])
def test_round_lengths(wanted, found):
    assert round_length(wanted) == pytest.approx(found)


def budget(*values: float, over_time: np.ndarray | None = None) -> Budget:
    parts = tuple(Part(f"part {n}", value, 0.01) for n, value in enumerate(values))
    split = Split("peak", "K", 10.0, sum(values), 0.02, parts)
    times = None if over_time is None else np.array([1e-5, 1e-3])
    return Budget("paper", (split,), (), times, {} if over_time is None else {"peak": over_time}, "so it is")


def test_the_legend_has_what_can_be_seen():
    assert seen_parts(budget(-1.0, 0.3, 0.001)) == [0, 1]
    # Parts that show only on the way are in the legend too.
    assert seen_parts(budget(-1.0, 0.0, 0.0, over_time=np.array([[-1.0, -1.0], [0.0, 0.0], [0.1, 0.0]]))) == [0, 2]


END = 0.1


@pytest.mark.parametrize(
    ("constant", "driven", "scale"),
    [(END / 3, "at once", "linear"), (END / 100, "at once", "log"), (END / 100, "in a wave", "linear")],
)
def test_time_is_logarithmic_where_a_rise_is_over_before_it_is_seen(constant, driven, scale):
    """All probes of the hotplate rise from 293 to 300 with a time constant (s); not where the drive changes later."""
    scene = load_free("hotplate", ["run.end_time=0.1", "boundary.drive.voltage=0.2"])
    if driven == "in a wave":
        scene = replace(scene, boundaries=load_free("hotplate").boundaries)
    time = np.concatenate([[0.0], np.geomspace(1e-6 * END, END, 60)])
    values = 293 + 7 * (1 - np.exp(-time / constant))
    names = [probe.name for probe in scene.probes]
    found = Result("fem3d", {}, Traces(time, dict.fromkeys(names, values), dict.fromkeys(names, 1e-3)))
    axes = scene_figures.traces(Outcome(scene, Options(), {"fem3d": found})).axes
    assert {ax.get_xscale() for ax in axes} == {scale}
    assert axes[-1].get_xlim()[1] == pytest.approx(1e3 * END)
    if scale == "log":
        # A decade that begins before a hundredth of the rise, which is after 1 % of the time constant.
        assert axes[-1].get_xlim()[0] == pytest.approx(1e3 * 1e-5)
        line = axes[0].lines[0]
        exact = 293 + 7 * (1 - np.exp(-line.get_xdata() / 1e3 / constant))
        assert np.abs(line.get_ydata() - exact).max() < 0.05
    since = Traces(time, dict.fromkeys(names, values), dict.fromkeys(names, 1e-3), since=2e-5)
    for traces, said in ((found.over_time, False), (since, True)):
        figure = scene_figures.traces(Outcome(scene, Options(), {"fem3d": replace(found, traces=traces)}))
        assert ("larger until 20 µs after the start" in figure.texts[-1].get_text()) == said
