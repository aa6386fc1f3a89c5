"""The network as a model: judged like any other, with errors, and without code that a scene could bring."""

import json
import math

import numpy as np
import pytest

import compare
from compare import pipeline
from compare.course import bends
from compare.models import open_model, runs_code
from compare.options import Options
from scenes.errors import RunawayError, SceneError
from scenes.model import MeshScene
from validate.cli import main


def test_the_bridge_is_judged():
    found = compare.solve("bridge", model="network")
    checks = found.checks
    assert set(checks) == {"middle", "beam mean", "current", "heat to the substrate", "quarter"}
    for check in checks.values():
        # By hand, 0.5 % of the 3D value, and far more certain.
        assert check.verdict == "agrees"
        assert abs(check.difference) < 5e-3
        assert check.u_num < 1e-3
    assert checks["middle"].difference > checks["middle"].u_num


def test_it_runs_no_code_of_anybody():
    assert not runs_code("network")
    with pytest.raises(SceneError, match="network, or scene for the scene's own"):
        open_model("netwerk")


def test_rows_just_before_a_jump_bend_nothing():
    """3D has a row a billionth of the run before a jump: no straight line there is off by the jump."""
    time = np.array([0.0, 1.0, 2.0, 2.0 + 4e-9, 3.0, 4.0])
    values = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    assert bends(time, values).max() == 0.0
    assert math.isfinite(bends(time, values).sum())
    assert bends(np.delete(time, 2), np.delete(values, 2)).max() > 0.1


def test_a_network_without_an_answer_leaves_what_3d_found(steady, monkeypatch, capsys):
    def runs_away(*_: object, **__: object) -> None:
        raise RunawayError("the network runs away", 1.0)

    monkeypatch.setattr("compare.models.network.solve", runs_away)
    out = steady.parent / "run"
    assert main(["solve", str(steady), "--model", "network", "--no-figures", "--out", str(out)]) == 3
    said = capsys.readouterr()
    assert said.err.endswith("network has no answer: the network runs away; what 3D found is kept\n")
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["fem3d"]["steady"]["tip"]["value"] == pytest.approx(400.0)
    assert "reduced1d" not in summary


def test_why_of_a_drive_that_varies_is_said(transient, ran):
    source = 'heat_source = {times = [0, "0.2 ms"], values = [1e12, 2e12]}'
    transient.write_text(transient.read_text(encoding="utf-8").replace("heat_source = 1e12", source), encoding="utf-8")
    summary, _ = ran(f"solve {transient} --model network --why --accuracy 1e-2")
    assert any("--why is of the steady state" in text for text in summary["warnings"])


def test_a_network_of_a_mesh_is_refused_before_3d_is_solved():
    """The scene alone decides: the mesh file is not even read."""
    scene = MeshScene("plug", "none.msh", 1.0, (), (), (), ())
    for ask in (pipeline.plan, pipeline.solve):
        with pytest.raises(SceneError, match="is on a mesh file, and a network is made of boxes"):
            ask(scene, Options(model="network"))
