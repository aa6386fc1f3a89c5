"""Figures: titles and fields; and the picture of a scene before it is solved, with the names of its parts."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from compare.options import Options
from compare.outcome import Progress
from compare.pipeline import solve
from scenes.loading import load, load_free
from scenes.model import Box, Contact, Scene
from scenes.sink import SILICON
from validate.report.figures.drawing import field_figure, new_figure
from validate.report.figures.scene_figures import traces
from validate.report.output import field_of
from validate.viewer.boxes import THIN, request


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


def test_window_shows_all_parts():
    scene = load_free("hotplate")
    given = request(scene)
    assert [part["name"] for part in given["parts"][:2]] == ["plate: nitride", "heater: platinum"]
    assert len(given["parts"]) == len(scene.boxes) + len(scene.boundaries) + len(scene.probes)
    film = given["parts"][1]
    assert np.ptp(film["corners"][2]) >= 0.5 * THIN
    assert given["title"].startswith("hotplate (boxes: 2, boundaries: 5, probes: 4; thin")


def test_contact_is_named_at_the_common_face():
    boxes = (Box("a", SILICON, (0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3)), Box("b", SILICON, (0.0, 0.0, 1e-3), (2e-3,) * 3))
    drawn = request(Scene("two", boxes, (), (), contacts=(Contact("glue", ("a", "b"), 1e-6, 1e-10),)))["parts"]
    assert drawn[-1]["name"] == "glue: 1e-6 m2 K/W, 1e-10 ohm m2"
    below, above = drawn[-1]["corners"][2]
    assert below == above == pytest.approx(drawn[1]["corners"][2][0])


def test_title_of_figure_4_is_one_line():
    field = field_of(solve(load("sink", ["run.accuracy=0.05"]), Options(steady=True), Progress()))
    figure = field_figure(field, np.zeros((9, 9, 4), np.uint8))
    assert figure.texts[0].get_text().endswith("2 \N{MICRO SIGN}m, thickness drawn x20)")


def test_the_legend_of_many_probes_is_within_the_figure():
    def model(scene, times):
        return {f"probe {n}": np.full(times.shape, 300.0) for n in range(20)}

    scene = load_free("hotplate", overrides=["run.accuracy=0.05"])
    probes = (replace(scene.probes[0], name=f"probe {n}") for n in range(20))
    outcome = solve(replace(scene, probes=(*probes, scene.probes[2])), Options(model=model), Progress())
    figure = traces(outcome)
    FigureCanvasAgg(figure).draw()
    for ax in figure.axes:
        legend, panel = ax.get_legend(), ax.get_window_extent()
        assert panel.y0 - 5 <= legend.get_window_extent().y0
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()][:2] == ["probe 0", "probe 0, 1D"]
    assert figure.texts[-1].get_text().startswith("1D: model; shaded")


def test_field_of_a_transient_is_at_its_hottest_moment():
    """The example's last pulse ends at 3 ms."""
    scene = load_free("hotplate", overrides=["run.accuracy=0.05"])
    outcome = solve(scene, Options(), Progress())
    field = field_of(outcome)
    assert "when it is hottest" in field.title
    peak = outcome.solved.traces.values["heater"].max()
    assert field.rise.max() + field.above >= peak - outcome.solved.traces.errors["heater"]
