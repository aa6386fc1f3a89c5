"""What is no model, or no answer of one, ends in one sentence with status 2, and nothing is written; a model that never
answers is ended by Ctrl-C, and what 3D found is kept."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from validate.cli import main

NETLISTS = {
    "nodes.cir": "no node of the scene\nV1 a 0 1\n.end\n",
    "broken.cir": "an element without nodes\nR1 tip\n.end\n",
    "floats.cir": "no current anywhere\nI1 0 tip 1\nC1 tip 0 1\n.end\n",
    "control.cir": "commands\nV1 tip 0 350\n.control\nquit\n.endc\n.end\n",
    "unknown.cir": "a name that stands nowhere\n.param G={1/nope}\nV1 tip 0 350\nR1 tip 0 {G}\n.end\n",
    "loop.cir": "two sources side by side\nV1 tip 0 350\nV2 tip 0 360\n.end\n",
    "other.cir": "another file\n.include somewhere.cir\n.end\n",
    "fine.cir": "a circuit\n.param R=1\nV1 tip 0 350\nR1 tip 0 {R}\n.end\n",
}
TABLES = {
    "word.csv": "tip,hot\n", "twice.csv": "tip,350\ntip,351\n", "stranger.csv": "top,350\n", "unit.csv": "tip,350 W\n",
    "traces.csv": "time (s),tip (K)\n0,300\n1e-3,301\n1,302\n",
    "course.csv": "tip (K),mean (K)\n300,300\n301,301\n", "rough.csv": "\0\1\2", "empty.csv": "",
}  # fmt: skip
PYTHON = {"syntax.py": "def bar(scene, times)\n", "raises.py": "import nothing_of_this_name\n", "none.py": ""}

REFUSED = [
    ("", "names no model"),
    ("lumped.py", "names no function"),
    ("lumped.py:", "names no function"),
    ("lumped.py:barr", 'did you mean "bar"'),
    ("lumped.py:number", 'lumped.py has "number", but not as a function: give'),
    ("lumped.py:wrong", "lumped.py, line 23: ZeroDivisionError"),
    ("lumped.py:leaves", "SystemExit"),
    ("lumped.py:silent", "says nothing of"),
    ("lumped.py:other", 'did you mean "tip"'),
    ("lumped.py:shape", "has 2 numbers: give one number"),
    ("lumped.py:empty", "is not a finite number"),
    ("lumped.py:text", "no real numbers"),
    ("lumped.py:masked", "is not a finite number"),
    ("lumped.py:alone", "2 were given; it is called as f(scene, times)"),
    ("lumped.py:mute", "lumped.py, line 73: Mute"),
    ("lumped.py:yes", "no real numbers"),
    ("lumped.py:tuple_", 'returned "tuple"'),
    ("syntax.py:bar", "syntax.py, line 1: SyntaxError"),
    ("raises.py:bar", "raises.py, line 1: ModuleNotFoundError"),
    ("none.py:bar", "it has none"),
    ("nowhere.py:bar", "is no file"),
    ("nowhere.cir", "is no file"),
    ("model.txt", "is no model"),
    ("model", "is no model"),
    ("scene", "has no [model]"),
    ("nodes.cir", "no node called as a probe"),
    ("broken.cir", "matrix singular: give"),
    ("floats.cir", "matrix singular, at tip"),
    ("control.cir", "runs commands"),
    ("unknown.cir", "Undefined parameter [nope]"),
    ("loop.cir", "no voltage sources in a loop"),
    ("other.cir", "reads other files"),
    ("word.csv", "tip"),
    ("twice.csv", "stands twice"),
    ("stranger.csv", "not asked for"),
    ("unit.csv", "is not in K"),
    ("traces.csv", "in the steady state, which alone is solved"),
    ("course.csv", "no column of times"),
    ("rough.csv", "binary"),
    ("empty.csv", "no rows"),
    ("nowhere.csv", "is no file"),
    ("broken.fmu", "no FMU that can be read"),
    ("nowhere.fmu", "is no file"),
]


@pytest.fixture
def here(steady: Path, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the scene and of all these files."""
    for name, text in {**NETLISTS, **TABLES, **PYTHON, "broken.fmu": "PK", "model.txt": "tip,350\n"}.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(arguments: list[str], why: str, capsys: Any) -> None:
    assert main(["solve", "bar.toml", *arguments, "--out", "o"]) == 2
    said = capsys.readouterr()
    sentence = [line for line in said.err.splitlines() if line != "asked"]
    assert len(sentence) == 1, sentence
    assert sentence[0].startswith("validate: ")
    assert why in sentence[0]
    assert not said.out
    assert not Path("o").exists()


@pytest.mark.long
@pytest.mark.usefixtures("here")
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_model_that_copies_its_process_has_one_run() -> None:
    Path("forks.py").write_text("import os\n\ndef bar(scene, times):\n    os.fork()\n    return {'tip': 350.0}\n")
    command = [sys.executable, "-m", "validate", "solve", "bar.toml", "--no-figures", "--model", "forks.py:bar"]
    ran = subprocess.run([*command, "--out", "o"], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.count("Results in") == 1
    assert Path("o/summary.json").exists()


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(("given", "why"), REFUSED)
def test_what_is_no_model_is_one_sentence(given: str, why: str, capsys: Any) -> None:
    refused(["--model", given], why, capsys)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("setting", "why"),
    [
        ("model.parameters.Q=3", "has no .param"),
        ("model.parameters.R=box.bar.upper.w", "neither a quantity nor a key"),
        ("model.parameters.R=true", "not a value"),
        ("model.outputs.top=v(tip)", "is not a probe"),
        ('model.outputs={"bar mean" = "`touch escaped`"}', "starts programs or reads files"),
        ("checks.tolerances.top=0.1", "is not a check"),
        ("model.colour=3", "[model] takes file, parameters, outputs"),
    ],
)
def test_what_a_scene_says_of_its_model(setting: str, why: str, capsys: Any) -> None:
    refused(["--model", "fine.cir", "--set", setting], why, capsys)


@pytest.mark.long
@pytest.mark.parametrize(
    ("scene", "quantity", "value"),
    [(["solve", "bar.toml", "--model"], "tip", 400.0), (["sink", "--steady", "--reduction"], "peak_rise_K", 20.33)],
)
def test_a_model_that_never_answers_is_ended_and_3d_is_kept(
    here: Path, scene: list[str], quantity: str, value: float
) -> None:
    command = [sys.executable, "-m", "validate", *scene, "lumped.py:asleep", "--out", "o"]
    root = Path(__file__).parents[3]
    environment = os.environ | {"PYTHONPATH": str(root)}
    child = subprocess.Popen(
        [*command, "--no-figures"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )
    # It says that it sleeps once it has been asked.
    deadline = time.monotonic() + 60
    while not (here / "sleeping").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    child.send_signal(signal.SIGINT)
    out, _ = child.communicate(timeout=60)
    assert child.returncode == 130
    assert "lumped.py:asleep was interrupted" in " ".join(out.split())
    found = json.loads((here / "o" / "summary.json").read_text())
    assert found["fem3d"]["steady"][quantity]["value"] == pytest.approx(value, rel=1e-3)
    assert not found.get("reduced1d")
