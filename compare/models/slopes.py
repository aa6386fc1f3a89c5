"""How a model follows the numbers of its scene, by differences: its slopes for sensitivities and uncertain inputs.

The error of a central difference over a step h of a key is of order h^2, and the model's own noise over h. The same
difference over 2h measures both; where the two disagree too much, a longer step has less of the noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.models.model import Model, Question
from compare.models.sampling import make_question
from scenes.errors import SceneError
from scenes.varied import neighbour

STEPS = (1e-3, 1e-2, 5e-2)
"""Relative steps of a key: the first suffices for a smooth model, the others are for noisy ones."""
SMOOTH = 1e-2
"""A longer step is tried where differences over h and over 2h differ by more than this part."""
NOTHING = 1e-9
"""A slope smaller than this part of the quantity counts as zero."""
BENT = 0.1
"""A key has no slope where the relative slope jumps by more than this at its value. With f the quantity, |f(h) - 2 f(0)
+ f(-h)| is then above 0.1 h f, while a power f = key^n has only n (n - 1) h^2 f. A network jumps where another side of
a box becomes its longest."""


@dataclass(frozen=True)
class Followed:
    """d quantity / d ln key of a model by key and quantity, each (times,), or one number in the steady state.

    ``left_out`` has the reason why a key has no slope.
    """

    slopes: dict[str, dict[str, np.ndarray]]
    left_out: dict[str, str]


def follow(
    model: Model, scene: Any, keys: Iterable[str], times: np.ndarray | None, say: Callable[[str], None],
    ask: Callable[[Any], Question] = make_question,
) -> Followed:  # fmt: skip
    """Return a model's slopes by keys of its scene, at times (s) that end with the run, or in the steady state.

    ``ask`` makes the question of a scene. Raises SceneError where the model has no answer to the scene itself.
    """

    def at(key: str, step: float) -> dict[str, np.ndarray]:
        return dict(model.answer(ask(neighbour(scene, key, step)), times).values)

    followed = Followed({}, {})
    base: dict[str, np.ndarray] = {}
    for key in keys:
        say(f"asking {model.name} beside {key}")
        for h in STEPS:
            try:
                base = base or at(key, 0.0)
                moved = {step: at(key, step) for step in ((h, -h) if model.exact else (h, -h, 2 * h, -2 * h))}
            except SceneError as error:
                followed.left_out[key] = f"{model.name} has no answer beside it ({error})"
                break
            near = {name: (moved[h][name] - moved[-h][name]) / (2 * h) for name in moved[h]}
            bends = {name: np.abs(moved[h][name] - 2 * base[name] + moved[-h][name]).max() for name in near}
            if any(bend > BENT * h * np.abs(base[name]).max() for name, bend in bends.items()):
                followed.left_out[key] = f"{model.name} is not differentiable at this value"
                followed.slopes.pop(key, None)
            else:
                followed.left_out.pop(key, None)
                followed.slopes[key] = near
            if model.exact:
                break
            rough = False
            for name, slope in near.items():
                far = (moved[2 * h][name] - moved[-2 * h][name]) / (4 * h)
                off, size = float(np.abs(slope - far).max()), float(np.abs(moved[h][name]).max())
                rough |= off > SMOOTH * float(np.abs(slope).max()) and off > NOTHING * size
            if not rough:
                break
    return followed
