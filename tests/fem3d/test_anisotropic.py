"""A conductivity that differs along x, y and z: the block stretched until it doesn't is the same problem.

With x' = x / sqrt(kx), and so on, div(k grad u) = q is the Laplacian of the stretched block, of unit conductivity.
"""

import numpy as np
import pytest

from fem3d.runs.scene import solve
from scenes.free import from_dict
from tests.meshes.grouped.test_scenes import on_mesh

K = (40.0, 130.0, 10.0)
SIDES = (40e-6, 60e-6, 20e-6)


def block(k, scale=(1.0, 1.0, 1.0), **run):
    """A heated block on a cold base that covers half of its lower face; lengths times ``scale``."""
    a, b, c = (float(side * s) for side, s in zip(SIDES, scale, strict=True))
    volume = float(np.prod(scale))
    return {
        "material": [{"name": "m", "thermal_conductivity": k, "density": 2000.0, "specific_heat": 700.0}],
        "box": [{"name": "block", "material": "m", "lower": [0, 0, 0], "upper": [a, b, c], "heat_source": 1e13}],
        "boundary": [{"name": "base", "lower": [0, 0, 0], "upper": [a / 2, b, 0], "temperature": 293.0}],
        "probe": [
            {"name": "corner", "at": [a, b, c]},
            {"name": "mean", "lower": [0, 0, 0], "upper": [a, b, c]},
            {"name": "through", "quantity": "heat_flow", "lower": [a * 0.75, 0, 0], "upper": [a * 0.75, b, c]},
        ],
        "run": {"accuracy": 1e-3, **run},
    }, volume


@pytest.mark.long
@pytest.mark.parametrize("run", [{"steady": True}, {"end_time": 2e-5, "output_times": [2e-6, 2e-5]}])
def test_a_block_on_bricks_is_the_stretched_one(run):
    stretch = tuple(1 / np.sqrt(k) for k in K)
    given, _ = block(list(K), **run)
    other, volume = block(1.0, stretch, **run)
    one, same = solve(from_dict(given)), solve(from_dict(other))
    for name, factor in (("corner", 1.0), ("mean", 1.0), ("through", volume)):
        if one.traces is None:
            a, b = one.steady[name], same.steady[name]
            assert abs(a.value - b.value / factor) <= a.error + b.error / factor
            assert a.error < 1e-3 * abs(a.value)
        else:
            for t in (2e-6, 2e-5):
                a, b = (np.interp(t, r.traces.time, r.traces.values[name]) for r in (one, same))
                assert abs(a - b / factor) <= one.traces.errors[name] + same.traces.errors[name] / factor
    # A twin of which two axes are exchanged is another problem.
    if one.traces is None:
        twin = solve(from_dict(block([K[1], K[0], K[2]], **run)[0])).steady["corner"]
        assert abs(twin.value - one.steady["corner"].value) > 30 * (twin.error + one.steady["corner"].error)


@pytest.mark.long
def test_a_mesh_file_has_it_too(tmp_path):
    """Of an accuracy that few levels reach; a twin of which two axes are exchanged is another problem."""
    given, _ = block(list(K), steady=True, accuracy=0.1)
    twin, _ = block([K[1], K[0], K[2]], steady=True, accuracy=1e-2)
    mesh = on_mesh(given, "tetra", 3, tmp_path).steady
    same, other = (solve(from_dict(document | {"run": twin["run"]})).steady for document in (given, twin))
    for name, found in mesh.items():
        assert abs(found.value - same[name].value) <= found.error + same[name].error
        assert found.error < 0.3 * abs(found.value)
    assert abs(mesh["corner"].value - other["corner"].value) > mesh["corner"].error + other["corner"].error
