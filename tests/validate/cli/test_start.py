"""How the command starts in any environment: Ctrl-C at once, closed streams, names in other encodings, packages that
are missing."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.validate.cli import summary
from validate.cli import main

ROOT = Path(__file__).parents[3]
START = [sys.executable, "-m", "validate"]
SWEEP = "sweep sink --vary sink.width=50um,100um --steady --workers 1"
INTERRUPTED = """
import os, signal, sys
from importlib.abc import MetaPathFinder

class Interrupting(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name == "{module}":
            os.kill(os.getpid(), signal.{name})

sys.meta_path.insert(0, Interrupting())
from validate.__main__ import command
sys.exit(command())
"""
"""The command, with Ctrl-C or a kill where it begins to import a module."""


@pytest.mark.parametrize(
    ("module", "name"),
    [("validate.cli", "SIGINT"), ("scenes.errors", "SIGINT"), ("scipy", "SIGINT"), ("scipy", "SIGTERM")],
)
def test_an_interrupt_while_it_starts_is_no_traceback(module, name, tmp_path):
    code = INTERRUPTED.format(module=module, name=name)
    command = [sys.executable, "-c", code, "sink", "--steady", "--no-figures", "--out", "run"]
    found = subprocess.run(command, capture_output=True, encoding="utf-8", cwd=tmp_path, check=False)
    assert found.returncode in (130, -2)  # a shell shows both as 130
    assert found.stderr in ("", "validate: interrupted; earlier results are as they were\n")
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_read_from_files_before_an_interrupt_is_provided_for():
    """Without Python's own start, which no program controls."""
    code = (
        "import sys; before = set(sys.modules); import validate.__main__; "
        "print(*sorted(set(sys.modules) - before - set(sys.builtin_module_names)))"
    )
    found = subprocess.run(
        [sys.executable, "-S", "-c", code], capture_output=True, encoding="utf-8", check=True, cwd=ROOT
    )
    assert found.stdout.split() == ["validate", "validate.__main__"]


@pytest.mark.long
@pytest.mark.parametrize("closed", [(0, 1, 2), (2,)])
def test_without_standard_streams(closed, tmp_path):
    """The next opened files do not replace them: the files are whole, and the status is the run's."""

    def close() -> None:
        for stream in closed:
            os.close(stream)

    command = [*START, "sink", "--only", "1d", "--no-figures", "--out", "run"]
    found = subprocess.run(command, preexec_fn=close, capture_output=True, encoding="utf-8", cwd=tmp_path, check=False)
    assert found.returncode == 0
    assert ("peak" in found.stdout) == (1 not in closed)
    assert found.stderr == ""
    assert summary(tmp_path / "run")["reduced1d"]["steady"]["peak_rise_K"]["value"] == pytest.approx(19.0, rel=1e-3)
    bad = [*START, "sink", "--voltage", "abc"]
    found = subprocess.run(bad, preexec_fn=close, capture_output=True, encoding="utf-8", cwd=tmp_path, check=False)
    assert (found.returncode, found.stdout) == (2, "")
    assert found.stderr.startswith("validate: drive.voltage") == (2 not in closed)


def test_a_full_standard_output_is_a_sentence(tmp_path):
    with open("/dev/full", "w", encoding="utf-8") as full:
        found = subprocess.run(
            [*START, "scene", "sink"], stdout=full, stderr=subprocess.PIPE, encoding="utf-8", check=False
        )
    assert (found.returncode, found.stderr) == (
        2, "validate: standard output cannot be written (No space left on device)\n",
    )  # fmt: skip


def test_a_file_name_that_is_not_utf_8(tmp_path, capsys):
    name = os.fsdecode(b"\xff.toml")
    main(["scene", "bridge"])
    Path(name).write_text(capsys.readouterr().out, encoding="utf-8")
    assert main(["solve", name, "--no-figures", "--out", "run"]) == 0
    assert json.loads(Path("run/summary.json").read_bytes())["command"].startswith("validate solve '\\xff.toml'")
    assert main(["solve", name.replace("toml", "tml")]) == 2
    assert '"\\udcff.tml" is no file' in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize(
    ("module", "package", "command"),
    [
        ("skfem", "scikit-fem", "sink --steady --no-figures"),
        ("scipy", "scipy", SWEEP),
        ("matplotlib", "matplotlib", "sink --only 1d"),
    ],
)
def test_a_missing_package_is_named(module, package, command, tmp_path):
    (tmp_path / f"{module}.py").write_text(f"raise ModuleNotFoundError('none', name='{module}')", encoding="utf-8")
    run = [*START, *command.split()]
    path = os.environ | {"PYTHONPATH": str(tmp_path)}
    found = subprocess.run(run, env=path, cwd=tmp_path, capture_output=True, encoding="utf-8", check=False)
    said = f"validate: the package {package} is missing: pip install {package}\n"
    # Progress may stand above it.
    assert (found.returncode, found.stderr.splitlines(keepends=True)[-1]) == (2, said)


def test_a_missing_module_of_ours_is_a_fault(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "validate.viewer.window", None)
    assert main(["view", ".", "--screenshot", "a.png"]) == 3
    assert "a fault of this program" in capsys.readouterr().err
