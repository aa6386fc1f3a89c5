"""Small sweeps by the real solver: tables, interruptions, time limits, processes that die, a cluster that is there."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from matplotlib.figure import Figure

import compare
from scenes.loading import builtin_text, load
from tests.validate.report.test_figures import inside
from validate.cli import main
from validate.cli.arguments import parse
from validate.cli.sweep import scene
from validate.report.figures.drawing import style
from validate.sweep import point as points
from validate.sweep.design import Axis, Design, Job, Row, Scope
from validate.sweep.figures import draw
from validate.sweep.point import solve, solver
from validate.sweep.run import sweep
from validate.sweep.table import Table

SWEEP = [
    "sweep", "sink", "--steady", "--no-blame", "--no-figures", "--workers", "2",
    "--vary", "sink.width=60um:140um:3", "--vary", "anchor.oxide_thickness=1um:2um:2",
]  # fmt: skip


def table(folder: Path) -> list[dict[str, Any]]:
    """The rows of points.csv: of a key (with a dot in its name) the very text, else numbers where there are some."""

    def read(name: str, text: str) -> str | float:
        with suppress(ValueError):
            return text if "." in name else float(text)
        return text

    with (folder / "points.csv").open(newline="", encoding="utf-8") as file:
        return [{name: read(name, text) for name, text in row.items()} for row in csv.DictReader(file)]


def stored(folder: Path) -> int:
    try:
        return (folder / "points.jsonl").read_bytes().count(b"\n")
    except FileNotFoundError:
        return 0


@pytest.fixture(scope="module", autouse=True)
def _processes_that_stay():
    """The processes that solve are started once: to start one takes longer than its work in a test."""
    with points.pool(2) as processes, pytest.MonkeyPatch.context() as patch:
        patch.setattr(points, "pool", lambda count: nullcontext(processes))
        yield


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep") / "undisturbed"
    assert main([*SWEEP, "--quiet", "--out", str(folder)]) == 0
    return folder


def assert_same(found: Path, expected: Path) -> None:
    """To rounding: the same factorizations in the same order, on this or another processor."""
    for one, other in zip(table(found), table(expected), strict=True):
        assert one.keys() == other.keys()
        for name in one.keys() - {"seconds"}:
            number = isinstance(other[name], float)
            assert one[name] == (pytest.approx(other[name], rel=1e-9, abs=1e-9) if number else other[name])


def test_the_table_has_what_single_runs_have(undisturbed):
    rows = table(undisturbed)
    assert [row["sink.width"] for row in rows] == [w for w in ("6e-05", "0.0001", "0.00014") for _ in range(2)]
    assert {row["status"] for row in rows} == {"ok"}
    sink = load("sink", ["run.accuracy=1e-2", "sink.width=140um", "anchor.oxide_thickness=2um"])
    alone = compare.run(sink, steady=True)
    row = rows[5]
    assert float(row["anchor.oxide_thickness"]) == 2e-6
    assert row["fem3d_peak_rise_K"] == pytest.approx(alone.fem3d.steady["peak_rise_K"].value, rel=1e-9)
    assert row["fig4_difference"] == pytest.approx(alone.check("fig4").difference, rel=1e-6)
    assert row["fig4_verdict"] == alone.check("fig4").verdict
    # Another point is another answer.
    assert rows[4]["fem3d_peak_rise_K"] != pytest.approx(row["fem3d_peak_rise_K"], rel=1e-3)


@pytest.mark.long
def test_a_worker_and_then_all_of_it_killed_goes_on_to_the_same_table(undisturbed, tmp_path, capsys):
    folder = tmp_path / "killed"
    command = [sys.executable, "-m", "validate", *SWEEP, "--out", str(folder)]
    run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    _until(lambda: stored(folder) >= 1, run)
    workers = solvers(run)
    assert len(workers) == 2
    workers[0].kill()
    before = stored(folder)
    _until(lambda: stored(folder) >= before + 2, run)
    # Stopped it still has the folder, which nobody else gets.
    run.send_signal(signal.SIGSTOP)
    assert main([*SWEEP, "--out", str(folder)]) == 2
    assert "is in use by another" in capsys.readouterr().err
    run.kill()
    run.wait()
    kept = (folder / "points.jsonl").read_bytes()
    assert 0 < stored(folder) < 6
    assert main([*SWEEP, "--quiet", "--out", str(folder)]) == 0
    assert (folder / "points.jsonl").read_bytes().startswith(kept[: kept.rfind(b"\n") + 1])
    lines = (folder / "points.jsonl").read_text(encoding="utf-8").splitlines()
    assert sorted(json.loads(line)["point"] for line in lines) == list(range(6))
    assert_same(folder, undisturbed)


def solvers(run: subprocess.Popen[bytes]) -> list[psutil.Process]:
    """The processes that solve a sweep's points; Python has one more, which cleans up after killed processes."""
    children = psutil.Process(run.pid).children()
    return [child for child in children if "resource_tracker" not in "".join(child.cmdline())]


