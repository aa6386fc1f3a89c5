"""Correct error bounds by the effectivity that earlier meshes show.

On cells of any shape an error bound adds absolute contributions and allows for slow rates: it holds, and is often
ten times the error. The next mesh shows by how much. Let errors be the same fraction i of their estimates E on both
meshes (the inverse of the effectivity index of Ainsworth and Oden, A Posteriori Error Estimation in Finite Element
Analysis, Wiley 2000): then a reading moves from one mesh to the other by i times the difference of the estimates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fem3d.adaptivity.goal_errors import Level, Record

# An error is stated as 1 + n^(-1/2) times the largest fraction i of any of n readings, because one reading may be right
# by chance, but not below this fraction of its estimate. Of 37 random plates, combs and stacks with vias no error is
# above 0.67 of this bound on a later mesh, against finer meshes.
LEAST = 0.25
# Errors of extrapolated readings are at most AS_IT_IS of their estimates, and CAUTION times their doubt where the
# estimate fell on the last mesh: none of 46 random plates, Gmsh meshes and stacks exceeds 0.70 of this bound.
AS_IT_IS, CAUTION = 0.5, 1.25
ROUNDING = 1e-8  # relative: smaller errors, and readings that move less, show rounding alone
# A reading that moves by more than its estimate falls is wrong by more than estimated. Its bound is then twice its
# fraction, where the estimate fell to this part or less: by less it may fall by chance.
FELL = 0.8


def corrected(level: Level, history: Sequence[Record]) -> Level:
    """Return a level with errors and indicators corrected by the ``history`` of earlier meshes.

    No error is below ``level.least``, nor below its estimate where this is no smaller than on the mesh before, which
    was then refined for other readings.
    """
    values = {name: float(value) for name, value in level.fine.quantities.items()}
    least = {n: level.least.get(n, 0.0) for n in level.errors}
    record = Record(values, level.errors, level.scales, least)
    part, larger = _fractions(record, history)
    fell = {n for before in history[-1:] for n, e in before.errors.items() if level.errors[n] <= FELL * e}
    most = _cautious(record, history) if level.extrapolated else {}
    whole = AS_IT_IS if level.extrapolated else 1.0
    smaller = {n: min(part * e, most.get(n, np.inf)) if n in fell else np.inf for n, e in level.errors.items()}
    errors = {
        n: max(min(e, max(min(smaller[n], whole * e), least[n])), larger.get(n, 0.0) * e)
        for n, e in level.errors.items()
    }
    parts = {n: max(part, larger.get(n, 0.0)) for n in level.goals}
    parts |= {n: min(parts[n], errors[n] / e) for n, e in level.errors.items() if n in parts and e > 0}
    goals = {n: [parts[n] * indicator for indicator in spread] for n, spread in level.goals.items()}
    return replace(level, errors=errors, goals=goals, record=record)


def _cautious(now: Record, history: Sequence[Record]) -> dict[str, float]:
    """Return `CAUTION` times the doubt of each extrapolated reading, more where any moved by more than both doubts."""
    if not history:
        return {}
    before = history[-1]
    moved = [
        abs(now.values[n] - v) / max(before.least[n] + now.least[n], 1e-300) for n, v in before.values.items()
    ]  # fmt: skip
    return {n: CAUTION * max([1.0, *moved]) * doubt for n, doubt in now.least.items()}


def _fractions(now: Record, history: Sequence[Record]) -> tuple[float, Mapping[str, float]]:
    """Return the fraction of each estimate that is stated, and a factor above 1 for readings with larger errors."""
    fractions, larger = dict[str, float](), dict[str, float]()
    for before in history:
        for n, estimate in before.errors.items():
            moved, after, rounding = abs(now.values[n] - before.values[n]), now.errors[n], ROUNDING * before.scales[n]
            if min(estimate, moved) > rounding and after > ROUNDING * now.scales[n]:
                fraction = moved / max(estimate - after, 1e-300)
                fractions[n] = max(fractions.get(n, 0.0), fraction)
                if fraction > 1 and after <= FELL * estimate:
                    larger[n] = max(larger.get(n, 0.0), 2 * fraction)
    if not fractions:
        return 1.0, larger
    return min(max((1 + len(fractions) ** -0.5) * max(fractions.values()), LEAST), 1.0), larger
