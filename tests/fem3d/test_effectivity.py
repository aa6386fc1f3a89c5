"""The ratio of estimates to errors from earlier meshes (`fem3d.adaptivity.cell_mesh`)."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fem3d.adaptivity.cell_mesh import corrected
from fem3d.adaptivity.goal_errors import Level, Record


def level(values: dict[str, float], estimates: dict[str, float]) -> Level:
    """Return a level with these values and estimates of their errors."""
    fine: Any = SimpleNamespace(quantities=values)
    problems: Any = None
    goals = {n: [np.full(4, e / 4)] for n, e in estimates.items()}
    nothing = dict.fromkeys(values, 0.0)
    return Level(problems, fine, fine, dict.fromkeys(values, 1.0), estimates, goals, nothing)


def test_value_that_moves_more_than_estimated_gets_larger_bound():
    """Means and estimates on four meshes of a gold pad that hangs over the end of a steel plate, which is held at a
    temperature: the edge has an exponent of 0.1, and the estimate assumes 1/4. NGSolve gives the limit of the mean on
    meshes halved eight times along the edge. The second value converges as estimated."""
    history: list[Record] = []
    scale, limit = 0.228, 0.0723
    meshes = ((0.050036, 0.056), (0.053979, 0.0335), (0.056169, 0.0268), (0.057697, 0.0252))
    for mesh, (mean, estimate) in enumerate(meshes):
        true = (limit - mean) / scale
        given = level({"a": 10.0 + true, "b": -3.0 + 0.02 * estimate}, {"a": estimate, "b": 0.1 * estimate})
        found = corrected(given, history)
        history.append(found.record)
        assert found.errors["b"] == pytest.approx(0.1 * estimate)
        if mesh >= 2:
            assert estimate < true < found.errors["a"] < 2 * true
