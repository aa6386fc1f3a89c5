"""Extrapolate readings in the polynomial degree, and bound the deviation.

On one mesh the error beside an edge of exponent s falls like p^-4s with the degree p (Gui and Babuska, Numer. Math. 49,
1986), with a factor that keeps its sign. So later degrees move a reading further in the same direction. The exponent s
gives the ratio to its last change; energies are extrapolated likewise (Szabo and Babuska, Finite Element Analysis,
Wiley 1991, section 4.3). Each cell has its own exponent, and its own dual-weighted contribution to the change.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fem3d.adaptivity.estimator import Contributions, Estimator
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.results.study import Study


def known(study: Study, given: Problems) -> bool:
    """Return whether quantities are extrapolated: not where a study wants the fields' own values, nor where a law of
    the temperature causes errors away from edges."""
    return study.extrapolated and not given.follows and given.heat.about is None


def extrapolated(
    study: Study,
    given: Problems,
    fine: Solution,
    low: Solution,
    scales: Mapping[str, float],
    heat: Mapping[str, Contributions],
    current: Mapping[str, Contributions],
    estimator: Estimator,
) -> tuple[Solution, dict[str, float]]:
    """Return the fine solution with extrapolated quantities, and the largest deviation of each, in its unit.

    Where quantities are not extrapolated (`known`), return the solution as it is, and the largest change by later
    degrees, at least the change by the last one. ``heat`` and ``current`` as for `changes`.
    """
    values = fine.quantities
    expected, doubts = changes(fine, low, scales, heat, current, given.electric_parts, estimator)
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
    estimator: Estimator,
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the change of each quantity expected from later degrees, and its largest deviation, in its unit.

    ``heat`` and ``current`` are the contributions of the last degree to the goals on each cell, relative to the scales.
    The rest of a change comes by way of other quantities, and continues like all contributions together, including
    the contributions to the ``power``.
    """
    kinds = (heat, False), (current, True)
    every = [(parts.last, electric) for of_goals, electric in kinds for parts in of_goals.values()] + [
        (power.last, True)
    ]
    sizes = [(np.sum(last, axis=0), electric) for last, electric in every]
    together = np.sum([[*estimator.later(size, electric), size.sum()] for size, electric in sizes], axis=0)
    mean, mean_doubt = together[:2] / max(together[2], 1e-300)
    expected, doubts = dict[str, float](), dict[str, float]()
    for name, value in fine.quantities.items():
        other = float(value - low.quantities[name])
        expected[name] = doubts[name] = 0.0
        for of_goals, electric in kinds:
            if name in of_goals:
                signed = of_goals[name].signed * scales[name]
                other -= float(signed.sum())
                change, doubt = estimator.later(signed, electric)
                expected[name] += change
                doubts[name] += doubt
        expected[name] += mean * other
        doubts[name] += mean_doubt * abs(other)
    return expected, doubts
