"""`validate solve --export`: what is written, and what is refused before anything is solved."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scenes.compact.runtime import CompactModel
from validate.cli import main


def test_a_model_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["solve", "bridge", "--no-figures", "--accuracy", "1e-2", "--out", str(tmp_path / "run")]
    assert main([*command, "--export", str(tmp_path / "new" / "mine"), "--states", "2"]) == 0
    assert "Exported a compact model (2 states, within" in " ".join(capsys.readouterr().out.split())
    found = json.loads((tmp_path / "new" / "mine" / "model.json").read_text())
    assert found["states"] == 2
    assert (tmp_path / "new" / "mine" / "model.py").read_text().startswith('"""Compact model of "bridge": 2 states')


def test_a_model_of_the_sink(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of its 3D problem: both electrodes and both undersides as inputs, the current as an output too."""
    command = ["sink", "--steady", "--no-figures", "--accuracy", "1e-2", "--out", str(tmp_path / "run")]
    assert main([*command, "--export", str(tmp_path / "mine"), "--states", "3"]) == 0
    assert "Exported a compact model (3 states, within" in " ".join(capsys.readouterr().out.split())
    model = CompactModel(json.loads((tmp_path / "mine" / "model.json").read_text()))
    assert (model.states, len(model.inputs)) == (3, 4)
    run = json.loads((tmp_path / "run" / "summary.json").read_text())["fem3d"]["steady"]
    found = model.steady()
    assert found["current"] == pytest.approx(run["current_A"]["value"], rel=2e-2)
    assert 0 < model.document["error"]["the scene"]["steady"]["current"]["relative"] < 2e-2


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--export", "{0}/m", "--states", "0"], "--states is"),
        (["--export", "{0}/m", "--model-accuracy", "2"], "--model-accuracy = "),
        (["--export", "{0}/m", "--model-accuracy", "1e-3", "--states", "3"], "give one of them"),
        (["--states", "3"], "--states 3 is of the model that --export DIR writes"),
        (["--export", " "], "names no folder"),
        (["--export", "{0}/file/m"], "cannot be written"),
        (["--export", "{0}/m", "--set", "probe.quarter.reduce=max"], "an extreme potential"),
        (["sink", "--export", "m", "--states", "3", "--reduction", "moments:4"], "leave them or --reduction out"),
        (["sink", "--export", "m", "--states", "3", "--set", "sink.spans=2"], "make a model of one span"),
        (["sink", "--states", "3"], "--states 3 is of the model that --export DIR writes"),
    ],
)
def test_what_is_refused(
    given: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    command = given if given[0] == "sink" else ["solve", "bridge", "--out", "run", *given]
    assert main([word.format(tmp_path) for word in command]) == 2
    told = capsys.readouterr().err
    assert said in " ".join(told.split())
    assert "Traceback" not in told
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]
