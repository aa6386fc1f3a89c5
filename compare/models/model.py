"""The interface of all 1D and lumped models: a question about a scene, and the answer of a model."""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.errors import SceneError, listed, quoted, unknown

LONGEST = 600.0
"""s by the clock that a model may take for one answer; 3D itself takes minutes at most."""
STEPS = (500, 2000)
"""The least number of steps of the two runs of a simulation, each with a relative tolerance of 0.01 over that."""


@dataclass(frozen=True)
class Question:
    """A scene as a model sees it.

    Attributes
    ----------
    name, document : of the scene; the document in SI numbers, as summary.json has it
    units : of the quantities that 3D has, by name
    times : (n,) s, ascending; None in the steady state
    parameters, outputs : of the scene's [model]: values (SI), and the model's own names of quantities
    """

    name: str
    document: Mapping[str, object]
    units: Mapping[str, str]
    times: NDArray[np.float64] | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)

    @property
    def when(self) -> str:
        return "in the steady state" if self.times is None else "over time"


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


class Model(ABC):
    """A 1D or lumped model of a scene; ``exact`` models repeat their answers to rounding."""

    name: str
    exact = False

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r})"

    @abstractmethod
    def answer(self, question: Question) -> Answer:
        """Return the values at the question's times, or at own rows up to the last of these.

        Raises SceneError, before which `sampling.ask` puts the name of the model.
        """


def run_twice(run: Callable[[int], tuple[NDArray[np.float64], Mapping[str, NDArray[np.float64]]]]) -> Answer:
    """Return the finer of two runs, of at least so many steps each, with an error by their difference."""
    (coarse_time, coarse), (time, fine) = map(run, STEPS)
    # A jump of an output takes a whole step here: the two runs differ most at the end of the short step, by all
    # but its part of the long one, and right after the jump the short one is off by all of it.
    share = STEPS[1] / (STEPS[1] - STEPS[0])
    errors = {
        name: share * float(np.abs(v - np.interp(time, coarse_time, coarse[name])).max()) for name, v in fine.items()
    }
    return Answer(fine, errors, time)


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


def match_outputs(
    noun: str, outputs: Mapping[str, str], wanted: Collection[str], own: Collection[str]
) -> dict[str, str]:
    """Return the model's own name of each wanted probe that it has: of the scene's ``outputs``, or alike.

    Raises SceneError where it has none of them, or not the given one; ``noun`` is the kind of its names.
    """
    plain = {plain_name(name): name for name in own}
    alike = {probe: plain[plain_name(probe)] for probe in wanted if plain_name(probe) in plain}
    found = alike | {probe: name for probe, name in outputs.items() if probe in wanted}
    for probe, name in found.items():
        if name not in own:
            raise unknown(f"for {quoted(probe)} it has no {noun}", name, own)
    if not found:
        has = listed(sorted(own)) if own else "none"
        raise SceneError(
            f'it has no {noun} called as a probe ({", ".join(wanted)}), but {has}: say [model.outputs] probe = "name"'
        )
    return found
