"""Properties that differ along x, y and z: the body stretched until they don't is the same problem.

With x' = x / sqrt(kx), and so on, div(k grad u) = q is the Laplacian of the stretched block, of unit conductivity. With
y' = y sqrt(r), where r is the resistivity along y over that along x, current and heat obey the equations of one
resistivity, if the conductivity of heat is divided by r along y as well: same temperatures and potentials, and sqrt(r)
times the currents."""

import numpy as np
import pytest

from fem3d.runs.scene import solve
from scenes.errors import SceneError
from scenes.free import from_dict
from tests.fem3d import gap
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
    assert gap(one, same, run.get("output_times", ()), {"corner": 1.0, "mean": 1.0, "through": volume}) <= 1
    # A twin of which two axes are exchanged is another problem.
    if one.traces is None:
        assert all(a.error < 1e-3 * abs(a.value) for a in one.steady.values())
        twin = solve(from_dict(block([K[1], K[0], K[2]], **run)[0])).steady["corner"]
        assert abs(twin.value - one.steady["corner"].value) > 30 * (twin.error + one.steady["corner"].error)


RATIO = 4.0
LAWS = {
    "a coefficient": (lambda rho: {"resistivity": rho, "temperature_coefficient": 2e-3}),
    "a power": (lambda rho: {"resistivity": along(rho, lambda r: {"value": r, "at": 293.0, "exponent": 0.7})}),
}


def along(rho, law):
    """A law for each axis, or for all."""
    return [law(r) for r in rho] if isinstance(rho, list) else law(rho)


def elbow(law, rho, k, stretch=1.0, **run):
    """Current that enters a block by a part of its left face and leaves by one of its front; y is times ``stretch``."""
    a, b, c = 40e-6, 30e-6 * stretch, 5e-6
    return {
        "scene": {"name": "elbow", "initial_temperature": 293.0},
        "material": [
            {"name": "m", "thermal_conductivity": k, "density": 2000.0, "specific_heat": 700.0} | LAWS[law](rho)
        ],
        "box": [{"name": "block", "material": "m", "lower": [0, 0, 0], "upper": [a, b, c]}],
        "boundary": [
            {"name": "in", "lower": [0, b / 3, 0], "upper": [0, b, c], "voltage": 0.5},
            {"name": "out", "lower": [a / 2, 0, 0], "upper": [a, 0, c], "voltage": 0.0},
            {"name": "cold", "lower": [0, 0, 0], "upper": [a, b, 0],
             "convection": {"coefficient": 3e6, "ambient": 293.0}},
        ],
        "probe": [
            {"name": "middle", "at": [a / 2, b / 3, c]},
            {"name": "mean", "lower": [0, 0, 0], "upper": [a, b, c]},
            {"name": "tap", "quantity": "potential", "at": [a / 2, b / 3, c]},
            {"name": "entering", "quantity": "current", "lower": [0, b / 3, 0], "upper": [0, b, c]},
            {"name": "across", "quantity": "current", "lower": [0, b / 6, 0], "upper": [a, b / 6, c]},
            {"name": "power", "quantity": "power", "lower": [0, 0, 0], "upper": [a, b, c]},
        ],
        "run": {"accuracy": 1e-2, **run},
    }  # fmt: skip


def both(law, **run):
    """The block with a resistivity and a conductivity along each axis, and the stretched one with one of each."""
    given = elbow(law, [1e-5, RATIO * 1e-5, 1e-5], [50.0, 50.0 / RATIO, 50.0], **run)
    return given, elbow(law, 1e-5, 50.0, float(np.sqrt(RATIO)), **run)


TIMES = {"middle": 1.0, "mean": 1.0, "tap": 1.0} | dict.fromkeys(("entering", "across", "power"), np.sqrt(RATIO))


STEADY, OVER_TIME = {"steady": True}, {"end_time": 2e-5, "output_times": [2e-6, 2e-5]}
CASES = [("a coefficient", STEADY), ("a power", OVER_TIME)]


