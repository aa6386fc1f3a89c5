"""Rows on disk: nothing is lost by a kill, and nothing is there twice."""

import numpy as np
import pytest

from scenes.errors import SceneError
from scenes.loading import load
from validate.sweep.design import Design, Row, parse, unit
from validate.sweep.run import ROWS, Store, sweep

SUMMARY = {"kind": "sweep", "vary": {"a": [1, 2]}}


def row(number: int) -> Row:
    return {"point": number, "status": "ok", "x": number / 3}


def fill(store: Store, *numbers: int) -> None:
    for number in numbers:
        store.append(row(number))


def test_torn_row_is_cut_off(tmp_path):
    with Store(tmp_path / "s", SUMMARY) as store:
        fill(store, 4, 0)
    file = tmp_path / "s" / ROWS
    whole = file.read_bytes()
    first = whole.index(b"\n") + 1
    # Wherever the second row is torn, the first stays and the second is gone.
    for kept in (first, first + 7, len(whole) - 2):
        file.write_bytes(whole[:kept])
        with Store(tmp_path / "s", SUMMARY) as store:
            assert sorted(store.rows) == [4]
            fill(store, 0)
        assert file.read_bytes().endswith(whole[first:])
    with Store(tmp_path / "s", SUMMARY) as store:
        assert sorted(store.rows.values(), key=lambda r: r["point"]) == [row(0), row(4)]


@pytest.mark.parametrize(
    "change",
    [
        lambda line: b"garbage", lambda line: b"5", lambda line: b"\xff\xfe",
        lambda line: line.replace(b'"point"', b'"place"'),
    ],
)  # fmt: skip
def test_changed_line_costs_its_own_point(change, tmp_path):
    with Store(tmp_path / "s", SUMMARY) as store:
        fill(store, 0, 1, 2)
    file = tmp_path / "s" / ROWS
    first, second, last = file.read_bytes().splitlines()
    file.write_bytes(b"\n".join([first, change(second), last, b""]))
    with Store(tmp_path / "s", SUMMARY) as store:
        assert sorted(store.rows) == [0, 2]
        fill(store, 1)
    with Store(tmp_path / "s", SUMMARY) as store:
        assert sorted(store.rows.values(), key=lambda r: r["point"]) == [row(0), row(1), row(2)]


@pytest.mark.parametrize("text", ["5", "[", '{"asked": {}}', "null", "\udcff"])
def test_a_summary_that_somebody_changed_is_said(text, tmp_path):
    with Store(tmp_path / "s", SUMMARY) as store:
        fill(store, 1)
    (tmp_path / "s" / "sweep.json").write_text(text, errors="surrogateescape", encoding="utf-8")
    with pytest.raises(SceneError, match="holds another sweep"), Store(tmp_path / "s", SUMMARY):
        pass
    with Store(tmp_path / "s", SUMMARY, fresh=True) as store:
        assert len(store.rows) == 0


SINK = load("sink")


def test_values_are_in_si_and_as_they_were_typed():
    axis = parse(SINK, "width=10um:200um:20", "grid")
    assert axis.key == "sink.width"
    # The very doubles that --set sink.width=30um gives: 1e-5 + 2 * 1e-5 is another than 3e-5.
    assert axis.values == tuple(float(f"{10 * (n + 1)}e-6") for n in range(20))
    log = parse(SINK, "sink.width=1um:100um:3:log", "grid")
    assert log.values == (1e-6, 1e-5, 1e-4)
    assert parse(SINK, "drive.electrodes=beam-end,pad-edge", "grid").values == ("beam-end", "pad-edge")
    assert unit(load("bridge"), "box.beam.upper.x") == "m"
    for vary, sample in (({"sink.width": [1e-5]}, 0), ({"parameters.x": [1.0]}, None)):
        with pytest.raises(SceneError, match=r'0 points|no "x"'):
            sweep("sink", vary, sample=sample)
    assert parse(SINK, "environment.room_temperature=20degC:40degC:3", "grid").values == (293.15, 303.15, 313.15)


def test_a_sample_fills_its_ranges_and_is_drawn_again_by_its_seed():
    axes = (parse(SINK, "width=10um:1000um:log", "sample"), parse(SINK, "drive.electrodes=beam-end,pad-edge", "sample"))
    points = [Design(axes, 64, 3).point(n) for n in range(64)]
    assert points == [Design(axes, 64, 3).point(n) for n in range(64)]
    assert points != [Design(axes, 64, 4).point(n) for n in range(64)]
    places = np.log10([float(width) * 1e5 for width, _ in points]) / 2
    # A scrambled Sobol' sequence has one of every 64 in each 64th; random points would leave a third of these empty.
    assert sorted(np.floor(places * 64).astype(int)) == list(range(64))
    assert sum(word == "pad-edge" for _, word in points) == 32
