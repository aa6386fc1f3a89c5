"""What degrees after the last one will change of readings, and what is not known of that.

On one mesh what degree p leaves of an error beside an edge of exponent s falls like p^-4s (Gui and Babuska, Numer.
Math. 49, 1986), with a factor that keeps its sign. So a reading goes on where the last degree moved it to, by a known
multiple of that: an extrapolation in the degree, as is common with energies (Szabo and Babuska, Finite Element
Analysis, Wiley 1991, section 4.3). Each cell has its own exponent, and its own dual-weighted part of the change.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fem3d.adaptivity.estimator import Contributions, Estimator
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.results.study import Study


def known(study: Study, given: Problems) -> bool:
    """Whether quantities are to have what later degrees change of them: not those that are to be the fields' own, nor
    where a law of the temperature makes errors that edges don't."""
    return study.extrapolated and not given.follows and given.heat.about is None


def extrapolated(
    study: Study,
    given: Problems,
    fine: Solution,
    low: Solution,
    scales: Mapping[str, float],
    heat: Mapping[str, Contributions],
    current: Mapping[str, Contributions],
    judge: Estimator,
) -> tuple[Solution, dict[str, float]]:
    """The fine solution with quantities that have what later degrees are expected to change of them, where that is
    `known`, and how far they may be off; elsewhere as it is, and by how much it may change at most, at least as much as
    the last degree changed. ``heat`` and ``current`` as of `changes`."""
    values = fine.quantities
    expected, doubts = changes(fine, low, scales, heat, current, given.electric_parts, judge)
    if known(study, given):
        return replace(fine, quantities={name: value + expected[name] for name, value in values.items()}), doubts
    changed = {name: abs(float(value - low.quantities[name])) for name, value in values.items()}
    return fine, {name: max(doubt + abs(expected[name]), changed[name]) for name, doubt in doubts.items()}


def changes(
    fine: Solution,
    low: Solution,
    scales: Mapping[str, float],
    heat: Mapping[str, Contributions],
    current: Mapping[str, Contributions],
    power: Contributions,
    judge: Estimator,
) -> tuple[dict[str, float], dict[str, float]]:
    """Of each quantity, in its unit, what later degrees are expected to change, and by how much more or less they may:
    of goals by what ``heat`` and ``current`` changed of them on each cell (relative to the scales). What of a change
    came by way of other quantities goes on as all parts together do, those of the ``power`` among them."""
    kinds = (heat, False), (current, True)
    every = [(parts.last, electric) for of_goals, electric in kinds for parts in of_goals.values()] + [
        (power.last, True)
    ]
    sizes = [(np.sum(last, axis=0), electric) for last, electric in every]
    together = np.sum([[*judge.later(size, electric), size.sum()] for size, electric in sizes], axis=0)
    mean, mean_doubt = together[:2] / max(together[2], 1e-300)
    expected, doubts = dict[str, float](), dict[str, float]()
    for name, value in fine.quantities.items():
        other = float(value - low.quantities[name])
        expected[name] = doubts[name] = 0.0
        for of_goals, electric in kinds:
            if name in of_goals:
                signed = of_goals[name].signed * scales[name]
                other -= float(signed.sum())
                change, doubt = judge.later(signed, electric)
                expected[name] += change
                doubts[name] += doubt
        expected[name] += mean * other
        doubts[name] += mean_doubt * abs(other)
    return expected, doubts
