"""A user's own model beside 3D as keys vary: slopes, uncertain inputs, sweeps and maps, on a bar whose tip rises by
g L^2/2k; and the assertion for the user's own tests."""

import csv
from typing import Any

import numpy as np
import pytest

import compare
from compare.testing import assert_model_agrees
from scenes.errors import SceneError
from validate.cli import main


def steep(scene: dict[str, Any], times: np.ndarray | None) -> dict[str, Any]:
    """A fifth too hot, and as k^-1.5 in place of k^-1; over time of one time constant."""
    film, bar = scene["material"][0], scene["box"][0]
    k, length = film["thermal_conductivity"], bar["upper"][0] - bar["lower"][0]
    rise = 1.2 * bar["heat_source"] * length**2 / 2 * 50**0.5 / k**1.5
    tau = 4 * length**2 * film.get("density", 1.0) * film.get("specific_heat", 1.0) / (k * np.pi**2)
    return {"tip": scene["boundary"][0]["temperature"] + rise * (1.0 if times is None else 1 - np.exp(-times / tau))}


def noisy(scene: dict[str, Any], times: np.ndarray | None) -> dict[str, Any]:
    """The same to six digits, as a solver's tolerance leaves it."""
    return {name: float(f"{value:.6g}") for name, value in steep(scene, times).items()}


K, G = "material.film.thermal_conductivity", "box.bar.heat_source"
UNCERTAIN = {K: "5%", G: "2%"}


def test_slopes_of_both_models_in_the_steady_state(steady):
    found = compare.solve(steady, model=steep, sensitivities=True)
    by = found.sensitivities
    for key, three, one in (
        (K, -1.0, -1.5),
        (G, 1.0, 1.0),
        ("box.bar.upper.x", 2.0, 2.0),
        ("boundary.end.temperature", 0.0, 0.0),
    ):
        assert by["fem3d"].relative[key]["tip"].value == pytest.approx(three, abs=1e-6)
        # A difference of order 4 of k^-1.5 over 2e-2 is off by 2e-6.
        assert by["reduced1d"].relative[key]["tip"].value == pytest.approx(one, abs=1e-5)
    check = found.check(f"slope_{K}")
    # Of the largest slope, 2 by the length.
    assert (check.verdict, check.difference) == ("differs", pytest.approx(-0.25, abs=1e-4))
    assert check.because == f"tip follows {K} by -1.500, in 3D by -1.000 % for each percent"
    assert check.u_num == pytest.approx(by["fem3d"].relative[K]["tip"].error / 2, rel=1e-3)
    for tolerance, verdict in ((0.3, "agrees"), (-check.difference, "unresolved")):
        other = compare.solve(steady, model=steep, sensitivities=True, overrides={"checks.tolerances.slope": tolerance})
        assert other.check(f"slope_{K}").verdict == verdict


def test_noise_leaves_a_slope(steady):
    found = compare.solve(steady, model=noisy, sensitivities=True)
    slope = found.sensitivities["reduced1d"].relative[K]["tip"].value
    # Six digits of 420 K are 1e-3 K: over steps of 2e-2 the slope of 180 K is off by 0.1 K at most.
    assert slope == pytest.approx(-1.5, rel=5e-3)


@pytest.mark.long
def test_u_input_of_a_difference_is_that_of_the_difference(steady, transient):
    found = compare.solve(steady, model=steep, uncertain=UNCERTAIN)
    # 1 + d = 1.2 (k/50)^-1/2 : the source moves both models alike, 5 % of k moves d by 0.03.
    assert found.check("tip").u_input == pytest.approx(0.03, rel=1e-4)
    assert found.uncertain.reduced1d["tip"] == pytest.approx(120 * np.hypot(1.5 * 0.05, 0.02), rel=1e-4)
    over_time = compare.solve(transient, model=steep, uncertain=UNCERTAIN).check("tip_over_time")
    # By the same model at 5 % more and less of k.
    beside = [
        compare.solve(transient, model=steep, overrides={K: 50 * (1 + part)}).check("tip_over_time")
        for part in (0.01, -0.01)
    ]
    slope = (beside[0].difference - beside[1].difference) / 0.02
    assert over_time.u_input == pytest.approx(0.05 * abs(slope), rel=0.02)


