"""The interface of all 1D and lumped models: a question about a scene, and the answer of a model."""

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.errors import SceneError, listed, quoted, unknown
from scenes.free import as_dict
from scenes.loading import as_dict as parametric_as_dict
from scenes.model import AnyScene
from scenes.result import Traces
from scenes.sink import Sink

LONGEST = 600.0
"""s by the clock that a model may take for one answer; 3D itself takes minutes at most."""
STEPS = (500, 2000)
"""The least number of steps of the two runs of a simulation, each with a relative tolerance of 0.01 over that."""


@dataclass(frozen=True)
class Question:
    """A scene as a model sees it.

    Attributes
    ----------
    scene : a sink or a free scene
    units : of the quantities that 3D has, by name
    times : (n,) s, ascending; None in the steady state
    parameters, outputs : of the scene's [model]: values (SI), and the model's own names of quantities
    """

    scene: AnyScene | Sink
    units: Mapping[str, str]
    times: NDArray[np.float64] | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)

    @property
    def when(self) -> str:
        return "in the steady state" if self.times is None else "over time"

    @property
    def document(self) -> dict[str, object]:
        """The scene in SI numbers, as summary.json has it."""
        document = parametric_as_dict(self.scene) if isinstance(self.scene, Sink) else as_dict(self.scene)
        if self.parameters:
            document["model"]["parameters"] = self.parameters
        return document


@dataclass(frozen=True)
class Model:
    """A 1D or lumped model of a scene.

    Attributes
    ----------
    name : in reports
    answer : the function of the values at a question's times, or at own rows up to the last of these
    exact : whether answers repeat to rounding

    Notes
    -----
    The answer to a question about the steady state is one row at infinite time. Some values may have an error. The
    function raises SceneError, before which `sampling.ask` puts the name of the model.
    """

    name: str
    answer: Callable[[Question], Traces]
    exact: bool = False


def run_twice(run: Callable[[int], Traces]) -> Traces:
    """Return the finer of two runs, of at least so many steps each, with an error by their difference."""
    coarse, fine = map(run, STEPS)
    # A jump of an output takes a whole step here: the two runs differ most at the end of the short step, by all
    # but its part of the long one, and right after the jump the short one is off by all of it.
    share = STEPS[1] / (STEPS[1] - STEPS[0])
    off = {name: v - np.interp(fine.time, coarse.time, coarse.values[name]) for name, v in fine.values.items()}
    return replace(fine, errors={name: share * float(np.abs(each).max()) for name, each in off.items()})


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
