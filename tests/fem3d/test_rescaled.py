"""A second voltage from the first one's reduced problem against a solution of its own."""

from dataclasses import replace

import pytest

from fem3d.runs.sink import solve
from scenes.sink import Sink

ACCURACY = 1e-3


def close(again, alone):
    """Each steady quantity within the two estimated errors together."""
    return [
        abs(again.steady[q].value - alone.steady[q].value) <= again.steady[q].error + alone.steady[q].error
        for q in alone.steady
    ]


@pytest.mark.long
@pytest.mark.parametrize("electrodes", ["beam-end", "pad-edge"])
def test_it_agrees_with_a_run_of_its_own_also_when_chained(electrodes):
    sink = Sink(voltage=0.5, electrodes=electrodes, accuracy=ACCURACY)
    found = solve(sink)
    for voltage in (2.0, 8.0, -1.0):
        other = replace(sink, voltage=voltage)
        found = solve(other, earlier=found)
        alone = solve(other, transient=False)
        assert all(close(found, alone))
    assert not all(close(found, solve(replace(other, voltage=1.01 * voltage), transient=False)))


def test_the_first_mesh_and_fields_serve_again():
    sink = Sink(accuracy=ACCURACY)
    first = solve(sink)
    again = solve(replace(sink, voltage=2.0), earlier=first)
    chained = solve(replace(sink, voltage=3.0), earlier=again)
    heat = first.details["answer"].fine.state.heat
    assert again.details["answer"].fine.state.heat is heat
    assert chained.details["answer"].fine.state.heat is heat
