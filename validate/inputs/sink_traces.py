"""The traces of a sink in 3D with their derivatives, as a fit to data asks for them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem3d.runs import sink as sink_run
from fem3d.runs import sink_sensitivity
from scenes.errors import SceneError
from scenes.plan import Request
from scenes.sink import Sink
from validate.inputs.calibration import Modelled
from validate.inputs.propagation import of_values


def in_3d(sink: Sink, keys: Sequence[str], times: np.ndarray) -> Modelled:
    """A sink's 3D traces and their derivatives by logarithms of keys. SceneError for a key that has none."""
    result = sink_run.solve(sink, Request(models=("fem3d",)))
    slopes = sink_sensitivity.of_sink(sink, result, keys=keys)
    assert slopes.course is not None
    left_out = next((key for key in keys if key in slopes.left_out), None)
    if left_out is not None:
        raise SceneError(f"--calibrate {left_out}: {slopes.left_out[left_out]}")
    values = {n: np.interp(times, result.over_time.time, v) for n, v in result.over_time.values.items()}
    late = np.log(np.maximum(times, slopes.course.times[0]))
    by = {
        key: {n: np.interp(late, np.log(slopes.course.times), s) for n, s in by_name.items()}
        for key, by_name in slopes.course.values.items()
    }
    return values, of_values(sink, values, by)
