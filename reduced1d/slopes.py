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

Steady = dict[str, dict[str, float]]
OverTime = dict[str, dict[str, np.ndarray]]


def of_sink(
    sink: Sink, reduction: str, keys: Iterable[str], times: np.ndarray | None = None
) -> tuple[Steady, OverTime]:
    """d ln quantity / d ln key of the steady quantities and, with ``times`` (s), of the traces there (of rises, for
    temperatures), by key and quantity. Raises the errors of `reduced1d.ladder.solve`."""

    def solved(key: str, step: float) -> tuple[dict[str, float], dict[str, np.ndarray]]:
        changed = neighbour(sink, key, step)
        result: Result = ladder.solve(changed, reduction, steady_only=times is None, times=times)
        traces = {} if result.traces is None else result.traces.values
        rises = {n: v - changed.room_temperature * n.endswith("_K") for n, v in traces.items()}
        return {name: e.value for name, e in result.steady.items()}, rises

    steady, course = Steady(), OverTime()
    for key in keys:
        more, less = solved(key, STEP), solved(key, -STEP)
        steady[key] = {n: float(_slope(v, less[0][n])) for n, v in more[0].items()}
        course[key] = {n: _slope(v, less[1][n]) for n, v in more[1].items()}
    return steady, course


def _slope(more: float | np.ndarray, less: float | np.ndarray) -> np.ndarray:
    """The logarithmic derivative by two values; nought of nothing."""
    middle = (np.asarray(more) + less) / 2
    slopes = np.zeros_like(middle)
    np.divide(np.asarray(more) - less, 2 * STEP * middle, out=slopes, where=middle != 0)
    return slopes


def of_device(device: Device) -> dict[str, dict[str, float]]:
    """d ln quantity / d ln key of the final steady state, by key and quantity; zero quantities have none."""
    slopes: dict[str, dict[str, float]] = {}
    for key in numbers(device):
        more, less = (steady_state(neighbour(device, key, step)) for step in (STEP, -STEP))
        both = {name: (float(getattr(more, name)), float(getattr(less, name))) for name in OF_DEVICE}
        slopes[key] = {name: (a - b) / (STEP * (a + b)) for name, (a, b) in both.items() if a * b > 0}
    return slopes
