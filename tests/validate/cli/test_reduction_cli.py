"""--reduction, --why and --export at the command line, with a stand-in for the 3D solver."""

import json
from pathlib import Path

import pytest

from tests.validate.cli import summary
from validate.cli import main

pytestmark = pytest.mark.usefixtures("no_solver")


@pytest.mark.parametrize("reduction", ["anchored", "moments:3"])
def test_the_chosen_model_is_named(reduction, capsys):
    assert main(["sink", "--no-figures", "--reduction", reduction, "--explain"]) == 0
    text = capsys.readouterr().out
    assert f"1D model: {reduction}" in text
    said = " ".join(text.split())
    assert f"The 1D model {reduction} is " in said
    assert f"sink at 1 V, {reduction} against 3D:" in said
    assert "the paper's equations (not this model's)" in said
    assert "Of the paper's own 7 equations, which are not this model's, 2 differ." in said
    assert max(map(len, text.splitlines())) <= 80
    folder = f"results/sink-1V-{reduction.replace(':', '')}"
    found = summary(folder)
    assert found["reduced1d"]["name"] == reduction
    named = {check["id"]: check.get("model") for check in found["checks"]}
    assert {id_ for id_, model in named.items() if model} == {"fig4", "fig6_peak", "fig6_end", "fig7_current"}
    assert set(filter(None, named.values())) == {reduction}
    assert any(step["step"] == "1D model" and reduction in step["reason"] for step in found["plan"])
    heads = Path(folder, "traces.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert "reduced1d_peak_K" in heads
    assert len(heads) == 11


def test_a_better_model_agrees_where_the_papers_differs():
    """The stand-in is the exact fin on 2663 K/W, the value of the plate."""
    verdicts = {}
    for reduction in ("paper", "plate"):
        assert main(["sink", "--no-figures", "--reduction", reduction, "--out", reduction]) == 0
        verdicts[reduction] = {check["id"]: check["verdict"] for check in summary(reduction)["checks"]}
    assert verdicts["paper"]["fig4"] == "differs"
    assert verdicts["plate"]["fig4"] == "agrees"
    assert verdicts["plate"]["eq14"] == verdicts["paper"]["eq14"] == "differs"


def test_strict_asks_nothing_of_a_better_model_that_is_the_papers(capsys):
    """The stand-in's steady state is the plate's: all its checks agree, while eqs 14 and 18 still differ."""
    strict = ["sink", "--no-figures", "--steady", "--strict", "--voltage", "2"]
    assert main([*strict, "--reduction", "plate"]) == 0
    assert "all 2 checks agree" in capsys.readouterr().out
    assert {check["id"] for check in summary("results/sink-2V-plate-steady")["checks"] if not check["own"]} == {
        "eq12", "eq13", "eq14", "eq16", "eq18", "eq18_measured", "fig5",
    }  # fmt: skip
    assert main(strict) == 1


@pytest.fixture
def _fewer_figures(monkeypatch):
    """Figure 7 alone beside the budget's: the others take seconds."""
    monkeypatch.setattr("compare.kinds.sink.FIGURES", {"figure7": "current against time"})


@pytest.mark.long
@pytest.mark.usefixtures("_fewer_figures")
def test_why(capsys):
    assert main(["sink", "--why", "--out", "here"]) == 0
    text = capsys.readouterr().out
    assert "Why the paper's model differs from 3D" in text
    assert "2 figures" in text
    assert max(map(len, text.splitlines())) <= 80
    found = summary("here")
    assert {"why.png", "why.svg"} <= set(found["files"]) == {entry.name for entry in Path("here").iterdir()}
    assert found["why"]["sentence"].startswith("the largest part is")
    for split in (*found["why"]["steady"].values(), *found["why"]["transient"].values()):
        parts = sum(part["value"] for part in split["parts"])
        assert parts == pytest.approx(split["difference"]["value"], rel=1e-6, abs=1e-12)
    # A later run without it leaves no stale figure.
    assert main(["sink", "--no-figures", "--steady", "--why", "--out", "here"]) == 0
    assert not Path("here", "why.png").exists()
    assert summary("here")["why"]["transient"] == {}


@pytest.mark.long
def test_a_compact_model_is_written(capsys):
    command = ["solve", "bridge", "--no-figures", "--accuracy", "1e-2", "--out", "run"]
    assert main([*command, "--export", "new/mine", "--states", "2"]) == 0
    assert "Exported a compact model (2 states, within" in " ".join(capsys.readouterr().out.split())
    found = json.loads(Path("new/mine/model.json").read_text(encoding="utf-8"))
    assert found["states"] == 2
    assert Path("new/mine/model.py").read_text(encoding="utf-8").startswith('"""Compact model of "bridge": 2 states')


def test_a_thick_layer_is_warned_of(capsys):
    settings = ["--set", "sink.thickness=20um", "--reduction", "fin", "--steady", "--only", "1d"]
    assert main(["sink", "--no-figures", "--out", "here", *settings]) == 0
    assert "thin-plate assumption" in capsys.readouterr().out
    assert any("thin-plate" in text for text in summary("here")["warnings"])
