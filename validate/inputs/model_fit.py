"""The parameters of a user's own model, those of [model.parameters] of its scene, fitted to data with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from compare.against import Data
from compare.models import open_model
from compare.models.sampling import make_question
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.model import AnyScene, OwnModel
from validate.inputs.calibration import Fit, fit_model


def fitted(
    scene: AnyScene, given: str | Callable[..., Any], folder: str, names: Sequence[str], data: Data
) -> Fit:  # fmt: skip
    """The fit of some of the model's parameters, by their names, whose keys are model.parameters.NAME; its scene has
    them. Raises SceneError for a parameter that there isn't, and where the model has no answer."""
    model, start = open_model(given, folder), dict(make_question(scene).parameters)
    for name in names:
        if not start.get(name):
            listed = f"has {', '.join(start)}" if start else "has none"
            why = "is zero, of which there is no percent" if name in start else f"is none: [model.parameters] {listed}"
            raise SceneError(f"--calibrate model.parameters.{name} {why}{did_you_mean(name, start)}")

    def with_(values: Mapping[str, float]) -> AnyScene:
        own_model = scene.model or OwnModel()
        changed = {key.partition("model.parameters.")[2]: value for key, value in values.items()}
        return replace(
            scene, model=replace(own_model, parameters=tuple((dict(own_model.parameters) | changed).items()))
        )

    def answers(values: Mapping[str, float], times: np.ndarray) -> dict[str, np.ndarray]:
        question = make_question(with_(values))
        if np.isinf(times[-1]):
            return {n: np.atleast_1d(float(v)) for n, v in model.answer(question, None).values.items()}
        # A model over time is run up to the last time, which is that of the run.
        every = np.union1d(times, scene.end_time)
        courses = {n: np.asarray(v, float) for n, v in model.answer(question, every).values.items()}
        for name, course in courses.items():
            if course.shape != every.shape:
                raise SceneError(f"--model {model.name}: {quoted(name)} over time is not one number for each time")
        return {n: np.interp(times, every, v) for n, v in courses.items()}

    keys = [f"model.parameters.{name}" for name in names]
    return fit_model(scene, data, keys, {key: start[key.rpartition(".")[2]] for key in keys}, answers, with_)
