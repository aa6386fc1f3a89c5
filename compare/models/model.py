"""The interface of all 1D and lumped models: a question about a scene, and the answer of a model."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenes.errors import SceneError, did_you_mean, listed, quoted

if TYPE_CHECKING:
    from numpy.typing import NDArray

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

    def units(self, times: NDArray[np.float64] | None) -> Mapping[str, str]:
        """Return the units of the quantities over time, or without ``times`` in the steady state."""
        return self.steady if times is None else self.over_time


@dataclass(frozen=True)
class Answer:
    """Values by quantity, (times,) or in the steady state one number each, and the estimated errors of some of them."""

    values: Mapping[str, NDArray[np.float64]]
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
    def answer(self, question: Question, times: NDArray[np.float64] | None) -> Answer:
        """Return the values at ascending ``times`` (n,) in s, or for None in the steady state. Raises SceneError."""

    def __repr__(self) -> str:
        return f"<model {self.name}>"


def find_file(given: str, folder: str, example: str) -> Path:
    """Return the path of a model's file. Raises SceneError where there is none."""
    path = Path(folder, given)
    if not path.is_file():
        raise SceneError(f"--model {quoted(given)}: {quoted(path)} is no file: give {example}")
    return path


def plain_name(name: str) -> str:
    """Return the name of a probe, a node or a variable in small letters, without v( ), signs and blanks."""
    bare = re.sub(r"^[vi]\((.*)\)$", r"\1", name.strip().lower()).removesuffix("#branch")
    return re.sub(r"\W+", "_", bare)


def match_outputs(
    model: str, noun: str, question: Question, wanted: Collection[str], own: Collection[str]
) -> dict[str, str]:
    """Return the model's own name of each wanted probe that it has, given by [model.outputs] or alike.

    Raises SceneError where it has none of them, or not the given one; ``noun`` is the kind of its names.
    """
    plain, outputs = {plain_name(name): name for name in own}, {}
    for probe in wanted:
        name = question.outputs.get(probe, plain.get(plain_name(probe)))
        if name is not None and name not in own:
            raise SceneError(
                f"--model {model} has no {noun} {quoted(name)} for {quoted(probe)}: it has "
                f"{listed(list(own))}{did_you_mean(name, own)}"
            )
        if name is not None:
            outputs[probe] = name
    if not outputs:
        raise SceneError(
            f"--model {model} has no {noun} called as a probe ({', '.join(wanted)}; signs and blanks as _): it has "
            f'{listed(sorted(own)) or "none"}; say which is which, [model.outputs] probe = "name"'
        )
    return outputs


def check_parameters(model: str, noun: str, question: Question, own: Collection[str]) -> None:
    """Raise SceneError for a parameter of [model.parameters] that the model does not have."""
    for name in question.parameters:
        if name not in own:
            has = listed(sorted(own)) or "none"
            raise SceneError(f"--model {model} has no {noun} {quoted(name)}: it has {has}{did_you_mean(name, own)}")
