"""Rows on disk: nothing is lost by a kill, and nothing is there twice."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from scenes.errors import SceneError
from validate.sweep.design import TOGETHER, Design, base, parse, settings
from validate.sweep.point import Row
from validate.sweep.store import ROWS, Store

SUMMARY = {"kind": "sweep", "vary": {"a": [1, 2]}}


def row(number: int) -> Row:
    return Row(number, "ok", "", 0.1, {"x": number / 3})


def test_what_a_kill_leaves_of_a_task_is_cut_off(tmp_path: Path) -> None:
    with Store(tmp_path / "s", SUMMARY) as store:
        store.append([[row(4)], [row(0), row(1), row(2)]])
    file = tmp_path / "s" / ROWS
    whole = file.read_bytes()
    ends = [n + 1 for n, byte in enumerate(whole) if byte == ord("\n")]
    assert len(ends) == 2
    # Wherever the second task is torn, inside a row or between two, the first stays and the second is gone.
    for kept in (ends[0], ends[0] + 7, whole.index(b"}, {", ends[0]) + 1, len(whole) - 2, len(whole) - 1):
        file.write_bytes(whole[:kept])
        with Store(tmp_path / "s", SUMMARY) as store:
            assert [r.point for r in store.rows()] == [4]
            store.append([[row(0), row(1), row(2)]])
        assert file.read_bytes() == whole
    with Store(tmp_path / "s", SUMMARY) as store:
        assert list(store.rows()) == [row(n) for n in (0, 1, 2, 4)]


@pytest.mark.parametrize(
    "line",
    [
        b"garbage", b"5", b"[{}]", b'{"point": 1}', pytest.param(b"[" * 100_000, id="deep"),
        b'[{"point": 1}]', b"\xff\xfe",
        *(f"[{json.dumps(asdict(row(1)) | change)}]".encode() for change in (
            {"point": "a"}, {"point": None}, {"point": [1]}, {"point": -1}, {"point": 9}, {"point": True}, {"more": 1},
            {"status": 5}, {"seconds": "x"}, {"values": None}, {"values": 5}, {"values": {"fig4_difference": "x"}},
            {"values": {"blame": {}}}, {"parts": {"a": None}}, {"parts": []},
        )),
    ],
)  # fmt: skip
def test_a_line_that_somebody_changed_costs_its_own_points_alone(line: bytes, tmp_path: Path) -> None:
    with Store(tmp_path / "s", SUMMARY, count=4) as store:
        store.append([[row(0)], [row(1)], [row(2)]])
    file = tmp_path / "s" / ROWS
    first, _, last = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(first + line + b"\n" + last)
    with Store(tmp_path / "s", SUMMARY, count=4) as store:
        assert [r.point for r in store.rows()] == [0, 2]
        store.append([[row(1)]])
    with Store(tmp_path / "s", SUMMARY, count=4) as store:
        assert list(store.rows()) == [row(0), row(1), row(2)]


@pytest.mark.parametrize(
    "text", ["5", "[", '{"asked": 5}', '{"asked": {}}', "null", pytest.param("[" * 100_000, id="deep"), "\udcff"]
)
def test_a_summary_that_somebody_changed_is_said(text: str, tmp_path: Path) -> None:
    with Store(tmp_path / "s", SUMMARY) as store:
        store.append([[row(1)]])
    (tmp_path / "s" / "sweep.json").write_text(text, errors="surrogateescape", encoding="utf-8")
    with pytest.raises(SceneError, match=r"sweep\.json is not as it was written"), Store(tmp_path / "s", SUMMARY):
        pass
    with Store(tmp_path / "s", SUMMARY, fresh=True) as store:
        assert len(store) == 0


def test_a_row_that_is_there_is_not_written_again(tmp_path: Path) -> None:
    with Store(tmp_path / "s", SUMMARY) as store:
        store.append([[row(1)]])
        with pytest.raises(ValueError, match="stored already"):
            store.append([[row(1)]])


def test_the_folder_is_of_one_sweep_and_one_process(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    with Store(folder, SUMMARY) as store:
        store.append([[row(1)]])
        with pytest.raises(SceneError, match="in use by another"), Store(folder, SUMMARY):
            pass
    with pytest.raises(SceneError, match="holds another sweep"), Store(folder, {**SUMMARY, "vary": {}}):
        pass
    with Store(folder, {**SUMMARY, "vary": {}}, fresh=True) as store:
        assert len(store) == 0
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(SceneError, match="not a sweep"), Store(tmp_path / "mine", SUMMARY, fresh=True):
        pass
    assert (tmp_path / "mine" / "notes.txt").read_text(encoding="utf-8") == "mine"


SINK = base("sink", ["run.accuracy=1e-2"])


def test_values_are_in_si_and_as_they_were_typed() -> None:
    axis = parse(SINK, "width=10um:200um:20", "grid")
    assert axis.key == "sink.width"
    # The very doubles that --set sink.width=30um gives: 1e-5 + 2 * 1e-5 is another than 3e-5.
    assert axis.values == tuple(float(f"{10 * (n + 1)}e-6") for n in range(20))
    log = parse(SINK, "sink.width=1um:100um:3:log", "grid")
    assert log.values == (1e-6, 1e-5, 1e-4)
    assert parse(SINK, "drive.electrodes=beam-end,pad-edge", "grid").values == ("beam-end", "pad-edge")
    assert parse(SINK, "environment.room_temperature=20degC:40degC:3", "grid").values == (293.15, 303.15, 313.15)


def test_points_that_differ_in_voltage_alone_are_solved_together() -> None:
    design = Design((parse(SINK, "drive.voltage=0.5,-2,1", "grid"), parse(SINK, "width=10um:30um:2", "grid")))
    tasks = list(design.tasks())
    assert [[design.point(n) for n in task] for task in tasks] == [
        [(-2.0, 1e-5), (1.0, 1e-5), (0.5, 1e-5)],
        [(-2.0, 3e-5), (1.0, 3e-5), (0.5, 3e-5)],
    ]
    many = Design((parse(SINK, f"drive.voltage=1:2:{TOGETHER + 1}", "grid"),))
    assert [len(task) for task in many.tasks()] == [TOGETHER, 1]
    assert sorted(n for task in many.tasks() for n in task) == list(range(TOGETHER + 1))


def test_a_sample_fills_its_ranges_and_is_drawn_again_by_its_seed() -> None:
    axes = (parse(SINK, "width=10um:1000um:log", "sample"), parse(SINK, "drive.electrodes=beam-end,pad-edge", "sample"))
    points = [Design(axes, 64, 3).point(n) for n in range(64)]
    assert points == [Design(axes, 64, 3).point(n) for n in range(64)]
    assert points != [Design(axes, 64, 4).point(n) for n in range(64)]
    places = np.log10([float(width) * 1e5 for width, _ in points]) / 2
    # A scrambled Sobol' sequence has one of every 64 in each 64th; random points would leave a third of these empty.
    assert sorted(np.floor(places * 64).astype(int)) == list(range(64))
    assert sum(word == "pad-edge" for _, word in points) == 32


def test_keys_that_move_together(tmp_path: Path) -> None:
    free = base("bridge")
    axis = parse(free, "box.beam.upper.x+probe.beam mean.upper.x=8um:10um:2", "grid")
    given = settings(free, (axis.key,), (axis.values[0],))
    scene = free.at(given)
    assert scene.boxes[0].upper[0] == 8e-6  # type: ignore[union-attr]
    assert scene.probes[1].upper[0] == 8e-6  # type: ignore[union-attr]