@pytest.mark.long
def test_a_sweep_opens_no_port_and_interrupted_ends_at_once_and_says_what_is_stored(tmp_path):
    folder = tmp_path / "stopped"
    command = [sys.executable, "-m", "validate", *SWEEP, "--accuracy", "1e-3", "--out", str(folder)]
    run = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # which a shell's background jobs ignore
    )  # fmt: skip
    _until(lambda: stored(folder) >= 1, run)
    workers = solvers(run)
    assert len(workers) == 2
    ports = [c.laddr for p in (psutil.Process(run.pid), *workers) for c in p.net_connections() if c.status == "LISTEN"]
    assert ports == []
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=10)
    assert run.returncode == 130
    assert b"the same command goes on" in said
    assert not any(worker.is_running() for worker in workers)


def _until(true: Callable[[], bool], run: subprocess.Popen[bytes]) -> None:
    for _ in range(18_000):
        if true():
            return
        assert run.poll() is None, run.stderr
        time.sleep(0.01)
    pytest.fail("nothing was stored within three minutes")


def test_a_finished_sweep_solves_nothing_and_another_is_refused(undisturbed, monkeypatch, capsys):
    monkeypatch.setattr("compare.worker.Worker.run", lambda *_: pytest.fail("nothing is left to solve"))
    rows = table(undisturbed)
    assert main([*SWEEP, "--quiet", "--out", str(undisturbed)]) == 0
    assert table(undisturbed) == rows
    said = capsys.readouterr().out
    assert "is within 5 % of 3D for the steady peak in 0 of 6 designs" in said
    assert main([*SWEEP[:-2], "--out", str(undisturbed)]) == 2
    assert "holds another sweep (its vary differs)" in capsys.readouterr().err


