"""The network of lines that one makes by hand of a scene's boxes (`reduced1d.network`), as a model of the scene."""

import numpy as np

from compare.models.model import Model, Question
from compare.quantities import AT_REST
from reduced1d.network.solution import solve, solve_sink
from scenes.result import Traces
from scenes.sink import Sink


def open_model(given: str, folder: str) -> Model:
    """Return the network, which is solved to rounding."""
    return Model("network", _answer, exact=True)


def _answer(question: Question) -> Traces:
    scene, times = question.scene, question.times
    result = solve_sink(scene, times) if isinstance(scene, Sink) else solve(scene, times, steady_too=False)
    if times is not None:
        return result.over_time
    values = {name: np.array([each.value]) for name, each in result.steady.items()}
    return Traces(AT_REST, values, {name: each.error for name, each in result.steady.items()})
