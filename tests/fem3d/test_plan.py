"""The lines of the plan are true of the run."""

from dataclasses import replace

import numpy as np

from fem3d.runs import sink as sink_run
from scenes.sink import Sink


def lines(sink, transient=False):
    result = sink_run.solve(replace(sink, accuracy=1e-2), transient)
    return {s.step: s for s in result.details["plan"]}, result


def bodies(conductor):
    """The names of the boxes that carry current."""
    domain = conductor.heat.domain
    return {domain.names[n] for n in domain.body[conductor.cells]}


def test_pads_carry_no_unknowns_between_electrodes_at_the_beam_s_ends():
    found, result = lines(Sink())
    assert found["electric unknowns in oxide-0, pad-0"].state == "skipped"
    conductor = result.details["answer"].fine.state.conductor
    space = conductor.heat.domain.space
    assert bodies(conductor) == {"beam"}
    assert len(conductor.free) == result.details["electric_unknowns"]
    of_pads = np.unique(space.dofs[:, space.mesh.p[1, space.mesh.t].min(axis=0) < -1e-9])
    of_beam = np.unique(space.dofs[:, conductor.cells])
    assert not np.isin(conductor.free, np.setdiff1d(of_pads, of_beam)).any()


def test_pads_are_part_of_the_circuit_between_electrodes_at_their_edges():
    found, result = lines(Sink(electrodes="pad-edge"))
    assert found["electric unknowns in oxide-0"].state == "skipped"
    assert "pad-0" in found["electric problem"].reason
    conductor = result.details["answer"].fine.state.conductor
    assert bodies(conductor) == {"beam", "pad-0"}
