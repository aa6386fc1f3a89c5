"""What a sweep may be asked: keys, ranges, samples, and the refusal of what can't be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from validate.cli import main
from validate.sweep.design import TOGETHER, Design, base, parse, settings

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
    given = settings((axis.key,), (axis.values[0],))
    scene = free.at(given)
    assert scene.boxes[0].upper[0] == 8e-6  # type: ignore[union-attr]
    assert scene.probes[1].upper[0] == 8e-6  # type: ignore[union-attr]


WIDTH = ["--vary", "sink.width=10um:200um:3"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["sink", "--vary", "sink.widht=10um:200um:3"], 'did you mean "sink.width"?'),
        (["sink", "--vary", "sink.width=1V:2V:3"], "is a voltage, not a length"),
        (["sink", "--vary", "sink.width=20um:10um:3"], "from 20um to 10um is an empty range"),
        (["sink", "--vary", "sink.spans=1:5:3"], "takes whole numbers"),
        (["sink", "--vary", "sink.width=10um,20um", "--steady", "--check", "islands_mean"], "one of several spans"),
        (["sink", "--vary", "environment.convection_coefficient=0:10:3:log"], "has no logarithm"),
        (["sink", "--vary", "sink.width=10um:20um:0"], 'the count of sink.width, "0"'),
        (["sink", "--vary", "sink.width=10um:20um:1000001"], "from 1 to 1000000"),
        (["sink", "--vary", "sink.width=10um:20um:2000", "--vary", "sink.length=1mm:2mm:2000"], "4000000 points"),
        (["sink", "--vary", "sink.width=10um:20um"], "has no count"),
        (["sink"], "nothing is varied"),
        (["sink", *WIDTH, *WIDTH], "sink.width is varied twice"),
        (["sink", *WIDTH, "--set", "width=20um"], "sink.width is varied and set"),
        (["sink", *WIDTH, "--check", "fig44"], 'did you mean "fig4"?'),
        (["sink", *WIDTH, "--check", "fig6_end", "--steady"], "they need the transient"),
        (["sink", *WIDTH, "--reduction", "fn"], "there is no reduction"),
        (["sink", *WIDTH, "--point-timeout", "1 m"], "is a length, not a time"),
        (["sink", *WIDTH, "--workers", "0"], "from 1 to 256"),
        (["sink", *WIDTH, "--sample", "0"], "from 1 to 1000000"),
        (["sink", *WIDTH, "--seed", "1"], "give --sample N too"),
        (["sink", *WIDTH, "--workers", "1", "--scheduler", "tcp://x:1"], "give one of the two"),
        (["device", *WIDTH], "has no 3D model to sweep"),
        (["bridge", "--vary", "box.bem.upper.x=1um:2um:2"], 'the scene has no box "bem.upper"'),
        (["bridge", "--vary", "box.beam.upper.x=1V:2V:2"], "is a voltage, not a length"),
        (["bridge", "--vary", "box.beam.upper.x=1um:2um:2", "--check", "midle"], 'did you mean "middle"?'),
        (["bridge", "--vary", "box.beam.upper.x=1um:2um:2", "--voltage", "2"], "--voltage is for a sink"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["sweep", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


TWO = ["--vary", "sink.width=10um:200um", "--vary", "sink.length=1mm:2mm"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["sink", *TWO], "--check"),
        (["sink", *TWO[:2], "--check", "fig4"], "a map is over two keys, and 1 are varied"),
        (["sink", *TWO, "--check", "fig9"], "is no check"),
        (["sink", *TWO, "--check", "fig4", "--tolerance", "5V"], "is a voltage, not a plain number"),
        (["sink", *TWO, "--check", "fig4", "--cells", "1"], "from 2 to 1000"),
        (["sink", "--vary", "sink.width=10um:200um:3", *TWO[2:], "--check", "fig4"], "--cells says how many"),
        (["bridge", *TWO, "--check", "middle"], "has no 1D model"),
    ],
)
def test_bad_input_of_a_map(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["map", *arguments]) == 2
    assert said in capsys.readouterr().err
