"""Figures and files of a run, and colours, which stay apart in print, in greyscale and for colour-blind readers."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from compare.options import Options
from scenes.result import Step, step

if TYPE_CHECKING:
    import numpy as np

INK = "#222222"
LINES = {"peak_K": "#8b1a1a", "mean_K": "#f0a030", "end_K": "#3a86c8", "current_A": "#5e3c99"}
LAYERS = {"sink": "#8b1a1a", "sensor": "#3a86c8", "polymer": "#f0a030"}
PARTS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#999999", "#f0e442")
"""The colours of Okabe and Ito, ordered so that lightness alternates."""
FIELD = "inferno"
_PART = (0.08, 0.93)  # The part of the colour map that is used; its ends look like ink and paper.


class Drawing(NamedTuple):
    """A figure of a kind of scene: what it shows, its needs of a run (`compare.kinds.base.Kind.absent`), and the
    function in `validate.report.figures` that draws it; the renderer makes pictures of fields."""

    kind: str
    shows: str
    needs: tuple[str, ...]
    function: str = ""


FIGURES = {
    "figure4": Drawing("sink", "the steady 3D temperature field, rendered off screen", ("3D",)),
    "figure5": Drawing("sink", "the rise along the beam and eq 9's parabola", ("3D",), "scene_figures.profile"),
    "figure6": Drawing("sink", "rises against time", ("traces",), "scene_figures.rises"),
    "figure7": Drawing("sink", "current against time", ("traces",), "scene_figures.current"),
    "figure9": Drawing("device", "power of sink and sensor against time", ("figure9",), "device_figures.power"),
    "figure10": Drawing("device", "heat flow into the polymer against time", ("figure10",), "device_figures.flow"),
    "figure11": Drawing(
        "device", "the same as figure 9, sampled every 5 ms with gains of 0.5 and 0.05 V", ("figure11",),
        "device_figures.slow",
    ),
    "figure12": Drawing(
        "device", "the sensor's power after outer steps from -80 to +20 K", ("figure12",), "device_figures.responses"
    ),
    "figure13": Drawing(
        "device", "the steady power of the sensor against the outer temperature", ("figure13",),
        "device_figures.characteristic",
    ),
    "figure_field": Drawing("free", "the {} temperature field, rendered off screen", ("heat",)),
    "figure_traces": Drawing("free", "every probe against time", ("traces",), "scene_figures.traces"),
}  # fmt: skip
FILES = {
    "sink": ("every quantity against time", "3D"), "device": ("a row per controller sample", ""),
    "free": ("a column for each probe", "heat"),
}  # fmt: skip
"""By kind of scene the content of traces.csv, and the need of field files; empty where there are none."""


def outputs(scene: Any, options: Options) -> list[Step]:
    """Return the plan of figures and files."""
    from compare.kinds import kind_of
    from compare.kinds.base import lack

    absent, (traces, field) = kind_of(scene).absent(scene, options), FILES[scene.kind]
    absent["figures"] = "no figures were asked for" * (not options.figures)
    absent["fields"] = "not asked for (--fields)" * (not options.fields)
    when = "steady" if scene.kind != "free" or scene.steady else "hottest moment's"
    figures = {name: each for name, each in FIGURES.items() if each.kind == scene.kind}
    if scene.kind == "sink" and scene.spans > 1:
        del figures["figure5"]
    lines = [step(n, each.shows.format(when), lack(absent, "figures", *each.needs)) for n, each in figures.items()]
    lines.append(step("traces.csv", traces, lack(absent, "traces")))
    fields = step("field files", "fem3d.pvd with its .vtu files", lack(absent, "fields", field))
    return lines + [fields] * bool(field)


def table() -> np.ndarray:
    """(256, 3) uint8: matplotlib's inferno, of evenly rising lightness, without its ends of ink and paper."""
    import numpy as np
    from matplotlib import colormaps

    return (colormaps[FIELD](np.linspace(*_PART, 256))[:, :3] * 255).round().astype(np.uint8)


def with_mu(text: str) -> str:
    """Replace the "u" of micro by the letter mu."""
    return re.sub(r"(?<=[\d(] )u(?=[A-Zmos])|(?<=\()u(?=[A-Zmos])|^u(?=[A-Zm]$)", "\N{MICRO SIGN}", text)
