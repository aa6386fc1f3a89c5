"""The interface from Python, and the assertions for a user's own tests; with a stand-in for the 3D solver."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import compare
import scenes
from compare.testing import assert_reduction_agrees, assert_traces_agree
from scenes.errors import SceneError

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.usefixtures("no_solver")


@pytest.fixture(autouse=True)
def _somewhere_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_three_lines(tmp_path: Path) -> None:
    scene = scenes.load("sink")
    run = compare.run(scene, voltage=1)
    check = run.check("eq13")
    assert check.verdict == "agrees"
    assert set(run.checks) >= {"eq12", "fig6_peak"}
    time, three, one = run.traces("peak_K")
    assert len(time) == len(three) == len(one)
    assert "eq14" in run.report()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_only_where_asked_for() -> None:
    compare.run("sink", steady=True, out="mine")
    assert Path("mine/report.html").exists()


def test_another_voltage_withdraws_what_the_scene_declares() -> None:
    scene = scenes.load("sink")
    assert compare.run(scene, voltage=1, steady=True).scene == scene
    moved = compare.run(scene, voltage=2, accuracy=1e-2, steady=True).scene
    assert (moved.voltage, moved.accuracy, moved.expected_to_differ) == (2.0, 1e-2, None)


def test_refusals() -> None:
    run = compare.run("sink", steady=True)
    with pytest.raises(SceneError, match='did you mean "eq13"'):
        run.check("eq133")
    with pytest.raises(SceneError, match="they need the transient"):
        run.check("fig6_peak")
    with pytest.raises(SceneError, match="transient"):
        run.traces("peak_K")
    with pytest.raises(SceneError, match="no trace"):
        compare.run("sink").traces("peek_K")
    with pytest.raises(SceneError, match="out="):
        compare.run("sink", figures=True)
    with pytest.raises(SceneError, match=r"drive\.voltage"):
        compare.run("sink", voltage=1e9)
    with pytest.raises(AttributeError, match="nothing"):
        compare.nothing  # noqa: B018


def test_within_and_outside() -> None:
    """The stand-in's end rise is off by 30 %, its mean by 9 %."""
    scene = scenes.load("sink")
    assert_reduction_agrees(scene, mean=0.1, eq13=0.02)
    with pytest.raises(AssertionError) as caught:
        assert_reduction_agrees(scene, mean=0.1, end=0.05)
    text = str(caught.value)
    assert text.index("end: steady end rise") < text.index("mean: steady mean rise")
    assert "OUTSIDE the tolerance of 5" in text
    assert "within the tolerance of 10" in text
    with pytest.raises(AssertionError, match="eq14"):
        assert_reduction_agrees(scene, eq14=0.01)


def test_a_tolerance_within_the_numerical_error_is_undecided() -> None:
    run = compare.run("sink", steady=True)
    a, b = run.reduced1d.steady["mean_rise_K"].value, run.fem3d.steady["mean_rise_K"].value
    with pytest.raises(AssertionError, match="UNDECIDED"):
        assert_reduction_agrees(scenes.load("sink"), mean=abs(a / b - 1))


def test_what_cannot_be_asserted() -> None:
    scene = scenes.load("sink")
    with pytest.raises(SceneError, match="nothing to assert"):
        assert_reduction_agrees(scene)
    with pytest.raises(SceneError, match='did you mean "peak"'):
        assert_reduction_agrees(scene, peek=0.1)
    with pytest.raises(SceneError, match="5 %"):
        assert_reduction_agrees(scene, peak=-1)


def test_traces_of_a_file() -> None:
    run = compare.run("sink")
    time, three, _ = run.traces("peak_K")
    Path("good.csv").write_text("time_s,peak_K\n" + "".join(f"{t!r},{v!r}\n" for t, v in _rows(time, three)))
    less = 293 + 0.9 * (three - 293)
    Path("bad.csv").write_text("time_s,peak_K\n" + "".join(f"{t!r},{v!r}\n" for t, v in _rows(time, less)))
    assert_traces_agree("sink", "good.csv", peak=0.01)
    with pytest.raises(AssertionError, match=r"bad\.csv"):
        assert_traces_agree("sink", "bad.csv", peak=0.05)
    with pytest.raises(SceneError, match="against_end"):
        assert_traces_agree("sink", "good.csv", end=0.05)


def _rows(time: object, values: object) -> list[tuple[float, float]]:
    return list(zip(time.tolist(), values.tolist(), strict=True))  # type: ignore[attr-defined]


def test_importing_costs_nothing() -> None:
    heavy = "{'numpy', 'scipy', 'skfem', 'matplotlib', 'pyvista'}"
    code = f"import sys, scenes, compare\nprint(sorted({heavy} & set(sys.modules)))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert found.stdout.strip() == "[]"
