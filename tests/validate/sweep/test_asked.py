"""What a sweep may be asked: keys, ranges, samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np

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
