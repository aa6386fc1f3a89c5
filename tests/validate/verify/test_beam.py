"""A scene of everything that both paths know."""

from dataclasses import replace

import pytest

from fem3d.runs.scene import solve
from scenes import load
from scenes.laws import PowerLaw
from validate.verify import second_path


@pytest.mark.long
def test_both_paths_find_the_same_and_another_law_is_caught():
    """The change by halving its intervals bounds the second path's error, also on its coarser mesh."""
    rows = list(second_path.rows())
    assert {row.verdict for row in rows} == {"agrees"}
    scene = load(second_path.BEAM)
    silicon, *others = scene.boxes
    twin = replace(silicon.material, thermal_conductivity=PowerLaw(130.0, 293.0, -1.25))
    found = solve(replace(scene, boxes=(replace(silicon, material=twin), *others))).steady
    assert abs(found["beam"].value - rows[0].expected) > 3 * rows[0].bound