@pytest.mark.long
@pytest.mark.parametrize(("law", "run"), CASES)
def test_a_conductor_is_the_stretched_one(law, run):
    given, other = both(law, **run)
    one, same = solve(from_dict(given)), solve(from_dict(other))
    over = TIMES if one.traces is None else {name: times for name, times in TIMES.items() if name != "power"}
    assert gap(one, same, run.get("output_times", ()), over) <= 1
    if one.traces is None:
        assert all(one.steady[name].error < 0.02 * abs(one.steady[name].value) for name in TIMES)
        twin = elbow(law, [RATIO * 1e-5, 1e-5, 1e-5], given["material"][0]["thermal_conductivity"], **run)
        turned = solve(from_dict(twin)).steady["entering"]
        assert abs(turned.value - one.steady["entering"].value) > 5 * (turned.error + one.steady["entering"].error)


@pytest.mark.long
def test_a_conductor_on_a_mesh_file_is_the_stretched_one(tmp_path):
    given, other = both("a coefficient", steady=True, accuracy=3e-2)
    assert gap(on_mesh(given, "tetra", 2, tmp_path), solve(from_dict(other)), over=TIMES) <= 1


def volumes(fields):
    """(cells,) in m3."""
    corners = fields.points[fields.cells]
    if fields.cells.shape[1] == 27:
        return np.ptp(corners, axis=1).prod(axis=1)
    return np.abs(np.linalg.det(corners[:, 1:4] - corners[:, :1])) / 6


def means(result):
    """Of the fields of a steady state the current density (3,) and the heat (W/m3), means over the block."""
    fields = result.details["fields"]
    snapshot, weights = fields.snapshot(None), volumes(fields)
    return (*np.average(snapshot.current_density, axis=0, weights=weights),
            np.average(snapshot.heat_source, weights=weights))  # fmt: skip


def test_fields_beside_an_insulator_have_the_whole_power():
    """An insulator has cells without a current."""
    given, _ = both("a coefficient", steady=True, accuracy=5e-2)
    (block,) = given["box"]
    x, y, z = block["upper"]
    # Along x alone: no corner of an electrode takes cells.
    for electrode, at in zip(given["boundary"], (0, x), strict=False):
        electrode |= {"lower": [at, 0, 0], "upper": [at, y, z]}
    given["probe"] = given["probe"][-1:]
    given["material"].append({"name": "oxide", "thermal_conductivity": 1.4})
    given["box"].append({"name": "cap", "material": "oxide", "lower": [0, 0, z], "upper": [x, y / 2, 2 * z]})
    result = solve(from_dict(given))
    fields, power = result.details["fields"], result.steady["power"]
    assert volumes(fields) @ fields.snapshot(None).heat_source == pytest.approx(power.value, abs=power.error)


@pytest.mark.long
def test_fields_have_the_current_density_along_each_axis(tmp_path):
    """Along x it is the stretched conductor, along y the field is sqrt(r) times as strong in r times the
    resistivity; the heat is the same."""
    given, other = both("a coefficient", steady=True)
    x, y, _, heat = means(solve(from_dict(other)))
    for result in (solve(from_dict(given)), on_mesh(given, "tetra", 2, tmp_path)):
        along_x, along_y, _, heating = means(result)
        # Twice the accuracy of both.
        assert along_x == pytest.approx(x, rel=2e-2)
        assert along_y == pytest.approx(y / np.sqrt(RATIO), rel=2e-2)
        assert heating == pytest.approx(heat, rel=2e-2)


def test_laws_that_are_not_in_proportion_are_refused():
    material = {"thermal_conductivity": 50.0, "name": "m", "density": 2e3, "specific_heat": 700.0}
    given, _ = both("a coefficient", steady=True)
    power = {"value": 1e-5, "at": 293.0, "exponent": 0.7}
    for rho in ([power, 1e-5, 1e-5], [power, power, power | {"exponent": 0.8}]):
        with pytest.raises(SceneError, match=r'"m".resistivity follows the temperature along x, y and z in different'):
            from_dict(given | {"material": [material | {"resistivity": rho}]})
    with pytest.raises(SceneError, match=r"resistivity\[y\]"):
        from_dict(given | {"material": [material | {"resistivity": [1e-5, "insulator", 1e-5]}]})
