"""Derivatives of the quantities of a 1D model by the keys of its scene: central differences.

Relative steps h and 2h make an error of order h^4, and bear the noise of a model. If a slope jumps by s at the value
itself, the second difference over h is s h + c h^2, and 2 s h + 4 c h^2 over 2h; there is no slope where s is a tenth
of the value. A network jumps where another side of a box becomes its longest.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from scenes.device import Device
from scenes.errors import NumericsError, SceneError
from scenes.sink import Sink
from scenes.varied import neighbour

Table = dict[str, dict[str, Any]]
Solve = Callable[[Any, Any], Mapping[str, Any]]
"""The quantities of a scene at times (s), (times,) each; for None one number each in the steady state."""


def of_ladder(reduction: str) -> Solve:
    """Return the function of the quantities of a sink in a model of the ladder."""
    from reduced1d import ladder

    def solve(sink: Sink, times: np.ndarray | None) -> Mapping[str, Any]:
        found = ladder.solve(sink, reduction, steady_only=times is None, times=times)
        return {n: e.value for n, e in found.steady.items()} if times is None else found.over_time.values

    return solve


def of_device(names: Iterable[str]) -> Solve:
    """Return the function of some quantities of a device in the steady state."""
    from reduced1d.device.lumped import steady

    def solve(device: Device, times: None) -> Mapping[str, Any]:
        state = steady(device)
        return {name: getattr(state, name) for name in names}

    return solve


def follow(
    solve: Solve, scene: Any, keys: Iterable[str], times: np.ndarray | None, h: float = 1e-3
) -> tuple[Table, dict[str, str]]:
    """Return d Q / d ln key by key and quantity, each (times,) or one number in the steady state; and by key why there
    is none.

    ``times`` (s) end with the run; ``h`` is the relative step.
    """
    slopes, left_out, base = Table(), dict[str, str](), solve(scene, times)
    for key in keys:
        try:
            far_less, less, more, far_more = (solve(neighbour(scene, key, n * h), times) for n in (-2, -1, 1, 2))
        except (NumericsError, SceneError) as error:
            left_out[key] = f"the 1D model has no answer beside it ({error})"
            continue
        bends = {n: 4 * (more[n] + less[n]) - far_more[n] - far_less[n] - 6 * value for n, value in base.items()}
        if any(np.abs(bend).max() > 2 * h * 0.1 * np.abs(base[n]).max() for n, bend in bends.items()):
            left_out[key] = "the 1D model is not differentiable at this value"
            continue
        slopes[key] = {n: (8 * (more[n] - less[n]) - (far_more[n] - far_less[n])) / (12 * h) for n in base}
    return slopes, left_out
