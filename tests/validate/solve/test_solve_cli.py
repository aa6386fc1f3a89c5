"""`validate solve`: printed text and files, with a stand-in for the 3D solver."""

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista

from scenes.loading import builtin_text
from scenes.result import Traces
from tests.validate.cli import page_text, summary
from validate.cli import main

pytestmark = pytest.mark.usefixtures("no_solver")


def solve(*arguments: str, figures: bool = False) -> int:
    return main(["solve", *arguments, *([] if figures else ["--no-figures"])])


def test_transient_has_a_column_per_probe_by_its_name(capsys):
    assert solve("hotplate") == 0
    with open("results/hotplate/traces.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time_s", "heater", "plate", "current", "heat to the left"]
    assert [float(row["plate"]) for row in rows] == [-18.0, 1.0, 1.0, 2.0, 2.0]
    found = summary("results/hotplate")["fem3d"]
    assert found["units"] == {"heater": "K", "plate": "K", "current": "A", "heat to the left": "W"}
    assert found["transient"]["time_s"] == [1e-3, 2e-3, 3e-3, 4e-3]
    assert found["transient"]["values"]["heater"] == [1.0] * 4
    assert found["transient"]["errors"]["plate"] == 2e-3
    assert found["transient"]["accurate_from_s"] == 4e-6
    text = capsys.readouterr().out
    assert "The errors hold from 4.00 us on; earlier extremes have their own." in text
    # Without an error bound for earlier times -18 K is no result.
    assert found["transient"]["range"]["plate"] == {
        "end": 2.0, "least": 1.0, "least_error": 2e-3, "largest": 2.0, "largest_error": 2e-3
    }  # fmt: skip
    assert re.search(r"plate +2.0000 ± 0.0020 K +1.0000 ± 0.0020 K +2.0000 ± 0.0020 K", text)
    assert "at most" not in text


def test_where_errors_hold_after_jumps():
    traces = Traces(np.array([0.0, 10.0]), {}, {}, since=1.0, jumps=((4.0, 1.0), (5.0, 1.0)))
    times = np.array([0.0, 0.9, 1.0, 3.9, 4.0, 4.4, 4.5, 5.0, 5.9, 6.0, 10.0])
    assert times[traces.sure(times)].tolist() == [1.0, 3.9, 4.5, 6.0, 10.0]
    # A jump with a shorter while does not end a longer one.
    traces = replace(traces, jumps=((4.0, 1.0), (4.2, 0.1)))
    assert times[traces.sure(times)].tolist() == [1.0, 3.9, 5.0, 5.9, 6.0, 10.0]


def test_an_extreme_may_lie_where_errors_are_wide():
    """Soon after the start the truth may be as high as 2 + 5, and is nowhere below -3 + 0.1 for sure."""
    traces = Traces(np.arange(4.0), {"flow": np.array([2.0, -3.0, 1.0, 4.0])}, {"flow": 0.1}, 0.5, early={"flow": 5.0})
    assert [(e.value, e.error) for e in traces.extremes("flow")] == [(-3.0, 0.1), (4.0, 3.0)]


def test_terminal_reads_at_80_columns(capsys):
    for arguments in (["bridge"], ["hotplate"], ["plate", "--explain"]):
        solve(*arguments)
        text = capsys.readouterr().out
        assert max(map(len, text.splitlines())) <= 80
        assert "Warning: it is made up." in text
    lines = text.splitlines()
    assert lines[0] == "Plan"
    solve("bridge")
    lines = capsys.readouterr().out.splitlines()
    said = " ".join(lines)
    assert said.startswith("bridge: middle ")
    assert "current 3.0000 ± 0.0030 A, heat to the substrate " in " ".join(said.split())
    assert "Steady state in 3D, 8 unknowns, heat balanced to 1e-11." in lines
    solve("hotplate")
    assert re.search(r"hotplate: heater \S+ ± \S+ K.* after 4 ms", " ".join(capsys.readouterr().out.split()))
    assert any(line.split() == ["current", "3.0000", "±", "0.0030", "A"] for line in lines)


@pytest.mark.usefixtures("no_field")
def test_files_with_figures():
    solve("hotplate", figures=True)
    files = {entry.name for entry in Path("results/hotplate").iterdir()}
    assert {"figure_traces.png", "figure_traces.svg", "traces.csv", "summary.json"} <= files
    assert set(summary("results/hotplate")["files"]) == files


def test_fields(capsys):
    solve("plate", "--fields")
    assert {"fem3d.pvd", "fem3d_steady.vtu"} <= set(summary("results/plate-fields")["files"])
    solve("hotplate", "--fields")
    files = summary("results/hotplate-fields")["files"]
    reader = pyvista.get_reader("results/hotplate-fields/fem3d.pvd")
    assert reader.time_values == [0.0, 1e-3, 2e-3, 3e-3, 4e-3]
    assert set(files) == {entry.name for entry in Path("results/hotplate-fields").iterdir()}
    reader.set_active_time_point(4)
    grid = reader.read()[0]
    # The stand-in is coldest at 293 K, below the scene's 20 degC.
    assert abs(grid.point_data["rise_K"].min() - (293.0 - 293.15)) < 1e-9


def test_a_scene_without_probes_reports_mean_temperatures():
    Path("mine.toml").write_text(builtin_text("plate").partition("[[probe]]")[0], encoding="utf-8")
    assert solve("mine.toml") == 0
    assert list(summary("results/plate")["fem3d"]["steady"]) == ["mean plate"]


def test_the_report_of_a_transient_says_from_when_on_its_errors_hold_and_where_it_ends():
    solve("hotplate")
    said = page_text("results/hotplate")
    # The stand-in's: half a kelvin to 1 K, 1e-3 K off, from 4 us on.
    assert "over time, from 4.0 us on" in said
    assert "10 µs" not in said
    assert "probe at the end least largest heater 1.0000 ± 0.0010 K 0.5000 ± 0.0010 K 1.0000 ± 0.0010 K" in said
    assert "The errors hold from 4.00 us on" in said


def test_how_long_a_run_lasts_can_be_said_on_the_command_line(capsys):
    assert solve("hotplate", "--end-time", "2.5ms") == 0
    run = summary("results/hotplate-end_time2.5ms")["scene"]["run"]
    assert (run["end_time"], run["output_times"]) == (2.5e-3, [1e-3, 2e-3])
    still = ["--set", "boundary.drive.voltage=0.2"]
    assert solve("hotplate", "--steady", *still, "--out", "still") == 0
    assert summary("still")["scene"]["run"] == {"steady": True, "accuracy": 5e-3}
    assert solve("hotplate", "--set", "run.steady=true", *still, "--out", "same") == 0
    assert summary("same")["scene"] == summary("still")["scene"]
    assert solve("hotplate", "--steady") == 2
    assert "varies in time" in capsys.readouterr().err
    # The bridge has no density.
    assert solve("bridge", "--end-time", "1ms") == 2
    assert "a transient of temperature needs" in capsys.readouterr().err
    assert solve("plate", "--steady", "--end-time", "1ms") == 2
    assert "--end-time 1ms does not go with --steady" in capsys.readouterr().err
    assert solve("plate", "--set", "run.steady=true", "--set", "run.end_time=1ms") == 2
    assert "contradict" in capsys.readouterr().err
