"""The interface of all 1D and lumped models: a question about a scene, and the answer of a model."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from scenes.errors import SceneError, quoted

LONGEST = 600.0
"""s by the clock that a model may take for one answer; 3D itself takes minutes at most."""


@dataclass(frozen=True)
class Question:
    """A scene as a model sees it.

    ``document`` is the scene in SI numbers, as summary.json has it. ``steady`` and ``over_time`` have the units of the
    quantities that 3D has in the steady state and over time, by name. ``parameters`` (SI) and ``outputs``, the model's
    own names of quantities, are those of the scene's [model].
    """

    name: str
    document: Mapping[str, object]
    steady: Mapping[str, str]
    over_time: Mapping[str, str]
    parameters: Mapping[str, float] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)

    def units(self, times: np.ndarray | None) -> Mapping[str, str]:
        """Return the units of the quantities over time, or without ``times`` in the steady state."""
        return self.steady if times is None else self.over_time


@dataclass(frozen=True)
class Answer:
    """Values by quantity, (times,) or in the steady state one number each, and the estimated errors of some of them."""

    values: Mapping[str, np.ndarray]
    errors: Mapping[str, float] = field(default_factory=dict)


class Model(ABC):
    """A 1D or lumped model of a scene.

    ``rows`` are times (s) between which the model itself is interpolated; ``exact`` models repeat their answers to
    rounding.
    """

    name: str
    rows = np.empty(0)
    exact = False

    @abstractmethod
    def answer(self, question: Question, times: np.ndarray | None) -> Answer:
        """Return the values at ascending ``times`` (n,) in s, or for None in the steady state. Raises SceneError."""

    def __repr__(self) -> str:
        return f"<model {self.name}>"


def find_file(given: str, folder: str, example: str) -> Path:
    """Return the path of a model's file. Raises SceneError where there is none."""
    path = Path(folder, given)
    if not path.is_file():
        raise SceneError(f"--model {quoted(given)}: {quoted(path)} is no file: give {example}")
    return path
