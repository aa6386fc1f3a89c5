"""The network of lines that one makes by hand of a scene's boxes (`reduced1d.network`), as a model of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reduced1d.network import solve
from scenes.free import from_dict
from scenes.keys import SINK
from scenes.loading import from_dict as from_parametric
from scenes.loading import type_of_file
from scenes.result import Result
from validate.models import Answer, Asked

NAME = "network"


@dataclass
class Network:
    """The network of the scene that it is asked about, without noise: it is solved to rounding."""

    name: str = NAME
    smooth: bool = True

    def rows(self, question: Asked) -> np.ndarray:
        return np.empty(0)

    def steady(self, question: Asked) -> Answer:
        estimates = _solved(question).steady
        return {name: e.value for name, e in estimates.items()}, {name: e.error for name, e in estimates.items()}

    def over_time(self, question: Asked, times: np.ndarray) -> Answer:
        traces = _solved(question, times).over_time
        return traces.values, traces.errors


def opened(given: str, folder: str) -> Network:
    """The network."""
    return Network()


def _solved(question: Asked, times: np.ndarray | None = None) -> Result:
    """Of a sink by its quantities, of a scene of boxes by its probes; the steady state, or at ``times`` alone."""
    if type_of_file(question.document) is SINK:
        from reduced1d.network import sink

        return sink.solve(from_parametric(question.document), times)
    return solve(from_dict(question.document, question.name), times, steady_too=False)
