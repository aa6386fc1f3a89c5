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
STEPS = (500, 2000)
"""The least number of steps of the two runs of a simulation, each with a relative tolerance of 0.01 over that."""


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
    """The values of a model.

    Attributes
    ----------
    values : by quantity, in the steady state one number each, over time one for each time
    errors : estimated errors of some of them, in the unit of the values
    time : (rows,) times (s) of the values where a model has rows of its own; None where they are the requested times
    """

    values: Mapping[str, NDArray[np.float64]]
    errors: Mapping[str, float] = field(default_factory=dict)
    time: NDArray[np.float64] | None = None

    def at(self, times: NDArray[np.float64] | None) -> Answer:
        """Return the values at the requested times (s), linear between the model's own rows."""
        if self.time is None or times is None:
            return self
        return Answer({name: np.interp(times, self.time, v) for name, v in self.values.items()}, self.errors)


class Model(ABC):
    """A 1D or lumped model of a scene; ``exact`` models repeat their answers to rounding."""

    name: str
    exact = False

    @abstractmethod
    def answer(self, question: Question, times: NDArray[np.float64] | None) -> Answer:
        """Return the values at ascending ``times`` (n,) in s, or at own rows up to the last of these, or for None in
        the steady state. Raises SceneError, before which `sampling.ask` puts the name of the model."""


class Simulation(Model):
    """A model that a program solves in time steps of its own, a netlist or an FMU.

    Over time it runs twice; the difference of the two runs estimates the error.
    """

    def answer(self, question: Question, times: NDArray[np.float64] | None) -> Answer:
        if times is None:
            return self.settle(question)
        end = float(times[-1])
        coarse, fine = (self.simulate(question, end, steps) for steps in STEPS)
        # A jump of an output takes a whole step here: the two runs differ most at the end of the short step, by all
        # but its part of the long one, and right after the jump the short one is off by all of it.
        share, between = STEPS[1] / (STEPS[1] - STEPS[0]), coarse.at(fine.time).values
        errors = {name: share * float(np.abs(v - between[name]).max()) for name, v in fine.values.items()}
        return Answer(fine.values, errors, fine.time)

    @abstractmethod
    def settle(self, question: Question) -> Answer:
        """Return the steady state."""

    @abstractmethod
    def simulate(self, question: Question, end: float, steps: int) -> Answer:
        """Return one run to an end (s) with at least so many steps, at its own rows."""


def find_file(given: str, folder: str, example: str) -> Path:
    """Return the path of a model's file. Raises SceneError where there is none."""
    path = Path(folder, given)
    if not path.is_file():
        raise SceneError(f"{quoted(path)} is no file: give {example}")
    return path


def plain_name(name: str) -> str:
    """Return the name of a probe, a node or a variable in small letters, without v( ), signs and blanks."""
    bare = re.sub(r"^[vi]\((.*)\)$", r"\1", name.strip().lower()).removesuffix("#branch")
    return re.sub(r"\W+", "_", bare)


def match_outputs(noun: str, question: Question, wanted: Collection[str], own: Collection[str]) -> dict[str, str]:
    """Return the model's own name of each wanted probe that it has, given by [model.outputs] or alike.

    Raises SceneError where it has none of them, or not the given one; ``noun`` is the kind of its names.
    """
    plain, outputs = {plain_name(name): name for name in own}, {}
    for probe in wanted:
        name = question.outputs.get(probe, plain.get(plain_name(probe)))
        if name is not None and name not in own:
            has = f"it has {listed(list(own))}{did_you_mean(name, own)}"
            raise SceneError(f"no {noun} is {quoted(name)}, for {quoted(probe)}: {has}")
        if name is not None:
            outputs[probe] = name
    if not outputs:
        raise SceneError(
            f"it has no {noun} called as a probe ({', '.join(wanted)}; signs and blanks as _): it has "
            f'{listed(sorted(own)) or "none"}; say which is which, [model.outputs] probe = "name"'
        )
    return outputs


def check_parameters(noun: str, parameters: Collection[str], own: Collection[str]) -> None:
    """Raise SceneError for a parameter of [model.parameters] that the model does not have."""
    for name in parameters:
        if name not in own:
            has = listed(sorted(own)) or "none"
            raise SceneError(f"it has no {noun} {quoted(name)}, but {has}{did_you_mean(name, own)}")
