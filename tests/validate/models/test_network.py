"""The network as a model: judged like any other, with errors, and without code that a scene could bring."""

from __future__ import annotations

import math

import numpy as np
import pytest

import compare
from compare.probes import bends
from scenes.errors import SceneError
from validate import models


def test_the_bridge_is_judged() -> None:
    found = compare.solve("bridge", model="network")
    checks = found.checks
    assert set(checks) == {"middle", "beam mean", "current", "heat to the substrate", "quarter"}
    for check in checks.values():
        # By hand, 0.5 % of what 3D says, and known far better than that.
        assert check.verdict == "agrees"
        assert abs(check.difference) < 5e-3
        assert check.u_num < 1e-3
    assert checks["middle"].difference > checks["middle"].u_num


def test_it_runs_no_code_of_anybody() -> None:
    assert not models.runs_code("network")
    with pytest.raises(SceneError, match="network, or scene for the scene's own"):
        models.kind_of("netwerk")


def test_rows_just_before_a_jump_bend_nothing() -> None:
    """3D has a row a billionth of the run before a jump: no straight line there is off by what the jump is."""
    time = np.array([0.0, 1.0, 2.0, 2.0 + 4e-9, 3.0, 4.0])
    values = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    assert bends(time, values).max() == 0.0
    assert math.isfinite(bends(time, values).sum())
    assert bends(np.delete(time, 2), np.delete(values, 2)).max() > 0.1
