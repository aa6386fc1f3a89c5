"""The command for the whole sensor: exit statuses, printed text and files."""

import csv
import json
import re
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from compare.options import FIGURES, Options
from compare.pipeline import solve
from scenes.checks import DEVICE_TOLERANCES
from scenes.keys import DEVICE
from scenes.loading import load
from statespace.result import QUANTITIES
from tests.validate.cli import page_text, summary
from validate.cli import main
from validate.report.figures import device_figures as drawn

QUICK = ("--set", "control.sample_time=1ms", "--set", "control.sink_gain=0.5")


def device(*arguments: str) -> int:
    return main(["device", *arguments])


def test_traces_have_a_row_per_sample_and_obey_eq_21():
    assert device(*QUICK, "--no-figures", "--figure", "9", "--quiet", "--out", "one") == 0
    with open("one/traces.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time_s", *(f"reduced1d_{name}" for name in QUANTITIES)]
    columns = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    assert columns["time_s"] == pytest.approx(np.arange(501) * 1e-3)
    rise, volts = columns["reduced1d_sensor_K"] - 293.0, columns["reduced1d_sensor_V"]
    raised = np.maximum(np.r_[0.0, volts[:-1]] + 0.05 * (1 - rise / 17.5), 0.0)
    assert volts == pytest.approx(raised, abs=1e-12)
    resistance = 2.23e-8 * 1e-3 / (100e-6 * 0.2e-6) * (1 + 3.768e-3 * rise)
    assert columns["reduced1d_sensor_power_W"] == pytest.approx(volts**2 / resistance, rel=1e-12)


def test_what_is_exported_is_said_and_kept(capsys):
    options = ("--set", "run.end_time=30ms", "--set", "external.step_time=20ms", "--figure", "10", "--no-figures")
    assert device(*QUICK, *options, "--export", "my-sensor", "--states", "9", "--out", "one") in (0, 1)
    said = " ".join(capsys.readouterr().out.split())
    assert "Exported a compact model and its controllers (9 states, within " in said
    assert "outside.temperature outside_temperature outside_temperature" in said
    kept = {entry.name for entry in Path("my-sensor").iterdir()} - {"__pycache__"}
    assert kept - {"model.fmu", "controllers.fmu"} == {"model.json", "model.py", "model.cir", "controllers.py"}
    made = json.loads(Path("my-sensor/model.json").read_text(encoding="utf-8"))
    assert made["controllers"]["gain_V"] == [0.5, 0.05]
    worst = made["error"]["closed loop"]["over time"]["sensor_K"]
    assert worst["error"] == pytest.approx(17.5 * worst["relative"])
    steps = [step for step in summary("one")["plan"] if step["step"] == "export"]
    assert steps[0]["reason"].startswith("a compact model, compared")


