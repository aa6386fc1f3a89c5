"""Processes of a sweep that hang, die or end slowly."""

from __future__ import annotations

import os
import signal
import time

import pytest

from validate.sweep import cluster as cluster_of
from validate.sweep.design import base
from validate.sweep.point import Row, Scope, Work


def stuck(work: Work, seconds: float | None) -> list[Row]:
    """Point 1 is in a call that does not return, point 2 ends the process."""
    for number in work.numbers:
        if number == 1:
            time.sleep(60)
        elif number == 2:
            os.kill(os.getpid(), signal.SIGKILL)
    return [Row(number, "ok", "", 0.0, {}) for number in work.numbers]


@pytest.mark.long
def test_a_process_that_hangs_or_dies_costs_the_point_that_did_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_of, "solve", stuck)
    monkeypatch.setattr(cluster_of, "ready", None)
    monkeypatch.setattr(cluster_of, "PATIENCE", 0.2)
    tasks = [Work(base("sink"), Scope(), (), numbers, ((),) * len(numbers)) for numbers in ((0, 1), (2, 3), (4,))]
    with cluster_of.Cluster(2, None, 0.1) as cluster:
        rows = sorted((r for found in cluster.solve(tasks) for task in found for r in task), key=lambda row: row.point)
    assert [row.status for row in rows] == ["ok", "timeout", "crashed", "ok", "ok"]
    assert rows[1].because == "it took more than 0.1 s (--point-timeout)"
    assert rows[2].because == "the processes that had it died one after the other"


def dies() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.long
def test_processes_that_end_before_they_begin_are_not_started_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_of, "ready", dies)
    with (
        cluster_of.Cluster(1, None, None) as cluster,
        pytest.raises(cluster_of.LostError, match="the workers are gone"),
    ):
        list(cluster.solve([Work(base("sink"), Scope(), (), (0,), ((),))]))


def test_a_cluster_that_is_slow_to_end_is_no_failure() -> None:
    def close() -> None:
        raise TimeoutError("timed out after 5 s")

    with cluster_of.Cluster(1, None, None) as cluster:
        cluster._started.callback(close)
