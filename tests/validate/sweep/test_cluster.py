"""Processes of a sweep that hang, die or end slowly."""

import os
import signal
import time

import pytest

from validate.sweep import cluster as cluster_of
from validate.sweep.design import base
from validate.sweep.point import Row, Scope, Work


def stuck(work: Work, seconds: float | None) -> Row:
    """Point 1 is in a call that does not return, point 2 ends the process."""
    if work.number == 1:
        time.sleep(60)
    elif work.number == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return Row(work.number, "ok", "", 0.0, {})


@pytest.mark.long
def test_hung_or_dead_process_costs_its_point(monkeypatch):
    monkeypatch.setattr(cluster_of, "solve", stuck)
    monkeypatch.setattr(cluster_of, "PATIENCE", 0.2)
    points = [Work(base("sink"), Scope(), (), number, ()) for number in range(5)]
    with cluster_of.Cluster(2, None, 0.1) as cluster:
        rows = sorted((row for solved in cluster.solve(points) for row in solved), key=lambda row: row.point)
    assert [row.status for row in rows] == ["ok", "timeout", "crashed", "ok", "ok"]
    assert rows[1].because == "it took more than 0.1 s (--point-timeout)"
    assert rows[2].because == "the processes that had it died one after the other"
