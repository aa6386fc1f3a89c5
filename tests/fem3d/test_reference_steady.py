"""The coupled steady state against the second path on the same mesh: two solvers, one discrete problem."""

from dataclasses import replace

import numpy as np
import pytest

from meshes import symmetry
from scenes.sink import SILICON, Sink
from tests.fem3d import off, plain_grid, silicon, state_on
from tests.fem3d.second_path import quantities
from validate.verify import reference

SINKS = {
    "paper": Sink(),
    "hot": Sink(voltage=10.0),
    "pads": Sink(voltage=-6.0, electrodes="pad-edge", convection_coefficient=300.0, room_temperature=320.0),
    "falling": Sink(silicon=silicon(-5e-4), voltage=5.0, electrodes="pad-edge"),
    "substrate": Sink(substrate_thickness=5e-4, electrodes="pad-edge"),
    "air": Sink(convection_coefficient=1e3, silicon=replace(SILICON, reference_temperature=250.0), oxide_offset=1e-5),
}


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("name", SINKS)
def test_every_quantity_agrees_to_the_tolerance_of_the_solvers(name, degree):
    sink = SINKS[name]
    part = symmetry.reduce(sink.scene())
    grid = plain_grid(part.scene, degree)
    _, ours = state_on(sink, grid, part)
    full = reference.assemble(part.scene, grid)
    theirs = quantities(sink, part, full, reference.steady(full))
    assert set(ours) == set(theirs)
    assert max(off(ours[q], theirs[q]) for q in ours) < 1e-9
    assert np.sign(theirs["current_A"]) == np.sign(sink.voltage)
    twin = replace(sink, silicon=replace(sink.silicon, thermal_conductivity=130.0 * (1 + 1e-6)))
    _, others = state_on(twin, plain_grid(symmetry.reduce(twin.scene()).scene, degree))
    assert off(others["peak_rise_K"], theirs["peak_rise_K"]) > 1e-8
