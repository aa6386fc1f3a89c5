"""True errors against estimates from three nested degrees, where every second degree adds nothing by symmetry."""

import pytest

from fem3d.adaptivity import goal_errors, nested
from fem3d.adaptivity.estimator import Estimator
from fem3d.runs import probe_quantities
from fem3d.spaces.domain import boxes
from meshes import grading
from tests.fem3d import bar, bar_grid, end, silicon, whole


def middle(voltage, intervals, degree):
    """Return the true and the estimated error at the middle of a Joule-heated bar that symmetry does not reduce."""
    cold = end(0, "temperature", 293.0), end(1, "temperature", 293.0)
    scene = bar(silicon(2e-3), *cold, end(0, "voltage", voltage), end(1, "voltage", 0.0))
    study, marks = probe_quantities.study(scene, whole(scene)), grading.features(scene)
    judge = Estimator.of_grid(bar_grid(scene, intervals, degree), marks)

    def solved(intervals, degree):
        given = nested.problems(boxes(scene, bar_grid(scene, intervals, degree)), 1e-6)
        return given, nested.solution(study, given)

    given, fine = solved(intervals, degree)
    best = solved(4, 8)[1].quantities["middle"]
    level = goal_errors.examined(study, given, fine, judge)
    return abs(float(fine.quantities["middle"] - best)), level.errors["middle"]


@pytest.mark.parametrize("voltage", [2.0, 9.0])
@pytest.mark.parametrize(("intervals", "degree"), [*((1, p) for p in range(2, 8)), *((3, p) for p in range(4, 7))])
def test_error_at_top_of_symmetric_rise_is_bounded(voltage, intervals, degree):
    true, estimated = middle(voltage, intervals, degree)
    assert true <= estimated
