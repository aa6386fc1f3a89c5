"""A scene through the free engine, next to what it should give: rows of steady values and of traces at instants."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fem3d import solve_scene
from scenes.model import Scene
from scenes.result import Result
from validate.verify.rows import Row

ACCURACY = 1e-4  # asked of the solver
SETTLED = 1e-4  # of the scale: the largest estimated error with which an exact case counts as settled


@dataclass(frozen=True)
class Expected:
    """What a probe should read: a number or, for a transient, one per output time, in ``unit`` (temperatures in K).

    ``scale`` is what errors are measured against: the largest rise, flow or current. ``unsure`` is how far the
    expected value may be off itself: rounding of a printed one, the approximation in a scene. ``settled`` is the part
    of the scale that the estimated error may reach; ``None`` for any.
    """

    probe: str
    unit: str
    value: float | np.ndarray
    scale: float
    unsure: float = 0.0
    name: str = ""
    settled: float | None = SETTLED
    note: str = ""


def rows(family: str, case: str, scene: Scene, expected: Sequence[Expected], note: str = "") -> Iterator[Row]:
    """Solves the scene and compares; of a trace the row shows the instant that is furthest off."""
    yield from compare(family, case, solve_scene.solve(scene), scene, expected, note)


def compare(
    family: str, case: str, result: Result, scene: Scene, expected: Sequence[Expected], note: str = ""
) -> Iterator[Row]:
    """The rows of a result that is there already."""
    for each in expected:
        values = np.atleast_1d(np.asarray(each.value, dtype=float))
        if scene.steady:
            estimate = result.steady[each.probe]
            found, error = np.array([estimate.value]), estimate.error
        else:
            assert result.traces is not None
            found = np.interp(scene.output_times, result.traces.time, result.traces.values[each.probe])
            error = result.traces.errors[each.probe]
        worst = int(np.abs(found - values).argmax())
        limit = None if each.settled is None else each.settled * each.scale + each.unsure
        yield Row(
            family, case, each.name or each.probe, each.unit, float(values[worst]), float(found[worst]),
            error + each.unsure, limit, each.note or note, len(values),
        )  # fmt: skip
