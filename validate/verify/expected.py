"""Rows of the table of `validate verify`: probes of scenes beside their expected values, and orders of convergence."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.rows import Row
from fem3d.runs.scene import solve
from scenes.model import UNITS, Scene

ORDER_TOLERANCE = 0.1  # between an observed order and theory
ACCURACY = 1e-4  # of the solver
SETTLED = 1e-4  # of the scale: the largest error bound with which an exact case is settled


@dataclass(frozen=True)
class Expected:
    """The expected value of a probe.

    Attributes
    ----------
    probe : name in the scene
    value : a number in SI units, or for a transient one for each output time
    scale : the largest rise, flow or current; by default of the value
    unsure : error of the value itself: rounding of a printed number, straight lines in place of a sine
    name : of the row, where it is not the probe's
    settled : part of the scale that the error bound may reach; None for any
    note : the source, where it differs from the source of the case
    """

    probe: str
    value: float | np.ndarray
    scale: float | None = None
    unsure: float = 0.0
    name: str = ""
    settled: float | None = SETTLED
    note: str = ""


def rows(group: str, case: str, scene: Scene, expected: Sequence[Expected], note: str = "") -> Iterator[Row]:
    """Solve a scene and yield a row for each expected value; of a trace, the instant that is furthest off."""
    result, units = solve(scene), {probe.name: UNITS[probe.quantity] for probe in scene.probes}
    for each in expected:
        values = np.atleast_1d(np.asarray(each.value, dtype=float))
        if result.traces is None:
            found, error = np.array([result.steady[each.probe].value]), result.steady[each.probe].error
        else:
            found = np.interp(scene.output_times, result.traces.time, result.traces.values[each.probe])
            error = result.traces.errors[each.probe]
        worst = int(np.abs(found - values).argmax())
        name = each.name or each.probe
        scale = float(np.abs(values).max()) if each.scale is None else each.scale
        settled = None if each.settled is None else each.settled * scale + each.unsure
        name = f"{name}, worst of {len(values)}" if len(values) > 1 else name
        yield Row(group, case, name, float(found[worst]), float(values[worst]), error + each.unsure,
                  units[each.probe], settled=settled, note=each.note or note)  # fmt: skip


def order_row(
    group: str, case: str, quantity: str, theory: float, observed: float, note: str = "", at_least: bool = False
) -> Row:
    """Return an observed order of convergence beside the theoretical one, which may be a lower limit."""
    return Row(group, case, f"order of {quantity}", observed, theory, ORDER_TOLERANCE, note=note,
               relation="at least" if at_least else "near")  # fmt: skip


def observed_order(errors: Sequence[float], ratio: float) -> float:
    """Return the order from two errors (coarse, fine) on meshes or with steps whose sizes have a ratio above 1."""
    coarse, fine = errors
    return math.log(coarse / fine) / math.log(ratio) if coarse > 0 and fine > 0 else math.nan
