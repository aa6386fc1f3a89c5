"""A user's own model at many designs, whose difference from 3D has a closed form: rises are as (k/50)^-1/2 and
(g/1e12)^0.1 too high."""

import csv
import json

import numpy as np
import pytest

import compare
from validate.cli import main

K, G = "material.film.thermal_conductivity", "box.bar.heat_source"


@pytest.fixture
def bent(tmp_path):
    path = tmp_path / "bent.py"
    path.write_text(
        '''"""The bar's tip, off by powers of its conductivity and its source."""
import time


def tip(scene, times):
    k, g = scene["material"][0]["thermal_conductivity"], scene["box"][0]["heat_source"]
    return {"tip": 300 + 1e-8 * g / 2 / k * (50 / k) ** 0.5 * (g / 1e12) ** 0.1}


def asleep(scene, times):
    if scene["material"][0]["thermal_conductivity"] > 55:
        time.sleep(1000)
    return tip(scene, times)
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


@pytest.mark.long
def test_a_point_that_sleeps_is_ended_and_the_others_are_judged(steady, bent, tmp_path):
    asked = ["sweep", str(steady), "--model", f"{bent}:asleep", "--check", "tip", "--vary", f"{K}=40,50,60"]
    out = ["--point-timeout", "4s", "--out", str(tmp_path / "s"), "--no-figures", "--quiet"]
    assert main([*asked, *out]) == 0
    rows = {float(row[K]): row for row in csv.DictReader((tmp_path / "s" / "points.csv").open(encoding="utf-8"))}
    assert [rows[k]["status"] for k in (40.0, 50.0, 60.0)] == ["ok", "ok", "timeout"]
    assert float(rows[40.0]["tip_difference"]) == pytest.approx((50 / 40) ** 0.5 - 1, rel=1e-6)
    assert (rows[40.0]["tip_verdict"], rows[50.0]["tip_verdict"]) == ("differs", "agrees")
    assert float(rows[50.0]["reduced1d_tip"]) == pytest.approx(400.0)
    said = json.loads((tmp_path / "s" / "sweep.json").read_text(encoding="utf-8"))["sentence"]
    assert said.startswith("the model bent.py:asleep is within 5 % of 3D at tip in 1 of 3 designs")


@pytest.mark.long
def test_a_sinks_own_model_at_a_design(tmp_path):
    """It is judged in the paper's place as it is in a run, and nothing is blamed on the paper's assumptions."""
    model = f"{tmp_path / 'own.py'}:sink"
    (tmp_path / "own.py").write_text(
        "def sink(scene, times):\n    return {'peak_rise_K': 20 * scene['drive']['voltage']}\n", encoding="utf-8"
    )
    asked = ["sweep", "sink", "--reduction", model, "--vary", "drive.voltage=2", "--steady", "--workers", "1"]
    assert main([*asked, "--out", str(tmp_path / "s"), "--no-figures", "--quiet"]) == 0
    (row,) = csv.DictReader((tmp_path / "s" / "points.csv").open(encoding="utf-8"))
    alone = compare.run("sink", voltage=2, reduction=model, steady=True, accuracy=1e-2)
    assert float(row["fig4_difference"]) == pytest.approx(alone.check("fig4").difference, rel=1e-6)
    assert (float(row["reduced1d_peak_rise_K"]), row["blame"]) == (40.0, "")


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["sweep", "{scene}", "--model", "{file}:nothing", "--vary", f"{K}=40,50"], "has no function"),
        (
            ["sweep", "{scene}", "--model", "{file}:tip", "--check", "tipp", "--vary", f"{K}=40,50"],
            'did you mean "tip"',
        ),
        (["sweep", "sink", "--model", "{file}:tip", "--vary", "sink.width=10um,20um"], "--reduction"),
        (["sweep", "sink", "--reduction", "paper,{file}:tip", "--vary", "sink.width=10um,20um"], "is judged alone"),
        (["sweep", "sink", "--reduction", "network", "--check", "eq14", "--vary", "sink.width=10um"], "no use of"),
        (["map", "{scene}", "--check", "tip", "--vary", f"{K}=40:50", "--vary", f"{G}=1:2"], "give --model"),
    ],
)
def test_what_cannot_be_swept_is_said(steady, bent, arguments, why, tmp_path, capsys):
    given = [part.format(scene=steady, file=bent) for part in arguments]
    assert main([*given, "--out", str(tmp_path / "o")]) == 2
    said = capsys.readouterr().err
    assert why in said
    assert said.count("\n") == 1
    assert not (tmp_path / "o").exists()
