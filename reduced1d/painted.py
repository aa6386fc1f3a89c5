"""The 1D model of the sink painted on the 3D geometry, so that the two can be seen side by side."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reduced1d.equations import parabola
from scenes.errors import SceneError
from scenes.loading import from_dict
from scenes.result import Result
from scenes.sink import Sink


@dataclass(frozen=True)
class Reduction:
    """A sink with the 1D model's rises (K) of end and peak, steady and over ``time`` (s, maybe none)."""

    sink: Sink
    steady: tuple[float, float]
    time: np.ndarray
    end: np.ndarray
    peak: np.ndarray

    def rise(self, points: np.ndarray, time: float | None) -> np.ndarray:
        """(n,): the rise (K) at points (n, 3) in m; ``time`` (s) is ``None`` for the steady state."""
        if time is None or not len(self.time):
            end, peak = self.steady
        else:
            end, peak = (float(np.interp(time, self.time, values)) for values in (self.end, self.peak))
        return paint(self.sink, points, end, peak)


def paint(sink: Sink, points: np.ndarray, end: float, peak: float) -> np.ndarray:
    """(n,): the rise at points (n, 3) by the reduction, from its rises of end and peak (K).

    In the beam eq 9's parabola. Beyond it eq 14's series of prisms: falling evenly in the pad from the beam's end to
    the oxide, at one temperature from there on, and falling evenly through the oxide to none at the substrate.
    """
    sink = sink.plain
    y, z = points[:, 1], points[:, 2]
    outside = np.maximum(np.maximum(-y, y - sink.length), 0.0)
    pad = sink.anchor_distance / (sink.silicon.thermal_conductivity * sink.pad_width * sink.thickness)
    oxide = sink.oxide_thickness / (sink.oxide.thermal_conductivity * sink.oxide_length * sink.oxide_width)
    share = pad / (pad + oxide)
    part = np.minimum(outside / sink.anchor_distance, 1.0) if sink.anchor_distance else (outside > 0).astype(float)
    rise = np.where(outside > 0, end * (1 - share * part), parabola(y, peak - end, end, sink.length))
    deep = np.clip(-z / sink.oxide_thickness, 0.0, 1.0)
    below = deep > 1e-9
    rise[below] = end * (1 - share) * (1 - deep[below])
    return rise


def of_result(sink: Sink, result: Result) -> Reduction:
    rises = (result.steady["end_rise_K"].value, result.steady["peak_rise_K"].value)
    if result.traces is None:
        return Reduction(sink, rises, *[np.empty(0)] * 3)
    end, peak = (result.traces.values[name] - sink.room_temperature for name in ("end_K", "peak_K"))
    return Reduction(sink, rises, result.traces.time, end, peak)


def of_run(folder: Path) -> Reduction | None:
    """The 1D model of a run's folder; ``None`` where there is none, or the run is not one of a sink of one span."""
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        steady = summary["reduced1d"]["steady"]
        rises = (float(steady["end_rise_K"]["value"]), float(steady["peak_rise_K"]["value"]))
        sink = from_dict(summary["scene"])
    except (OSError, ValueError, KeyError, TypeError, SceneError):
        return None
    if sink.spans > 1:
        return None
    try:
        with open(folder / "traces.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        names = ("time_s", "reduced1d_end_K", "reduced1d_peak_K")
        time, end, peak = (np.array([float(row[name]) for row in rows]) for name in names)
    except (OSError, ValueError, KeyError, TypeError):
        time = end = peak = np.empty(0)
    return Reduction(sink, rises, time, end - sink.room_temperature, peak - sink.room_temperature)
