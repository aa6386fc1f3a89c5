"""Sensitivities of both models side by side, their checks, and the report."""

import pytest

import compare
from compare.analyses import sensitivities
from compare.options import Options
from compare.outcome import Outcome
from compare.report.table import Style
from compare.slopes import Slopes
from scenes.result import Estimate
from scenes.sink import Sink
from validate.cli import main

WORDS = {"end_rise_K": "end rise"}


def made(**slopes: tuple[float, float]) -> dict[str, Slopes]:
    """The slopes (3D, 1D) of the end rise by keys."""
    errors = {"fem3d": 1e-4, "reduced1d": 0.0}
    return {
        model: Slopes({"end_rise_K": 1.0}, {k: {"end_rise_K": Estimate(v[n], error)} for k, v in slopes.items()})
        for n, (model, error) in enumerate(errors.items())
    }


def test_a_slope_is_judged_by_the_largest_of_its_quantity():
    found = sensitivities.checks(Sink(), made(voltage=(2.0, 2.0), width=(0.5, 0.65), length=(-0.5, -0.75)), WORDS)
    verdicts = {check.id: check.verdict for check in found}
    assert verdicts == {"slope_voltage": "agrees", "slope_width": "agrees", "slope_length": "differs"}
    by_id = {check.id: check for check in found}
    assert by_id["slope_length"].difference == pytest.approx(-0.125)
    assert by_id["slope_length"].u_num == pytest.approx(5e-5)


def test_the_worst_in_a_sentence():
    checks = sensitivities.checks(Sink(), made(width=(2.0, 0.8), length=(-0.5, -0.5)), WORDS)
    said = "In the 1D model the end rise follows width by +0.800, in 3D by +2.000 % for each percent."
    assert sensitivities.sentence(checks) == said


def test_a_slope_that_the_error_leaves_open_is_counted_and_explained():
    """0.2002 of 2, with relative errors of 1e-3: on either side of the tolerance of 10 %."""
    found = made(width=(2.0, 2.0), length=(-0.5, -0.5 - 0.20002))
    checks = sensitivities.checks(Sink(), found, WORDS)
    assert [check.verdict for check in checks] == ["agrees", "unresolved"]
    assert "as far as the errors tell: 1 of 2 are open" in sensitivities.sentence(checks)
    outcome = Outcome(Sink(), Options(sensitivities=True), checks=checks, slopes=found)
    said = " ".join(sensitivities.Sensitivity().section(found, outcome, Style()).text(Style()).split())
    assert "1D follows 1 of 2 keys as 3D does, within 10 % of the largest. ?: 1 are open" in said


def test_nothing_to_say_where_they_agree():
    checks = sensitivities.checks(Sink(), made(width=(2.0, 2.0)), WORDS)
    assert sensitivities.sentence(checks) == "The 1D model follows every key as 3D does."
    assert sensitivities.sentence(()) == ""


def test_a_tolerance_of_ones_own():
    sink = Sink(tolerances={"slope": 0.5})
    assert sensitivities.checks(sink, made(width=(2.0, 1.5)), WORDS)[0].verdict == "agrees"


def test_the_command(tmp_path, ran):
    summary, said = ran("sink --sensitivities --steady --accuracy 1e-2")
    assert "anchor.pad_width" in said
    slope = summary["sensitivities"]["anchor.oxide_thickness"]["end_rise_K"]
    assert slope["fem3d"]["value"] == pytest.approx(0.2345, abs=slope["fem3d"]["error"])
    assert slope["reduced1d"]["value"] == pytest.approx(0.3109, abs=1e-4)
    checks = {check["id"]: check["verdict"] for check in summary["checks"]}
    assert checks["slope_anchor.pad_width"] == "differs"
    assert checks["slope_drive.voltage"] == "agrees"
    assert "Sensitivities" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")


@pytest.mark.long
def test_from_python_and_one_model_alone(tmp_path):
    assert compare.run("sink", steady=True, accuracy=1e-2).sensitivities == {}
    run = compare.run("sink", steady=True, accuracy=1e-2, sensitivities=True)
    assert run.sensitivities["fem3d"].relative["sink.length"]["end_rise_K"].error > 0
    assert run.check("slope_sink.length").verdict == "agrees"
    assert main(["sink", "--only", "1d", "--sensitivities", "--no-figures", "--out", str(tmp_path / "one")]) == 0
    assert (tmp_path / "one" / "sensitivities.csv").exists()


@pytest.mark.long
def test_a_free_scene(tmp_path, ran):
    found, said = ran("solve bridge --sensitivities --uncertain box.beam.upper.z=0.1um")
    assert "0, of which there is no percent: boundary.right electrode.voltage." in said
    slope = found["sensitivities"]["box.beam.upper.z"]["current"]["fem3d"]
    # A beam of 2 um is wider across the current by a percent for each percent, nearly.
    assert slope["value"] == pytest.approx(0.989, abs=1e-3)
    current = found["fem3d"]["steady"]["current"]
    assert current["u_input"] == pytest.approx(0.05 * slope["value"] * current["value"])
    assert "Sensitivities" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")


def test_what_no_number_of_a_free_scene_is(capsys):
    for key in ("box.beam.upper.w=1um", "boundary.right electrode.voltage=1%", "beam.upper.z=1V"):
        assert main(["solve", "bridge", "--uncertain", key]) == 2
        assert capsys.readouterr().err.count("\n") == 1
