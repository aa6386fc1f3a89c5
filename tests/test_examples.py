"""The examples run as they are, each in a process of its own and away from the clone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SAID = {
    "designer.py": ["10um", "agrees", "eq14"],
    "modeller.py": ["against_mean: differs", "lumped.csv"],
    "student.py": ["Equation 13", "2663."],
}


def run(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, *command], cwd=folder, env=env, capture_output=True, text=True, timeout=120, check=False
    )


@pytest.mark.parametrize("name", SAID)
def test_an_example_runs(name: str, tmp_path: Path) -> None:
    found = run([str(ROOT / "examples" / name)], tmp_path)
    assert (found.returncode, found.stderr) == (0, "")
    assert all(text in found.stdout for text in SAID[name])
    # Nothing is left behind.
    assert list(tmp_path.iterdir()) == []


def test_a_users_own_tests_run(tmp_path: Path) -> None:
    file = ROOT / "examples" / "test_my_sink.py"
    found = run(["-m", "pytest", "-q", "-p", "no:cacheprovider", str(file)], tmp_path)
    assert found.returncode == 0, found.stdout
    assert found.stdout.startswith("...")


def test_a_failing_assertion_reads_well(tmp_path: Path) -> None:
    """As a user would see it: both values, the difference, the tolerance, the numerical error, no line of this code."""
    (tmp_path / "test_mine.py").write_text(
        "import scenes\nfrom compare.testing import assert_reduction_agrees\n"
        "def test_peak(): assert_reduction_agrees(scenes.load('sink'), peak=0.05)\n"
    )
    found = run(["-m", "pytest", "-q", "-p", "no:cacheprovider", "test_mine.py"], tmp_path)
    assert found.returncode == 1
    for text in ("1D 18.99", "3D 20.33", "\N{PLUS-MINUS SIGN}", "difference -6.56", "tolerance of 5"):
        assert text in found.stdout
    assert "compare/testing.py" not in found.stdout
