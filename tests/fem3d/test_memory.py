"""A finished run leaves no problem, space or factor behind once its result is let go of: without waiting for Python's
search for cycles, which counts objects and not their size."""

import gc
from dataclasses import replace
from typing import Any

import pytest

from fem3d.problems.cholesky import Factors
from fem3d.problems.heat import HeatProblem
from fem3d.runs import scene as runs
from fem3d.spaces.domain import Domain
from scenes.free import check
from scenes.loading import load_free
from scenes.model import Probe, Scene
from tests.fem3d.test_size import UM, plate


def on_tetrahedra() -> Scene:
    """A plate with a pad, and the heat that its warm end takes."""
    scene = plate(1)
    out = Probe("out", (200 * UM, 0.0, 0.0), (200 * UM, 200 * UM, 2 * UM), "heat_flow")
    return check(replace(scene, mesh="tetrahedra", probes=(*scene.probes, out)))


def kept(scene: Any, names: list[str]) -> int:
    """The number of problems, domains and factors that a run leaves after its result is released."""

    def count() -> int:
        return sum(isinstance(each, (Domain, Factors, HeatProblem)) for each in gc.get_objects())

    gc.collect()
    gc.disable()
    try:
        before, result = count(), runs.solve(scene)
        assert set(names) <= {*result.steady, *(result.traces.values if result.traces else ())}
        assert count() > before
        del result
        return count() - before
    finally:
        gc.enable()


@pytest.mark.parametrize(("scene", "names"), [("plate", []), ("hotplate", ["heat to the left"])])
def test_a_run_on_bricks_leaves_nothing_behind(scene, names):
    assert kept(load_free(scene), names) == 0


def test_a_run_on_tetrahedra_leaves_nothing_behind():
    assert kept(on_tetrahedra(), ["out"]) == 0