@pytest.mark.long
def test_the_assertion_for_tests_of_ones_own(steady, transient):
    assert assert_model_agrees(steady, steep, tip=0.25).check("tip").verdict == "differs"
    with pytest.raises(AssertionError, match=r"difference \+20 .* OUTSIDE the tolerance of 10 %"):
        assert_model_agrees(steady, steep, tip="10 %")
    # A probe's tolerance holds at rest and over time.
    assert_model_agrees(transient, steep, tip=0.25)
    with pytest.raises(AssertionError, match="tip_over_time"):
        assert_model_agrees(transient, steep, tip=0.2001)
    with pytest.raises(SceneError, match="bar mean"):
        assert_model_agrees(steady, steep, **{"bar mean": 0.1})
    with pytest.raises(AssertionError, match="UNDECIDED"):
        assert_model_agrees(steady, steep, tip=0.21, uncertain=UNCERTAIN)


@pytest.mark.long
def test_a_model_made_of_the_scenes_parameters_follows_them():
    """A bridge's current as w h/L, and as the model's own parameter made of these; 3D and the model move together."""

    def current(scene: dict[str, Any], times: np.ndarray | None) -> dict[str, Any]:
        p = scene["parameters"]
        return {"current": 0.5e5 * p["w"] * p["h"] / p["L"], "quarter": 1e5 * scene["model"]["parameters"]["half"]}

    given = {"model.parameters.half": "w/2"}
    found = compare.solve(
        "bridge", model=current, sensitivities=True, uncertain={"parameters.w": "2%"}, overrides=given, accuracy=1e-2
    )
    for name, slopes in {"current": {"w": 1, "h": 1, "L": -1, "gap": 0}, "quarter": {"w": 1, "h": 0}}.items():
        for key, slope in slopes.items():
            followed = found.sensitivities["reduced1d"].relative[f"parameters.{key}"][name].value
            # Differences of order 4 over 2e-2 are off by 1e-6.
            assert followed == pytest.approx(slope, abs=1e-5), (name, key)
    # The current is in proportion to w in both, so that it is none of their difference.
    assert found.check("current").u_input == pytest.approx(0.0, abs=1e-5)
    assert found.check("quarter").u_input == pytest.approx(0.02 * (1 + found.check("quarter").difference), rel=1e-3)


@pytest.fixture
def bent(tmp_path):
    path = tmp_path / "bent.py"
    path.write_text(
        '''"""The bar's tip, off by powers of its conductivity and its source."""


def tip(scene, times):
    k, g = scene["material"][0]["thermal_conductivity"], scene["box"][0]["heat_source"]
    return {"tip": 300 + 1e-8 * g / 2 / k * (50 / k) ** 0.5 * (g / 1e12) ** 0.1}
''',
        encoding="utf-8",
    )
    return str(path)


@pytest.mark.long
def test_the_map_finds_the_line_within_its_stated_error(steady, bent, tmp_path):
    vary = ["--vary", f"{K}=40:60", "--vary", f"{G}=5e11:2e12:log"]
    asked = ["map", str(steady), "--model", f"{bent}:tip", "--check", "tip", "--tolerance", "5%", *vary]
    out = ["--cells", "20", "--solves", "40", "--out", str(tmp_path / "m"), "--no-figures", "--quiet"]
    assert main([*asked, *out]) == 0
    rows = list(csv.DictReader((tmp_path / "m" / "map.csv").open(encoding="utf-8")))
    assert len(rows) == 400
    k, g, found, error = (np.array([float(row[name]) for row in rows]) for name in (K, G, "difference", "error"))
    exact = (50 / k) ** 0.5 * (g / 1e12) ** 0.1 - 1
    # A fit through exact values is within its stated error, and the values within the rounding of the solver.
    assert (np.abs(found - exact) <= error + 1e-7).all()
    sure = {row["verdict"] for row in rows}
    assert sure <= {"agrees", "differs", "unresolved"}
    for row, value in zip(rows, exact, strict=True):
        assert row["verdict"] in ("unresolved", "differs" if abs(value) > 0.05 else "agrees")
    assert sum(row["verdict"] == "unresolved" for row in rows) <= 0.05 * len(rows)
