"""The network of lines that one makes by hand of a scene's boxes (`reduced1d.network`), as a model of the scene."""

import numpy as np

from compare.models.model import Answer, Model, Question
from reduced1d.network.solution import solve, solve_sink
from scenes.free import from_dict
from scenes.keys import SINK
from scenes.loading import from_dict as from_parametric
from scenes.loading import type_of_file


class Network(Model):
    """The network, solved to rounding."""

    name = "network"
    exact = True

    def answer(self, question: Question) -> Answer:
        document, times = dict(question.document), question.times
        if type_of_file(document) is SINK:
            result = solve_sink(from_parametric(document), times)
        else:
            result = solve(from_dict(document, question.name), times, steady_too=False)
        if times is not None:
            return Answer(result.over_time.values, result.over_time.errors)
        values = {name: np.array(estimate.value) for name, estimate in result.steady.items()}
        return Answer(values, {name: estimate.error for name, estimate in result.steady.items()})


def open_model(given: str, folder: str) -> Network:
    """Return the network."""
    return Network()
