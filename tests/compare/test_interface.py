"""The interface from Python and the options table that it is made from, and the assertions for a user's own tests; with
a stand-in for the 3D solver of a sink."""

import inspect
import math
import subprocess
import sys
from dataclasses import replace
from html import unescape
from pathlib import Path

import pytest

import compare
import scenes
from compare.kinds import KINDS
from compare.options import Options, of_kind
from compare.testing import assert_reduction_agrees, assert_traces_agree
from scenes.errors import SceneError
from scenes.loading import builtin_text

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.usefixtures("no_solver")


@pytest.fixture(autouse=True)
def _somewhere_else(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_three_lines_and_a_folder_only_where_asked_for(tmp_path):
    scene = scenes.load("sink")
    run = compare.run(scene, voltage=1)
    check = run.check("eq13")
    assert check.verdict == "agrees"
    assert set(run.checks) >= {"eq12", "fig6_peak"}
    time, three, one = run.traces("peak_K")
    assert len(time) == len(three) == len(one)
    assert "eq14" in run.report()
    assert list(tmp_path.iterdir()) == []
    compare.run("sink", steady=True, out="mine")
    assert Path("mine/report.html").exists()


def test_another_voltage_withdraws_what_the_scene_declares():
    scene = scenes.load("sink")
    assert compare.run(scene, voltage=1, steady=True).scene == scene
    moved = compare.run(scene, voltage=2, accuracy=1e-2, steady=True).scene
    assert (moved.voltage, moved.accuracy, moved.expected_to_differ) == (2.0, 1e-2, None)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (lambda: compare.solve(3), "3 is no scene: give a name"),
        (lambda: compare.run(voltage="x"), r'drive\.voltage = "x" is not a number with a unit'),
        (lambda: compare.run(voltage=[1, 2]), r'drive\.voltage = "1,2" is not a number with a unit'),
        (lambda: compare.run(overrides=[3]), '"3" sets nothing: give KEY=VALUE'),
        (lambda: compare.run(overrides=3), '"3" sets nothing: give KEY=VALUE'),
        (lambda: compare.run(steady="yes"), 'steady is "yes": give True or False'),
        (lambda: compare.run(only="4d"), 'only is "4d": give 3d or 1d'),
        (lambda: compare.device(meter=3), 'meter is "3": give PXI-4070 or MAX1367'),
        (lambda: compare.run(uncertain=3), '--uncertain "3" says nothing'),
        (lambda: compare.run(against=3), '--against "3" cannot be read'),
        (lambda: compare.solve("bridge", model=3), '"3" is no model'),
        (lambda: compare.run(uncertain={"sink.width": "1%"}, monte_carlo=10), 'no option "monte_carlo"'),
        (lambda: compare.run("sink", figures=True), "out="),
        (lambda: compare.run("sink", voltage=1e9), r"drive\.voltage"),
        (lambda: compare.run("bridge"), r"use compare\.solve"),
        (lambda: compare.solve("sink"), r"use compare\.run"),
        (lambda: scenes.load("brigde"), 'did you mean "bridge"'),
        (lambda: compare.device(about=[14]), "is no figure: give figure9, "),
        (lambda: compare.device(metre="MAX1367"), 'did you mean "meter"'),
        (lambda: compare.run(steady=True).check("eq133"), 'did you mean "eq13"'),
        (lambda: compare.run(steady=True).check("fig6_peak"), "only the steady state was asked for"),
        (lambda: compare.run(steady=True).traces("peak_K"), "transient"),
        (lambda: compare.run().traces("peek_K"), "no common transient"),
        (lambda: compare.solve("plate", accuracy=0.1).check("heater"), "this run made no check"),
    ],
)
def test_wrong_values_are_refused_in_a_sentence(given, said):
    with pytest.raises(SceneError, match=said) as caught:
        given()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("resistance", [math.inf, math.nan, -1.0])
def test_a_scene_changed_in_python_is_checked_like_a_file(resistance):
    bridge = scenes.load("bridge")
    boundaries = tuple(replace(each, contact_resistance=resistance) for each in bridge.boundaries)
    contact = scenes.model.Contact("glue", ("beam", "left foot"), resistance)
    for changed in ({"boundaries": boundaries}, {"contacts": (contact,)}):
        for overrides in ({}, {"run.accuracy": "1e-2"}):
            with pytest.raises(SceneError, match=r"resistance = .* m2 K/W") as caught:
                compare.solve(replace(bridge, **changed), overrides=overrides)
            assert "\n" not in str(caught.value)


def test_a_temperature_behind_a_resistance_is_a_film_in_python_too():
    bridge = replace(scenes.load("bridge"), steady=True)
    base, *electrodes = bridge.boundaries
    changed = replace(bridge, boundaries=(replace(base, contact_resistance=1e-6), *electrodes))
    film = replace(base, kind="convection", value=1e6, ambient=base.value)
    warm, same, cool = (compare.solve(each).fem3d.steady["middle"] for each in (
        changed, replace(bridge, boundaries=(film, *electrodes)), bridge
    ))  # fmt: skip
    assert warm == same
    assert warm.value - cool.value > 10 * warm.error


def test_within_and_outside():
    """The stand-in's end rise is off by 30 %, its mean by 9 %."""
    scene = scenes.load("sink")
    assert_reduction_agrees(scene, mean="10 %", eq13=0.02)
    with pytest.raises(AssertionError) as caught:
        assert_reduction_agrees(scene, mean=0.1, end=0.05)
    text = str(caught.value)
    assert text.index("end: steady end rise") < text.index("mean: steady mean rise")
    assert "OUTSIDE the tolerance of 5" in text
    assert "within the tolerance of 10" in text
    with pytest.raises(AssertionError, match="eq14"):
        assert_reduction_agrees(scene, eq14=0.01)


