"""How the quantities of a sink follow its keys, in 3D: steady and over time, from a run that is there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

from fem3d import sensitivity, sensitivity_over_time, sink_quantities
from fem3d.motion import Given
from fem3d.sensitivity import Table
from fem3d.sensitivity_over_time import Course
from meshes import symmetry
from meshes.symmetry import Symmetry
from scenes.result import Result
from scenes.sink import Sink
from scenes.varied import numbers, varied


@dataclass(frozen=True)
class Slopes:
    """d ln quantity / d ln key, by key and quantity: ``steady`` with errors, and the ``course`` of the traces (of
    rises, for temperatures) where the run has them; ``left_out`` says why a key has none."""

    steady: Table
    course: Course | None
    left_out: dict[str, str] = field(default_factory=dict)


def of_sink(sink: Sink, result: Result, instants: Sequence[float] = (), keys: Sequence[str] | None = None) -> Slopes:
    """The derivatives of a result of `fem3d.run.solve` by every physical key whose value is a number other than zero;
    those of the traces at some ``instants`` (s) too. ``keys`` are these alone. Raises ConvergenceError."""
    answer = result.details["answer"]
    state, response = answer.fine.state, answer.response
    study = sink_quantities.study(sink, symmetry.reduce(sink.scene()))
    given = Given.of(state.heat.domain)
    others = {key: partial(_part, varied(sink, key, 1 + sensitivity.STEP)) for key in keys or numbers(sink)}
    by, left_out = sensitivity.motions(study, given, others)
    steady, _ = sensitivity.steady_table(study, state, sensitivity.Known(result.steady, {}), given, by)
    course = None
    if response is not None:
        course = sensitivity_over_time.over_time(study, response.transient, by, steady, instants)
    return Slopes(steady, course, left_out)


def _part(sink: Sink) -> Symmetry:
    return symmetry.reduce(sink.scene())