@pytest.mark.long
def test_all_figures_are_drawn():
    named = [option for name in FIGURES for option in ("--figure", name.removeprefix("figure"))]
    assert device(*QUICK, *named, "--quiet", "--out", "all") == 0
    drawn = {f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")}
    assert {entry.name for entry in Path("all").iterdir()} == drawn | {"report.html", "summary.json", "traces.csv"}
    assert "fig12_same_time DIFFERS: same, all steps, paper " in Path("all/figure12.svg").read_text(encoding="utf-8")
    assert "-150.0 \N{MICRO SIGN}W/K" in Path("all/figure13.svg").read_text(encoding="utf-8")


SAID = {
    "--set sample_time=50ms --figure 9": [
        "near instability: its largest eigenvalue per sample is 0.8721",
        "the sensor's gain of 0.05 V is 0.757 times its largest stable one",
    ],
    "--set sample_time=1ms --set sink_gain=0.5 --set sensor_gain=0 --figure 12 --figure 13": ["fig13_slope", "differs"],
    "--set sample_time=1ms --set sink_gain=0.5 --figure 10 --explain": [
        "skipped designer's questions: only figure10 asked for", "planned checks: fig10_steady",
    ],
}  # fmt: skip


@pytest.mark.parametrize("arguments", SAID)
def test_what_is_found_is_said(arguments, capsys):
    assert device(*arguments.split(), "--no-figures", "--out", "one") == 0
    text = " ".join(capsys.readouterr().out.split())
    assert [said for said in SAID[arguments] if said not in text] == []
    if "sensor_gain=0" in arguments:
        assert {check["verdict"] for check in summary("one")["checks"]} == {"differs"}


EXTREMES = {
    "sample_time=50ms": "does not settle to 1 %: it is bound for 5.625 mW (see Findings)",
    "sink_gain=50 sensor_gain=50":
        "the run was stopped at 0.0001 s: the sensor was 9079 K above room",
    "sample_time=1ms sink_gain=0.5 sensor_gain=0":
        "the sensor's power settles to 1 % in 0 ms, at 0 W",
    "end_time=1ms":
        "from cold, with 293 K outside, the sensor's power does not settle to 1 %",
    "sample_time=1ms sink_gain=0.5 step_time=2":
        "from cold, with 293 K outside, the sensor's power settles to 1 % in 69.4 ms, at 2.625 mW",
    "sample_time=1ms sink_gain=0.5 initial_temperature=330 final_temperature=350":
        "the sensor needs no power: it settles at 316.8",
    "allow_negative_voltage=true": "the run was stopped at 0.0033 s",
}  # fmt: skip


@pytest.mark.parametrize("settings", EXTREMES)
def test_extremes_are_told_in_words_and_in_columns_apart(settings, capsys):
    given = [part for setting in settings.split() for part in ("--set", setting)]
    assert device(*given, "--figure", "9", "--figure", "10", "--no-figures", "--out", "one") == 0
    text = capsys.readouterr().out
    assert EXTREMES[settings] in " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 80
    assert not re.search(r"\binf\b|\bnan\b|infinite", text)
    rows = re.findall(r"^  (?:sink|sensor|heat) .*$", text, re.MULTILINE)
    assert len(rows) == len(QUANTITIES)
    # Name, before, after, peak, at and up to two times, each a number with its unit or a word.
    cell = r"\s+(?:-?[\d.]+(?:e[+-]\d+)? \w+|never)"
    assert all(re.fullmatch(rf"  [a-z ]+?(?:{cell}){{4,6}}", row) for row in rows), rows
    assert EXTREMES[settings].split(",")[0] in page_text("one")


def test_the_whole_run_answers_the_designers_questions_in_text_summary_and_report(capsys):
    assert device(*QUICK, "--no-figures", "--max-power", "20 mW", "--out", "one") == 0
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 80
    text = " ".join(printed.split())
    assert "the sensor's power settles to 1 % in 61.6 ms, at 5.625 mW" in text
    assert "MAX1367: cannot resolve the outer temperature: its step of 80 K is more than the 37.5 K" in text
    assert "PXI-4070: resolves 0.24 K outside" in text
    found = summary("one")
    assert [check["id"] for check in found["checks"]] == list(DEVICE_TOLERANCES)
    assert all(bool(check["because"]) == (check["verdict"] != "agrees") for check in found["checks"])
    design = found["design"]
    assert design["range"]["lowest_K"] == pytest.approx(310.5 - 20e-3 / 1.5e-4)
    assert design["limits"][0]["sample_time_s"] == 1e-3
    assert design["limits"][0]["largest_eigenvalue"] < 1
    assert set(design["sources"]) == {"PXI-4070", "MAX1367"}
    assert all("not seen" in source for source in design["sources"].values())
    page = Path("one/report.html").read_text(encoding="utf-8").replace("&nbsp;", " ")
    assert not re.search(r"sink_K|sensor_power_W|_ohm|_per_s|time_s", page)
    assert '<th>check</th><th>of</th><th class="n">paper</th><th class="n">1D</th>' in page
    for said in ("at least ", "heat into polymer", "lowest", "177.17 K", "371304J-01"):
        assert said in page, said
    assert page.count("<tr") < 100


@pytest.mark.long
@pytest.mark.parametrize("setting", ["sample_time=50ms", "sensor_gain=0", "polymer_thickness=10mm"])
def test_no_text_of_a_figure_touches_another(setting):
    figure = Figure()
    figure.text(0.5, 0.5, "one"), figure.text(0.51, 0.5, "two")
    (_, one), (_, two) = _boxes(figure)
    assert one.overlaps(two)
    scene, options = load("device", ("sample_time=1ms", setting), scene_type=DEVICE), Options()
    outcome = solve(scene, options)
    draw = (drawn.power, drawn.flow, drawn.slow, drawn.responses, drawn.characteristic)
    for name, figure in zip(FIGURES, draw, strict=True):
        boxes = _boxes(figure(outcome))
        touching = [(a, b) for (a, one), (b, two) in combinations(boxes, 2) if one.overlaps(two)]
        assert touching == [], name


def _boxes(figure: Figure) -> list[tuple[str, Any]]:
    """Every text of a figure that is seen, with its box in pixels."""
    FigureCanvasAgg(figure)
    figure.draw_without_rendering()
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):
        low, high = sorted(axis.get_view_interval())
        # Labels beyond the ends of an axis are there, but not drawn.
        beyond = [tick.label1 for tick in axis.get_major_ticks() if not low <= tick.get_loc() <= high]
        texts = [text for text in texts if text not in beyond]
    return [(text.get_text(), text.get_window_extent()) for text in texts]