@pytest.mark.long
def test_a_cluster_that_is_there_gives_the_same_table(undisturbed, tmp_path, capsys, monkeypatch):
    from distributed import LocalCluster

    alone = [word for word in SWEEP if word not in ("--workers", "2")]
    with LocalCluster(2, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        assert main([*alone, "--quiet", "--scheduler", address, "--out", str(tmp_path / "there")]) == 0
    assert_same(tmp_path / "there", undisturbed)
    monkeypatch.setattr(points, "ANSWERS_WITHIN", 0.5)
    assert main([*alone, "--scheduler", "tcp://127.0.0.1:9", "--out", str(tmp_path / "gone")]) == 2
    assert '--scheduler "tcp://127.0.0.1:9" cannot be used' in capsys.readouterr().err


def test_points_without_an_answer_are_rows_that_say_why(tmp_path):
    given = ["--vary", "anchor.oxide_length=50um,200um", "--vary", "drive.voltage=1,9", "--accuracy", "5e-2", "--set",
             "materials.silicon.temperature_coefficient=-1e-3"]  # fmt: skip
    assert main([*SWEEP[:4], *SWEEP[5:7], *given, "--out", str(tmp_path / "s")]) == 0
    rows = {(float(r["anchor.oxide_length"]), float(r["drive.voltage"])): r for r in table(tmp_path / "s")}
    assert [rows[50e-6, v]["status"] for v in (1.0, 9.0)] == ["ok", "runaway"]
    assert "the largest voltage with a steady state is" in rows[50e-6, 9.0]["because"]
    assert rows[200e-6, 1.0]["status"] == "refused"
    assert "lets the oxide stick out of its pad" in rows[200e-6, 1.0]["because"]
    assert rows[200e-6, 1.0]["fem3d_peak_rise_K"] == ""
    # None has one: the table and the page are there all the same.
    assert main([*SWEEP[:7], "--vary", "anchor.oxide_length=200um,300um", "--out", str(tmp_path / "none")]) == 3
    assert [row["status"] for row in table(tmp_path / "none")] == ["refused", "refused"]
    assert (tmp_path / "none" / "report.html").exists()


def drawn(values: dict[str, Any], columns: dict[str, list[float]], name: str) -> Figure:
    """A figure of a sweep of the bridge, of two points."""
    axes = tuple(Axis(key, tuple(given)) for key, given in values.items())
    found = {"status": np.array(["ok", "ok"], object)}
    for probe, of_probe in columns.items():
        found |= {f"fem3d_{probe}": np.array(of_probe), f"fem3d_{probe}_error": np.zeros(2)}
    rows = {key: np.array(given) for key, given in values.items()}
    with style():
        return draw(Table(Job(Scope(load("bridge")), Design(axes), {}), rows, found))[name]


def test_every_panel_of_a_free_sweep_has_its_probes_unit_and_no_label_is_cut():
    """The longest keys are in lines, the colours have their probe's unit."""
    volts = {"boundary.left electrode.voltage": (1.0, 2.0)}
    columns = {"middle": [400.0, 700.0], "current": [4e-3, 8e-3], "heat to the substrate": [-4e-6, -8e-6]}
    lines = drawn(volts, columns, "figure_lines")
    assert [ax.get_ylabel() for ax in lines.axes] == ["K", "mA", "\N{MICRO SIGN}W"]
    assert lines.axes[1].lines[0].get_ydata().max() == pytest.approx(8.0)
    assert inside(drawn(volts, {"middle": [415.23, 415.24]}, "figure_lines"))  # with six characters beside the axis
    two = volts | {"material.polysilicon.thermal_conductivity": (20.0, 30.0)}
    keys = drawn(two, {"middle": [400.0, 500.0]}, "figure_lines")
    assert inside(keys)
    assert [ax.get_ylabel() for ax in keys.axes] == ["K", "K"]
    keys.axes[1].set_xlabel(10 * keys.axes[1].get_xlabel().replace("\n", ""))
    assert not inside(keys)


@pytest.mark.long
def test_designs_that_melt_are_named(tmp_path, capsys):
    """Silicon melts at 1687 K: at 20 V the beam is far hotter, at 1 V it is not."""
    melting = ["sweep", "sink", "--steady", "--no-blame", "--workers", "2", "--vary", "drive.voltage=1,9,20", "--vary",
               "sink.width=80um,120um", "--out", str(tmp_path / "hot")]  # fmt: skip
    assert main(melting) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "too hot in 2 of 6 designs: silicon by up to 2," in said, said
    rows = table(tmp_path / "hot")
    for row in rows:
        hot = row["drive.voltage"] == "20.0"
        assert row["too_hot"] == ("silicon" if hot else "")
        assert (row["past_valid_to_K"] > 0) == hot
        off = row["past_valid_to_K"] - (293 + row["fem3d_peak_rise_K"] - 1687)
        assert abs(off) <= row["fem3d_peak_rise_K_error"]
    free = solve(Scope(load("bridge", ["material.polysilicon.valid_to=300K"])), 0, [])
    assert free["too_hot"] == "polysilicon"


def test_an_open_verdict_is_solved_again_more_accurately():
    first = solve(Scope(load("sink", ["run.accuracy=1e-2"]), steady=True, blame=False), 0, [])
    size, error = abs(first["fig4_difference"]), first["fig4_u_num"]
    near = load("sink", ["run.accuracy=1e-2", f"checks.tolerances.fig4={size + 0.8 * error!r}"])
    again = solve(Scope(near, steady=True, blame=False), 0, [])
    assert (first["accuracy"], first["fig4_verdict"]) == (1e-2, "differs")
    assert again["accuracy"] < 1e-2


def test_a_free_scene_has_its_probes_and_a_folder_of_its_name(tmp_path, capsys, monkeypatch):
    moved = "box.beam.upper.x+probe.beam mean.upper.x=8um,10um,1nm"
    assert main(["sweep", "bridge", "--vary", moved, "--no-figures", "--quiet", "--workers", "2"]) == 0
    (folder,) = Path("results").glob("bridge-sweep-beam.upper.x*8um-10um-1nm")
    rows = table(folder)
    assert [row["status"] for row in rows[:2]] == ["ok", "ok"]
    # Narrower is hotter here: the same current density, and less oxide below.
    assert rows[0]["fem3d_middle"] != pytest.approx(rows[1]["fem3d_middle"], rel=1e-4)
    assert rows[0]["fem3d_middle_error"] > 0
    assert re.search(r"middle is up to [\d.]+ K \(at", capsys.readouterr().out)


def test_a_model_is_judged_by_the_means_of_a_scene_without_probes():
    bare, accuracy = replace(load("bridge"), probes=()), np.float64(0.1)
    found = sweep(bare, {"parameters.w": ["10 um"]}, model="network", accuracy=accuracy)
    assert "for mean beam in" in found.sentence
    assert replace(found, columns={"status": found["status"]}).sentence == "1 of 1 solved"  # by a silent model


def test_steady_is_taken_as_solve_takes_it():
    """Of a scene over time, too."""
    text = builtin_text("hotplate").replace("voltage = { times", 'voltage = "1 V" # { times')
    Path("plate.toml").write_text(text, encoding="utf-8")
    command = ["sweep", "plate.toml", "--vary", "run.accuracy=0.01,0.02"]
    assert not scene(parse(command))[0].steady
    assert scene(parse([*command, "--steady"]))[0].steady
    # A scene that says nothing of time is one only with the option.
    lines = [line for line in text.splitlines() if not line.startswith(("end_time", "output_times"))]
    Path("plate.toml").write_text("\n".join(lines), encoding="utf-8")
    assert scene(parse([*command, "--steady"]))[0].steady


def stuck(scope: Scope, number: int, settings: list[str]) -> Row:
    """Point 1 is in a call that does not return, point 2 ends the process."""
    if number == 1:
        time.sleep(60)
    elif number == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"point": number, "status": "ok", "because": ""}


@pytest.mark.long
def test_hung_or_dead_process_costs_its_point(monkeypatch):
    monkeypatch.setattr(points, "solve", stuck)
    with solver(2, None, 0.5) as solve_all:
        rows = sorted(solve_all((Scope(load("sink")), number, []) for number in range(5)), key=lambda row: row["point"])
    assert [row["status"] for row in rows] == ["ok", "timeout", "crashed", "ok", "ok"]
    assert rows[1]["because"] == "it took more than 0.5 s (--point-timeout)"
