"""Pick the rows of a file that are the run of the scene.

A sweep has its runs below one another with a column for each parameter; the run has the scene's parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from compare.data.columns import Column
from compare.data.match import Target
from scenes.errors import SceneError
from scenes.varied import varied


@dataclass
class Run:
    """The rows of a run.

    Attributes
    ----------
    rows : (file's rows,) whether a row belongs to the run
    words : the run in words
    notes : why rows are left out
    curve : of a curve of steady states the value in words and the scene of each row
    """

    rows: np.ndarray
    words: str = ""
    notes: list[str] = field(default_factory=list)
    curve: list[tuple[str, Any]] = field(default_factory=list)


def pick(time: np.ndarray, parameters: Sequence[Column], filled: np.ndarray, target: Target) -> Run:
    """Return the run of the scene. Raises SceneError where there is none, or several that no key tells apart.

    Parameters
    ----------
    time : (rows,) s, NaN in rows to leave out, zeros without times
    parameters : columns of keys in SI units
    filled : (rows,) whether a row has a value of the steady state
    """
    run, steady = Run(np.isfinite(time)), target.quantities.steady
    if not run.rows.all():
        run.notes.append(f"{(~run.rows).sum()} rows without one are left out")
    curve = next((p for p in parameters if p.is_curve), None)
    _choose(run, [p for p in parameters if p is not curve], target)
    if curve is not None:
        _take_curve(run, curve, target)
        return run
    run.rows &= filled | (not steady)
    kept, is_one = np.flatnonzero(run.rows), count_runs(time[run.rows]) == 1
    if steady and is_one and (len(kept) == 1 or np.ptp(time[kept]) > 0):
        last = kept == kept[-1]
        note = f"the last of {len(kept)} rows with numbers is taken for the steady state"
    elif not steady and is_one:
        last = np.append(np.diff(time[kept]) > 0, True)
        note = f"{(~last).sum()} of them twice, the second row is taken"
    else:
        problem = f"it has {len(kept)} rows where the scene has one steady state"
        if not steady:
            problem = "its times repeat or step back, as those of several runs or of too few digits do"
        raise SceneError(f"{problem}: export one run, or name the column of a key of the scene, --column KEY=COLUMN")
    run.rows[kept[~last]] = False
    run.notes += [note] * (not last.all())
    return run


def count_runs(time: np.ndarray) -> int:
    """Return how often times start again, and once more; at an event a solver stores a time twice, before and after."""
    steps = np.diff(time[np.isfinite(time)])
    is_one = (steps >= 0).all() and 2 * (steps == 0).sum() <= (steps > 0).sum()
    return 1 if is_one else 1 + int((steps <= 0).sum())


def _choose(run: Run, parameters: Sequence[Column], target: Target) -> None:
    """Keep the rows at which all parameters are the scene's to the digits of a table."""
    said, given = [], run.rows
    for p in parameters:
        value, values = target.numbers[p.role].value, p.si[given]
        run.rows = run.rows & np.isclose(p.si, value, rtol=1e-4, atol=1e-15)
        others = f" of {_listed(values, p, target)}" if len(np.unique(values)) > 1 or not run.rows.any() else ""
        said.append(f"{p.plain} = {target.show(p.role, value)} ({p.role}){others}")
    if said:
        run.words = f"the run at {', '.join(said)}"
    if said and not run.rows.any():
        first = parameters[0]
        other = target.show(first.role, float(first.si[given][0])).replace(" ", "")
        raise SceneError(
            f"it has no run of this scene, {', '.join(said)}: export that run, or set the scene: "
            f'--set {first.role}={other} (--column "ignore={first.plain}" where it is no such parameter)'
        )


def _take_curve(run: Run, curve: Column, target: Target) -> None:
    """Keep the rows of a curve with their scenes. A scene without a drive is refused: 3D has no solution at zero."""
    if not target.quantities.steady:
        raise SceneError(f"a curve over {curve.plain} is one of steady states: give --steady")
    if not (now := target.numbers[curve.role].value):
        raise SceneError(f"{curve.role} is 0 in the scene: give it another value for a curve")
    run.rows = run.rows & (curve.si != 0)
    for value in curve.si[run.rows].tolist():
        words = f"{curve.role} = {target.show(curve.role, value)}"
        run.curve.append((words, varied(target.scene, curve.role, value / now)))
    run.words = "; ".join(filter(None, (run.words, f"the curve over {curve.plain} ({curve.role}), without its zeros")))


def _listed(values: np.ndarray, parameter: Column, target: Target) -> str:
    """The distinct values of a parameter in words."""
    shown = [target.show(parameter.role, value) for value in dict.fromkeys(values.tolist())]
    return ", ".join(shown[:12]) + (f" and {len(shown) - 12} more" if len(shown) > 12 else "")
