"""The ratio of estimates to errors from earlier meshes (`fem3d.adaptivity.effectivity`)."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fem3d.adaptivity.effectivity import LEAST, corrected
from fem3d.adaptivity.goal_errors import Level, Record

TRUE = {"a": 10.0, "b": -3.0}


def level(estimates: dict[str, float], fractions: dict[str, float], least: float = 0.0) -> Level:
    """A level whose readings are wrong by given fractions of their estimates, and have at ``least`` that error."""
    values = {n: TRUE[n] + fractions[n] * e for n, e in estimates.items()}
    fine: Any = SimpleNamespace(quantities=values)
    problems: Any = None
    goals = {n: [np.full(4, e / 4)] for n, e in estimates.items()}
    return Level(problems, fine, fine, dict.fromkeys(TRUE, 1.0), estimates, goals, dict.fromkeys(TRUE, least))


class Search:
    """Levels, each corrected by the levels before."""

    def __init__(self) -> None:
        self.history: list[Record] = []

    def corrected(self, level: Level) -> Level:
        found = corrected(level, self.history)
        assert found.record is not None
        self.history.append(found.record)
        return found


@pytest.mark.parametrize("fraction", [0.25, 0.5, -0.5])
def test_an_error_is_the_fraction_that_readings_tell(fraction: float) -> None:
    """Of two readings the worse counts for both; one alone is trusted less."""
    told, fractions = Search(), {"a": fraction, "b": 0.01}
    first = told.corrected(level({"a": 0.8, "b": 0.4}, fractions))
    assert first.errors == {"a": 0.8, "b": 0.4}
    for size in (0.3, 0.1):
        estimates = {"a": 0.8 * size, "b": 0.4 * size}
        after = told.corrected(level(estimates, fractions))
        part = min((1 + 0.5**0.5) * abs(fraction), 1.0)
        assert after.errors == pytest.approx({n: part * e for n, e in estimates.items()}, rel=1e-9)
        assert after.goals["a"][0].sum() == pytest.approx(part * estimates["a"], rel=1e-9)
        # Wrong by its whole estimate it would be outside: the bound holds the error, and half of the bound does not.
        true = abs(fraction) * estimates["a"]
        assert 0.5 * after.errors["a"] < true < after.errors["a"]


@pytest.mark.parametrize(
    ("second", "fractions"),
    [
        ({"a": 0.4, "b": 0.2}, {"a": 0.9, "b": 0.1}),  # an estimate is hardly larger than the error
        ({"a": 0.9, "b": 0.2}, {"a": 0.3, "b": 0.3}),  # an estimate that doesn't fall says nothing good
    ],
)
def test_estimates_stay_where_meshes_tell_nothing_better(second: dict[str, float], fractions: dict[str, float]) -> None:
    told = Search()
    told.corrected(level({"a": 0.8, "b": 0.4}, fractions))
    assert told.corrected(level(second, fractions)).errors == second


def test_a_reading_that_moves_by_more_than_its_estimate_falls_is_wrong_by_more() -> None:
    """Means and estimates on four meshes of a gold pad that hangs over the end of a steel plate, which is held at a
    temperature: the edge has an exponent of 0.1, and the estimate believes in 1/4. The limit of the mean is NGSolve's
    on meshes halved eight times along the edge. The other reading is as it was."""
    told, scale, limit = Search(), 0.228, 0.0723
    for mesh, (mean, estimate) in enumerate(
        ((0.050036, 0.056), (0.053979, 0.0335), (0.056169, 0.0268), (0.057697, 0.0252))
    ):
        true = (limit - mean) / scale
        stated = told.corrected(level({"a": estimate, "b": 0.1 * estimate}, {"a": true / estimate, "b": 0.2})).errors
        assert stated["b"] == pytest.approx(0.1 * estimate)
        if mesh >= 2:
            assert estimate < true < stated["a"] < 2 * true


def test_one_reading_alone_is_trusted_less() -> None:
    told, fractions = Search(), {"a": 0.25, "b": 0.0}
    for size in (1.0, 0.3):
        after = told.corrected(level({"a": 0.8 * size, "b": 0.4 * size}, fractions))
    assert after.errors["a"] == pytest.approx(2 * 0.25 * 0.8 * 0.3)


def test_a_reading_that_meshes_were_not_refined_for_is_as_estimated() -> None:
    """The heat into a side of a plate, whose estimate a second mesh hardly made smaller: a quarter, by the other
    readings, was 1.38 times too little."""
    told, hardly = Search(), {"a": 0.1, "b": 0.0}
    told.corrected(level({"a": 0.8, "b": 3.4e-4}, hardly))
    after = told.corrected(level({"a": 0.2, "b": 2.8e-4}, hardly))
    assert after.errors["b"] == 2.8e-4
    assert after.errors["a"] < 0.1


def test_what_an_estimate_fell_to_before_the_last_mesh_tells_nothing() -> None:
    """One that fell once, and not on the last mesh: a part, by the other reading, was 2.9 times too little
    (random scene 7 with laws and contacts, on tetrahedra)."""
    told, fractions = Search(), {"a": 0.1, "b": 0.0}
    told.corrected(level({"a": 0.8, "b": 4e-3}, fractions))
    told.corrected(level({"a": 0.4, "b": 1.8e-3}, fractions))
    after = told.corrected(level({"a": 0.1, "b": 1.7e-3}, fractions))
    assert after.errors["b"] == pytest.approx(1.7e-3)
    assert after.errors["a"] < 0.1


def test_no_error_is_below_what_the_last_degree_leaves_or_the_least_part() -> None:
    """Readings that are right by chance give little information, and rounding none."""
    hardly = {"a": 1e-3, "b": 0.0}
    for last, stated in ((0.0, LEAST * 0.4), (0.3, 0.3)):
        told = Search()
        told.corrected(level({"a": 0.8, "b": 1e-11}, hardly))
        assert told.corrected(level({"a": 0.4, "b": 2e-11}, hardly, last)).errors["a"] == pytest.approx(stated)
