"""The command for the whole sensor: exit statuses, what is printed and what is written."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compare.cli import main
from compare.device.scope import FIGURES
from reduced1d.device import QUANTITIES
from scenes.checks import DEVICE_TOLERANCES
from scenes.loading import from_dict, load
from scenes.types import DEVICE

QUICK = ("--set", "control.sample_time=1ms", "--set", "control.sink_gain=0.5")


@pytest.fixture(autouse=True)
def _somewhere_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def device(*arguments: str) -> int:
    return main(["device", *arguments])


def summary(folder: str) -> dict[str, Any]:
    found = json.loads(Path(folder, "summary.json").read_text(), parse_constant=pytest.fail)
    assert isinstance(found, dict)
    return found


def test_the_summary_has_the_contract(capsys: pytest.CaptureFixture[str]) -> None:
    assert device(*QUICK, "--no-figures", "--max-power", "20 mW", "--out", "one") == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 80
    assert "PXI-4070" in text
    found = summary("one")
    assert {"schema", "scene", "plan", "provenance", "reduced1d", "checks", "findings", "timing_s"} <= set(found)
    assert from_dict(found["scene"], DEVICE).control.sample_time == 1e-3
    assert [check["id"] for check in found["checks"]] == list(DEVICE_TOLERANCES)
    keys = {"id", "title", "predicted", "measured", "difference", "tolerance", "u_num", "verdict", "because"}
    assert all(keys <= set(check) and check["because"] for check in found["checks"])
    model = found["reduced1d"]
    for state in ("steady", "steady_before", "peaks"):
        assert set(model[state]) == set(QUANTITIES)
    assert model["steady"]["sensor_power_W"]["value"] == pytest.approx(5.625e-3, rel=1e-12)
    assert model["steady_before"]["sensor_power_W"]["value"] == pytest.approx(2.625e-3, rel=1e-12)
    assert set(model["errors"]) == set(QUANTITIES)
    assert found["design"]["range"]["lowest_K"] == pytest.approx(310.5 - 20e-3 / 1.5e-4)
    assert found["design"]["limits"][0]["sample_time_s"] == 1e-3
    assert (
        set(found["files"])
        == {entry.name for entry in Path("one").iterdir()}
        == {"report.html", "summary.json", "traces.csv"}
    )


def test_traces_have_a_row_per_sample_and_obey_eq_21() -> None:
    assert device(*QUICK, "--no-figures", "--figure", "9", "--quiet", "--out", "one") == 0
    with open("one/traces.csv") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time_s", *(f"reduced1d_{name}" for name in QUANTITIES)]
    columns = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    assert columns["time_s"] == pytest.approx(np.arange(501) * 1e-3)
    rise, volts = columns["reduced1d_sensor_K"] - 293.0, columns["reduced1d_sensor_V"]
    raised = np.maximum(np.r_[0.0, volts[:-1]] + 0.05 * (1 - rise / 17.5), 0.0)
    assert volts == pytest.approx(raised, abs=1e-12)
    resistance = 2.23e-8 * 1e-3 / (100e-6 * 0.2e-6) * (1 + 3.768e-3 * rise)
    assert columns["reduced1d_sensor_power_W"] == pytest.approx(volts**2 / resistance, rel=1e-12)


def test_the_default_scene_comes_out_as_it_declares(capsys: pytest.CaptureFixture[str]) -> None:
    assert device("--strict", "--figure", "9", "--figure", "10", "--no-figures", "--quiet") == 0
    assert "as the scene declares" in capsys.readouterr().out
    assert [check["id"] for check in summary("results/device-273K-figure9-figure10")["checks"]] == [
        "fig9_settling", "fig9_balance", "fig10_steady",
    ]  # fmt: skip


def test_a_contradicted_declaration_is_status_1() -> None:
    options = (*QUICK, "--no-figures", "--figure", "10", "--quiet")
    assert device(*options, "--set", "expect_differs=fig10_steady") == 1
    assert device(*options, "--strict", "--set", "final_temperature=315") == 1


def test_all_figures_are_drawn() -> None:
    named = [option for name in FIGURES for option in ("--figure", name.removeprefix("figure"))]
    assert device(*QUICK, *named, "--quiet", "--out", "all") == 0
    drawn = {f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")}
    assert {entry.name for entry in Path("all").iterdir()} == drawn | {"report.html", "summary.json", "traces.csv"}
    assert "DIFFERS: paper: the time is the same for all" in Path("all/figure12.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--set", "control.sampletime=1ms"), 'did you mean "control.sample_time"'),
        (("--set", "set_temperature=290"), "control.set_temperature = 290 K asks for cooling"),
        (("--set", "sample_time=1us", "--set", "end_time=2"), "at most 1000000 samples"),
        (("--set", "gold.temperature_coefficient=0"), "without a signal"),
        (("--set", "final_temperature=20"), "external.final_temperature = 20.0 K"),
        (("--set", "allow_negative_voltage=maybe"), "neither true nor false"),
        (("--max-power", "1 V"), "--max-power"),
        (("--figure", "8"), "invalid choice"),
        (("--figur", "9"), 'did you mean "--figure"'),
        (("none.toml",), "the built-in device"),
        (("--scheme", "paper", "--set", "sensor_thickness=50nm"), "stable only up to 0.7"),
    ],
)
def test_refusals_are_one_sentence(arguments: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert device(*arguments, "--no-figures") == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert said in printed.err
    assert not Path("results").exists()


def test_the_scene_is_printed_and_reads_back(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["scene", "device"]) == 0
    (tmp_path / "copy.toml").write_text(capsys.readouterr().out)
    assert load("copy.toml", of=DEVICE) == load("device", of=DEVICE)


def test_eq_21_as_printed_runs_away_and_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    literal = ("--set", "allow_negative_voltage=true", "--no-figures", "--figure", "9")
    assert device(*literal, "--out", "one") == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "above room temperature (ceiling 2000 K)" in text
    assert all(check["verdict"] == "differs" for check in summary("one")["checks"])


def test_a_sensor_without_gain_has_no_characteristic() -> None:
    assert device(*QUICK, "--set", "sensor_gain=0", "--figure", "13", "--figure", "12", "--no-figures") == 0
    (folder,) = Path("results").iterdir()
    assert all(check["verdict"] == "differs" for check in summary(str(folder))["checks"])


def test_an_unstable_loop_is_a_finding(capsys: pytest.CaptureFixture[str]) -> None:
    assert device("--set", "sample_time=5ms", "--no-figures", "--figure", "9", "--set", "sensor_gain=2") == 0
    assert "unstable about the steady state" in " ".join(capsys.readouterr().out.split())


def test_the_plan_says_what_is_skipped(capsys: pytest.CaptureFixture[str]) -> None:
    assert device(*QUICK, "--explain", "--no-figures", "--figure", "10") == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "skipped designer's questions: only figure10 asked for" in text
    assert "done checks: fig10_steady" in text
