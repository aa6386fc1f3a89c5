"""Pick the rows of a file that are the run of the scene.

A sweep has its runs below one another with a column for each parameter; the run has the scene's parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from compare.data.columns import Column
from compare.data.match import Target
from scenes.errors import SceneError
from scenes.formats import cut
from scenes.varied import varied


def count_runs(time: np.ndarray) -> int:
    """Return how often times start again, and once more; at an event a solver stores a time twice, before and after."""
    steps = np.diff(time)
    is_one = (steps >= 0).all() and 2 * (steps == 0).sum() <= (steps > 0).sum()
    return 1 if is_one else 1 + int((steps <= 0).sum())


def choose(parameters: Sequence[Column], rows: np.ndarray, target: Target) -> tuple[np.ndarray, str]:
    """Return at which of some rows all parameters are the scene's to the digits of a table, and the run in words.

    Raises SceneError where there is no such row.
    """
    said = []
    for p in parameters:
        value = target.numbers[p.role].value
        rows = rows & np.isclose(p.si, value, rtol=1e-4, atol=1e-15)
        values = dict.fromkeys(target.show(p.role, value) for value in p.si.tolist())
        others = f" of {cut(', '.join(values), 120)}" if len(values) > 1 or not rows.any() else ""
        said.append(f"{p.plain} = {target.show(p.role, value)} ({p.role}){others}")
    if not rows.any():
        first = parameters[0]
        other = target.show(first.role, float(first.si[0])).replace(" ", "")
        raise SceneError(
            f"it has no run of this scene, {', '.join(said)}: export that run, or set the scene: "
            f'--set {first.role}={other} (--column "ignore={first.plain}" where it is no such parameter)'
        )
    return rows, f"the run at {', '.join(said)}" * bool(said)


def keep_one(time: np.ndarray, rows: np.ndarray, steady: bool) -> tuple[np.ndarray, str]:
    """Return the rows of one run at ascending times, or the last one for the steady state, and a note.

    Raises SceneError for rows of several runs or states.
    """
    kept = np.flatnonzero(rows)
    last, note = kept == kept[-1:], f"the last of {len(kept)} rows with numbers is taken for the steady state"
    if not steady:
        last = np.append(np.diff(time[kept]) > 0, True)
        note = f"{(~last).sum()} of them twice, the second row is taken"
    if count_runs(time[kept]) > 1:
        problem = f"it has {len(kept)} rows where the scene has one steady state"
        if not steady:
            problem = "its times repeat or step back, as those of several runs or of too few digits do"
        raise SceneError(f"{problem}: export one run, or name the column of a key of the scene, --column KEY=COLUMN")
    return np.isin(np.arange(len(time)), kept[last]), note * (not last.all())


def vary(curve: Column, rows: np.ndarray, target: Target) -> list[tuple[str, Any]]:
    """Return the value in words and the scene of each row of a curve. Raises SceneError."""
    if not target.quantities.steady:
        raise SceneError(f"a curve over {curve.plain} is one of steady states: give --steady")
    if not (now := target.numbers[curve.role].value):
        raise SceneError(f"{curve.role} is 0 in the scene: give it another value for a curve")
    return [
        (f"{curve.role} = {target.show(curve.role, value)}", varied(target.scene, curve.role, value / now))
        for value in curve.si[rows].tolist()
    ]
