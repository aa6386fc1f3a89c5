"""How a model follows the numbers of its scene, by differences: its slopes for sensitivities and uncertain inputs.

A central difference over a step h of a key is off by its square, and by the model's own noise over h. Both are
measured, by the same difference over 2h; where the two disagree by more than is smooth, a longer step has less of the
noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from scenes.errors import SceneError
from scenes.model import AnyScene
from scenes.varied import neighbour
from validate.models import Model
from validate.models.asked import of_scene

STEPS = (1e-3, 1e-2, 5e-2)
"""Parts of a key: the first is enough for a smooth model, the others are for noisy ones."""
SMOOTH = 1e-2
"""The part of a slope that differences over h and over 2h may be apart by before a longer step is tried."""
NOTHING = 1e-9
"""Of a quantity: a slope smaller than this is none."""


@dataclass(frozen=True)
class Followed:
    """d quantity / d ln key of a model by key and quantity, each (times,), or one number in the steady state, and its
    ``error``; ``left_out`` says why a key has none."""

    slopes: dict[str, dict[str, np.ndarray]]
    errors: dict[str, dict[str, float]]
    left_out: dict[str, str]


def follow(
    model: Model, scene: AnyScene, keys: Iterable[str], times: np.ndarray | None, say: Callable[[str], None]
) -> Followed:
    """The slopes of a model by some keys of its scene, at some times (s), the last of which is the end of the run, or
    in the steady state. Raises SceneError where the model has no answer beside the scene."""

    def at(key: str, step: float) -> dict[str, np.ndarray]:
        asked = of_scene(neighbour(scene, key, step))
        answer, _ = model.steady(asked) if times is None else model.over_time(asked, times)
        return {name: np.asarray(value, float) for name, value in answer.items()}

    found = Followed({}, {}, {})
    for key in keys:
        say(f"asking {model.name} beside {key}")
        for h in STEPS:
            try:
                moved = {step: at(key, step) for step in (h, -h, 2 * h, -2 * h)}
            except SceneError as error:
                found.left_out[key] = f"{model.name} has no answer beside it ({error})"
                break
            near = {name: (moved[h][name] - moved[-h][name]) / (2 * h) for name in moved[h]}
            far = {name: (moved[2 * h][name] - moved[-2 * h][name]) / (4 * h) for name in moved[h]}
            found.slopes[key] = near
            found.errors[key] = {name: float(np.abs(near[name] - far[name]).max()) for name in near}
            sizes = {name: float(np.abs(moved[h][name]).max()) for name in near}
            rough = [
                name
                for name, error in found.errors[key].items()
                if error > SMOOTH * float(np.abs(near[name]).max()) and error > NOTHING * sizes[name]
            ]
            if not rough:
                break
    return found
