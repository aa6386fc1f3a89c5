"""An invalid model ends in one sentence with status 2, and nothing is written; where a model fails during its run, or
is ended, the 3D result is kept."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest

from validate.cli import main

NETLISTS = {
    "nodes.cir": "no node of the scene\nV1 a 0 1\n.end\n",
    "floats.cir": "no current anywhere\nI1 0 tip 1\nC1 tip 0 1\n.end\n",
    "unknown.cir": "a name that stands nowhere\n.param G={1/nope}\nV1 tip 0 350\nR1 tip 0 {G}\n.end\n",
    "nought.cir": "a parameter that does\n.param R={1/0}\nV1 tip 0 350\nR1 tip 0 {R}\n.end\n",
    "fine.cir": "a circuit\n.param R=1\nV1 tip 0 350\nR1 tip 0 {R}\n.end\n",
}
TABLES = {
    "word.csv": "tip,hot\n", "twice.csv": "tip,350\ntip,351\n", "stranger.csv": "top,350\n", "unit.csv": "tip,350 W\n",
    "traces.csv": "time (s),tip (K)\n0,300\n1e-3,301\n1,302\n",
    "course.csv": "tip (K),mean (K)\n300,300\n301,301\n", "rough.csv": "\0\1\2", "empty.csv": "",
}  # fmt: skip
PYTHON = {
    "exits.py": "import os\n\nos._exit(0)\n", "syntax.py": "def bar(scene, times)\n",
    "imports.py": "from math import sqrt\nfrom pathlib import Path\n\ndef other(scene, times):\n    return {}\n",
    "raises.py": "import nothing_of_this_name\n", "none.py": "",
}  # fmt: skip

REFUSED = [
    ("", "names no model"),
    ("lumped.py", "is no model: give FILE.py:FUNCTION"),
    ("lumped.py:barr", 'did you mean "bar"'),
    ("imports.py:bar", 'it has no function "bar": give "other"'),
    ("lumped.py:number", 'it has no function "number": give'),
    ("syntax.py:bar", "syntax.py, line 1: SyntaxError"),
    ("raises.py:bar", "raises.py, line 1: ModuleNotFoundError"),
    ("none.py:bar", "there is none to give"),
    ("nowhere.py:bar", "is no file"),
    ("model.txt", "is no model"),
    ("scene", "has no [model]"),
    ("twice.csv", "stands twice"),
    ("word.csv", 'its last row is "tip,hot"'),
    ("course.csv", "no column of times"),
    ("rough.csv", "binary"),
    ("empty.csv", "no rows"),
    ("broken.fmu", "no FMU that can be read"),
    ("nowhere.fmu", "is no file"),
    ("bare.fmu", "it has programs for no system: export it for"),
]
FAILED = [
    ("lumped.py:wrong", "lumped.py, line 37: ZeroDivisionError"),
    ("lumped.py:leaves", "SystemExit"),
    ("lumped.py:silent", "has no value of"),
    ("lumped.py:other", 'did you mean "tip"'),
    ("lumped.py:shape", "give one real number"),
    ("lumped.py:ragged", "give one real number"),
    ("lumped.py:tensor", "give one real number"),
    ("lumped.py:empty", "is not a finite number"),
    ("lumped.py:masked", "is not a finite number"),
    ("lumped.py:alone", "2 were given"),
    ("lumped.py:mute", "lumped.py, line 29: model_lumped.Mute"),
    ("lumped.py:yes", '"tip" in the steady state is "True": give one real number'),
    ("lumped.py:tuple_", 'returned "tuple"'),
    ("stranger.csv", "no column called as a probe"),
    ("unit.csv", "is a power, not in K"),
    ("traces.csv", "has no value of"),
]
ENDED = [
    ("exits.py:bar", 'exits.py:bar": it failed: it ended its process'),
    ("odd.py:killed", '"odd.py:killed": it failed: it ended its process, with the signal SIGKILL'),
    ("odd.py:endless", '"odd.py:endless": it has not answered in 0.02 minutes, and was ended'),
]
NO_SOLUTION = [
    ("nodes.cir", "no node called as a probe"),
    ("floats.cir", "singular matrix: check node tip"),
    ("unknown.cir", "Undefined parameter [nope]"),
    ("nought.cir", "unknown parameter (inf)"),
]
ODD = """import os
import signal

killed = lambda scene, times: os.kill(os.getpid(), signal.SIGKILL)


def endless(scene, times):
    while True:
        pass