def test_a_tolerance_within_the_numerical_error_is_undecided():
    run = compare.run("sink", steady=True)
    a, b = run.reduced1d.steady["mean_rise_K"].value, run.fem3d.steady["mean_rise_K"].value
    with pytest.raises(AssertionError, match="UNDECIDED"):
        assert_reduction_agrees(scenes.load("sink"), mean=abs(a / b - 1))


@pytest.mark.parametrize(("tolerances", "said"), [
    ({}, "nothing to assert"), ({"peek": 0.1}, 'did you mean "peak"'), ({"peak": -1}, "5 %"),
    ({"end": 40}, "end = 40 is out of range"), ({"end": "5 K"}, "is a temperature, not a plain number"),
    ({"end": "much"}, "not a number"), ({"end": None}, "not a plain number"), ({"end": float("nan")}, "finite"),
])  # fmt: skip
def test_what_cannot_be_asserted(tolerances, said):
    with pytest.raises(SceneError, match=said):
        assert_reduction_agrees(scenes.load("sink"), **tolerances)


def test_traces_of_a_file():
    time, three, _ = compare.run("sink").traces("peak_K")
    for name, values in (("good.csv", three), ("bad.csv", 293 + 0.9 * (three - 293))):
        rows = [f"{t!r},{v!r}\n" for t, v in zip(time.tolist(), values.tolist(), strict=True)]
        Path(name).write_text("time_s,peak_K\n" + "".join(rows), encoding="utf-8")
    assert_traces_agree("sink", "good.csv", peak=0.01)
    with pytest.raises(AssertionError, match=r"bad\.csv"):
        assert_traces_agree("sink", "bad.csv", peak=0.05)
    with pytest.raises(SceneError, match="against_end"):
        assert_traces_agree("sink", "good.csv", end=0.05)


def test_importing_costs_nothing():
    heavy = "{'numpy', 'scipy', 'skfem', 'matplotlib', 'pyvista'}"
    code = f"import sys, scenes, compare\nscenes.load('sink', ['voltage=2'])\nprint(sorted({heavy} & set(sys.modules)))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", cwd=ROOT, check=True)
    assert found.stdout.strip() == "[]"


def test_a_run_prints_as_its_answer():
    run = compare.run("sink")
    text = repr(run)
    assert " ".join(text.split()).startswith(run.answer)
    assert max(map(len, text.splitlines())) <= 80
    html = run._repr_html_()
    assert run.answer.split(";")[0] in unescape(html)
    assert "eq14" in html
    assert "object at 0x" not in repr(run.traces)


def test_traces_are_named_columns():
    run = compare.run("sink")
    columns = run.traces
    assert list(columns)[:2] == ["time_s", "fem3d_peak_K"]
    assert (columns["reduced1d_end_K"] == run.traces("end_K")[2]).all()
    with pytest.raises(KeyError, match="fem3d_peak_K"):
        columns["fem3d_peek_K"]
    assert len(compare.run("sink", steady=True).traces) == 0


def test_overrides_and_another_reduction():
    for overrides in (["sink.width=20um"], {"sink.width": 2e-5}):
        assert compare.run("sink", overrides=overrides, only="1d", steady=True).scene.width == pytest.approx(2e-5)
    given = {"sink.width": "20um"}
    run = compare.run(scenes.load("sink"), overrides=given, reduction="plate", why=True, steady=True)
    assert run.scene.width == pytest.approx(2e-5)
    assert run.scene.expected_to_differ is None
    assert run.reduced1d.model == "plate"
    assert run.why is not None
    assert "plate differs from 3D" in run.report()


def test_a_free_scene():
    found = compare.solve("bridge", overrides={"boundary.left electrode.voltage": "0.5V"})
    assert "middle" in repr(found)
    assert "middle" in found._repr_html_()
    assert len(found.traces) == 0
    with pytest.raises(KeyError, match="middle"):
        found["midle"]
    assert list(Path().iterdir()) == []


def test_any_scene_loads_by_its_name_or_file():
    assert type(scenes.load("bridge")) is type(scenes.load("plate"))
    for name in ("sink", "device", "bridge"):
        Path(f"{name}-2.toml").write_text(builtin_text(name), encoding="utf-8")
        assert type(scenes.load(f"{name}-2.toml")) is type(scenes.load(name))


def test_what_a_scene_declares_is_of_the_papers_model_without_a_meter():
    said = compare.run("sink", reduction="fin", steady=True).report()
    assert "differ.\n" in said
    assert "declare" not in said
    # The fin's current is 3D's within the error, and no digit of their difference is sure.
    assert " within " in said.split("current ")[1].split("\n")[0]
    device = scenes.load("device")
    assert KINDS["device"].declared(device, Options()) == device
    assert KINDS["device"].declared(device, Options(meter="MAX1367")).expected_to_differ is None


def test_the_python_interface_has_the_options_of_the_table():
    for kind, function in (("sink", compare.run), ("free", compare.solve), ("device", compare.device)):
        parameters = inspect.signature(function).parameters
        assert {option.key for option in of_kind(kind) if option.keyword != ""} <= set(parameters)
        assert "sensitivities : " in (function.__doc__ or "")
    assert {"steady", "why", "calibrate", "export"} <= set(inspect.signature(compare.solve).parameters)


def test_overrides_take_python_values():
    found = compare.solve("hotplate", overrides={"run.steady": True, "boundary.drive.voltage": 0.2}, accuracy=1e-2)
    assert found.steady.keys() == {probe.name for probe in found.scene.probes}
