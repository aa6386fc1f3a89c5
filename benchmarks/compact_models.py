"""Compact models of random scenes against finer runs of the full model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks import random_boxes
from benchmarks.rows import Row, at_most
from compare.processes import TimeIsUpError, limited
from fem3d.runs.compact import compact, instants
from fem3d.runs.scene import solve
from scenes.errors import NumericsError, SceneError
from statespace.runtime import CompactModel

GROUP = "compact models"
ACCURACY, FINER = 3e-2, 0.2  # of a model, and the part of that to which the full model is solved
COUNT, QUICK = 50, 3
LIMIT = 60  # s of computing for one scene


def rows(quick: bool, first: int = 0) -> Iterator[Row]:
    """Compare the models of some scenes from a seed on; scenes without a sufficiently accurate model do not count."""
    wanted = QUICK if quick else COUNT
    ratios: dict[int, float] = {}
    errors, left, seed = list[str](), 0, first
    while len(ratios) < wanted and seed < first + 4 * wanted:
        try:
            with limited(LIMIT):
                ratios[seed] = ratio(seed)
        except (NumericsError, SceneError, TimeIsUpError):
            left += 1
        except Exception as error:
            errors.append(f"seed {seed}: {type(error).__name__}: {error}")
        seed += 1
    case = f"{len(ratios)} scenes, seeds {first} to {seed - 1}, {left} more without a model"
    worst = max(ratios, key=ratios.__getitem__, default=first)
    yield at_most(GROUP, case, "distance from the full model over the error bounds", ratios.get(worst, np.nan), 1.0,
                  f"seed {worst}")  # fmt: skip
    yield at_most(GROUP, case, "scenes that ended with an error", len(errors), 0, "; ".join(errors[:1]))


def ratio(seed: int) -> float:
    """Return the largest distance of a scene's model from a finer run over the error bounds of both."""
    scene = random_boxes.draw(seed).scene
    document = compact(replace(scene, accuracy=ACCURACY), None, ACCURACY)
    model, full = CompactModel(document), solve(replace(scene, accuracy=FINER * ACCURACY))
    ((_, bounds), *_) = document["error"].items()
    if scene.steady:
        reduced = model.steady()
        return max(abs(reduced[name] - e.value) / (bounds["steady"][name]["error"] + e.error)
                   for name, e in full.steady.items())  # fmt: skip
    traces = full.over_time
    at = instants(scene, traces.time)
    return max(
        float(np.abs(values - traces.values[name][at]).max()) / (bounds["over time"][name]["error"]
                                                                 + traces.errors[name])
        for name, values in model.simulate(traces.time[at]).items()
    )  # fmt: skip
