"""The pictures of each kind of scene: its figures by file name, its temperature field, and its field files."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from scenes.formats import sink_text
from scenes.units import TIME

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from compare.outcome import Outcome
    from scenes.model import AnyScene
    from scenes.sink import Sink
    from validate.report.figures.render import Field

FIELDS = {"sink": "figure4", "free": "figure_field", "device": ""}
"""By kind of scene the figure of its 3D field, rendered off screen."""
FIGURES = {
    "figure5": "sink_figures.profile", "figure6": "scene_figures.rises", "figure7": "scene_figures.current",
    "figure9": "device_figures.power", "figure10": "device_figures.flow", "figure11": "device_figures.slow",
    "figure12": "device_figures.responses", "figure13": "device_figures.characteristic",
    "figure_traces": "scene_figures.traces", "why": "sink_figures.why",
}  # fmt: skip
"""By file name the function in `validate.report.figures` that draws it."""


def draw(name: str, outcome: Outcome[Any]) -> Figure | None:
    """Draw a figure by its file name; return None for an unknown name."""
    if name not in FIGURES:
        return None
    module, _, function = FIGURES[name].partition(".")
    figure: Figure | None = getattr(import_module(f"validate.report.figures.{module}"), function)(outcome)
    return figure


def field(outcome: Outcome[Any]) -> Field:
    """The temperature field to render."""
    return _sink_field(outcome) if outcome.scene.kind == "sink" else _free_field(outcome)


def stored(outcome: Outcome[Any]) -> tuple[np.ndarray, float]:
    """The times (s) of the field files, and the temperature (K) that rises count from."""
    import numpy as np

    from validate.report.fields import stored_times

    scene, options = outcome.scene, outcome.options
    if scene.kind == "sink":
        times = stored_times(scene.end_time, options.field_times)
        return times[:0] if options.steady else times, scene.room_temperature
    times = (
        np.unique([0.0, *scene.output_times, scene.end_time]) if scene.output_times else stored_times(scene.end_time)
    )
    return times[:0] if scene.steady else times, scene.initial_temperature


def _sink_field(outcome: Outcome[Sink]) -> Field:
    """The steady field."""
    from validate.report.figures.render import Field

    sink, details = outcome.scene, outcome.solved.details
    fields, room = details["fields"], sink.room_temperature
    size = " x ".join(f"{side * 1e6:.4g}" for side in (sink.length, sink.width, sink.thickness))
    return Field(
        fields.points, fields.hexes, fields.steady - room, "steady rise",
        f"Figure 4: steady 3D temperature, {sink_text(sink)} ({'beam' if sink.spans == 1 else 'spans of'} {size} µm, ",
        "thickness", f"rise above {room:g} K (K)", under=tuple(c for c in outcome.checks if c.id == "fig4"),
        instead="the steady temperature of the top faces, from above: no OpenGL to render in 3D with",
    )  # fmt: skip


def _free_field(outcome: Outcome[AnyScene]) -> Field:
    """The steady field above its coldest place, or a transient's at its hottest (of a cooled scene coldest) moment."""
    import numpy as np

    from compare import hottest
    from validate.report.figures.render import Field

    scene, fields, when = outcome.scene, outcome.solved.details["fields"], "steady"
    if outcome.solved.traces is None:
        kelvins = fields.steady
    else:
        time, above = hottest.farthest(fields, hottest.moments(outcome.solved.traces), scene.initial_temperature)
        kelvins = fields.at(np.array([time]))[0]
        when = f"{TIME.show(float(f'{time:.3g}'))}, when it is {'hottest' if above else 'coldest'}"
    coldest = float(kelvins.min())
    title = f"{scene.name}: temperature, {when} ("
    label = f"{when}, above {coldest:.6g} K"
    return Field(fields.points, fields.hexes, kelvins - coldest, label, title, "z", "temperature (K)", coldest)