"""


BARE = """<fmiModelDescription fmiVersion="2.0" modelName="m" guid="1"><CoSimulation modelIdentifier="m"/>
<ModelVariables/><ModelStructure/></fmiModelDescription>"""


@pytest.fixture
def here(steady, model, tmp_path, monkeypatch):
    """The folder of the scene and of all these files."""
    others = {"odd.py": ODD, "broken.fmu": "PK", "model.txt": "tip,350\n"}
    for name, text in {**NETLISTS, **TABLES, **PYTHON, **others}.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    with ZipFile(tmp_path / "bare.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", BARE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(arguments: list[str], why: str, capsys: Any, kept: bool = False) -> None:
    assert main(["solve", "bar.toml", *arguments, "--no-figures", "--out", "o"]) == 2
    said = capsys.readouterr()
    assert said.err.startswith("validate: ")
    assert said.err.count("\n") == 1
    assert why in said.err
    assert bool(said.out) == kept == Path("o").exists()
    if kept:
        assert said.err.endswith("; what 3D found is kept\n")
        found = json.loads(Path("o/summary.json").read_text(encoding="utf-8"))
        assert found["fem3d"]["steady"]["tip"]["value"] == pytest.approx(400.0, rel=1e-3)
        assert not found.get("reduced1d")


@pytest.mark.usefixtures("here", "in_this_process")
@pytest.mark.parametrize(("given", "why", "kept"), [(*each, each in FAILED) for each in REFUSED + FAILED])
def test_what_is_no_model_and_where_one_fails_is_one_sentence(given, why, kept, capsys):
    refused(["--model", given], why, capsys, kept)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(("given", "why"), ENDED)
def test_where_a_models_process_ends_what_3d_found_is_kept(given, why, capsys, monkeypatch):
    if given.endswith("endless"):
        monkeypatch.setattr("compare.models.function.LONGEST", 1.2)
    refused(["--model", given], why, capsys, kept=given != "exits.py:bar")


@pytest.mark.needs("ngspice")
@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(("netlist", "why"), NO_SOLUTION)
def test_where_a_netlist_has_no_solution_3d_is_kept(netlist, why, capsys):
    refused(["--model", netlist], why, capsys, kept=True)


@pytest.mark.usefixtures("here")
def test_a_folder_with_files_called_as_those_of_python_is_no_matter(capsys):
    for name in ("json.py", "numpy.py", "random.py", "socket.py"):
        Path(name).write_text("raise ImportError('of the user')\n", encoding="utf-8")
    Path("elsewhere").mkdir()
    Path("elsewhere/own.py").write_text("def bar(scene, times):\n    return {'tip': 400.0}\n", encoding="utf-8")
    assert main(["solve", "bar.toml", "--model", "elsewhere/own.py:bar", "--quiet", "--no-figures", "--out", "o"]) == 0


@pytest.mark.needs("ngspice")
@pytest.mark.usefixtures("here")
def test_a_setting_that_a_netlist_has_no_parameter_for_leaves_3d(capsys):
    refused(["--model", "fine.cir", "--set", "model.parameters.Q=3"], "has no .param", capsys, kept=True)
    outputs = 'model.outputs={"bar mean" = "`touch escaped`"}'
    refused(["--model", "fine.cir", "--set", outputs], "starts programs or reads files", capsys, kept=True)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("setting", "why"),
    [
        ("model.parameters.R=box.bar.upper.w", "neither a quantity nor a key"),
        ("model.parameters.R=true", "not a value"),
        ("model.outputs.top=v(tip)", "names no probe"),
        ("checks.tolerances.top=0.1", "names no check"),
        ("model.colour=3", "[model] takes file, parameters, outputs"),
    ],
)
def test_what_a_scene_says_of_its_model(setting, why, capsys):
    refused(["--model", "lumped.py:bar", "--set", setting], why, capsys)


@pytest.mark.long
@pytest.mark.parametrize(
    ("scene", "quantity", "value"),
    [(["solve", "bar.toml", "--model"], "tip", 400.0), (["sink", "--steady", "--reduction"], "peak_rise_K", 20.33)],
)
def test_a_model_that_never_answers_is_ended_and_3d_is_kept(here, scene, quantity, value):
    command = [sys.executable, "-m", "validate", *scene, "lumped.py:asleep", "--out", "o"]
    root = Path(__file__).parents[3]
    environment = os.environ | {"PYTHONPATH": str(root)}
    child = subprocess.Popen(
        [*command, "--no-figures"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8", env=environment
    )
    # It prints that it sleeps once it runs.
    deadline = time.monotonic() + 60
    while not (here / "sleeping").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    child.send_signal(signal.SIGINT)
    out, _ = child.communicate(timeout=60)
    assert child.returncode == 130
    assert "lumped.py:asleep was interrupted" in " ".join(out.split())
    found = json.loads((here / "o" / "summary.json").read_text(encoding="utf-8"))
    assert found["fem3d"]["steady"][quantity]["value"] == pytest.approx(value, rel=1e-3)
    assert not found.get("reduced1d")
