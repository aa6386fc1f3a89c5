"""Logarithmic derivatives of a 1D model's quantities by the keys of its scene, by central differences.

The reductions are solved to rounding, and a step of 2e-4 is off by its square: a few 1e-8 of a quantity that goes like
a third power.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from reduced1d import ladder
from reduced1d.device.lumped import steady as steady_state
from scenes.device import Device
from scenes.result import Result
from scenes.sink import Sink
from scenes.varied import neighbour, numbers

STEP = 2e-4  # Relative step of a key in a central difference; its error is the step's square.
OF_DEVICE = {
    "sink_power_W": "sink's power",
    "sensor_power_W": "sensor's power",
    "sensor_V": "sensor's voltage",
    "sink_V": "sink's voltage",
    "polymer_flux_W": "heat to the polymer",
}
"""Quantities with derivatives; the controllers fix the temperatures."""


def of_sink(
    sink: Sink, reduction: str, keys: Iterable[str], times: np.ndarray | None = None
) -> tuple[dict[str, dict[str, float]], dict[str, dict[str, np.ndarray]]]:
    """d ln quantity / d ln key of the steady quantities and, with ``times`` (s), of the traces there (of rises, for
    temperatures), by key and quantity. Raises the errors of `reduced1d.ladder.solve`."""

    def solved(changed: Sink) -> list[dict[str, np.ndarray]]:
        result: Result = ladder.solve(changed, reduction, steady_only=times is None, times=times)
        traces = {} if result.traces is None else result.traces.values
        rises = {n: v - changed.room_temperature * n.endswith("_K") for n, v in traces.items()}
        return [{name: np.array(e.value) for name, e in result.steady.items()}, rises]

    steady, course = {}, {}
    for key in keys:
        (more, late), (less, early) = (solved(neighbour(sink, key, step)) for step in (STEP, -STEP))
        steady[key] = {name: float(_slope(more[name], less[name])) for name in more}
        course[key] = {name: _slope(late[name], early[name]) for name in late}
    return steady, course


def of_device(device: Device) -> dict[str, dict[str, float]]:
    """d ln quantity / d ln key of the final steady state, by key and quantity; zero quantities have none."""
    slopes: dict[str, dict[str, float]] = {}
    for key in numbers(device):
        more, less = (vars(steady_state(neighbour(device, key, step))) for step in (STEP, -STEP))
        slopes[key] = {name: float(_slope(np.array(more[name]), np.array(less[name]))) for name in OF_DEVICE
                       if more[name] * less[name] > 0}  # fmt: skip
    return slopes


def _slope(more: np.ndarray, less: np.ndarray) -> np.ndarray:
    """The logarithmic derivative by two values; nought of nothing."""
    middle = (more + less) / 2
    return np.divide(more - less, 2 * STEP * middle, out=np.zeros_like(middle), where=middle != 0)
