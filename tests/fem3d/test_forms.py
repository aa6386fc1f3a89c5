"""The tensor path against the weak forms of scikit-fem, entry by entry of the matrices on the same mesh."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import coo_array

from fem3d import forms, reference
from fem3d.conductor import find_conductor
from fem3d.operators import assemble
from fem3d.steady import joule_load
from meshes import symmetry
from scenes.model import Box, Material, Scene
from scenes.sink import Sink
from tests.fem3d import off, plain_mesh


def three_materials(conductivity=20.0):
    """A sink whose beam carries a thin layer of a third material over a part of it."""
    scene = Sink(convection_coefficient=1e3).scene()
    coat = Box("coat", Material("coat", conductivity, 1500.0, 900.0), (-2e-5, 1e-4, 2e-6), (3e-5, 4e-4, 3e-6), 1e9)
    return replace(scene, boxes=(*scene.boxes, coat), initial_temperature=300.0)


def in_grid_order(mesh, full, heat):
    """For each unknown of the tensor path the number of scikit-fem's."""
    where = np.empty((heat.size, 3))
    solid = heat.number >= 0
    where[heat.number[solid]] = mesh.coordinates().T[solid]
    unit = np.array([np.diff(axis.nodes).min() for axis in mesh.axes]) / 100
    theirs = {tuple(p): i for i, p in enumerate(np.round(full.basis.doflocs.T / unit).astype(int))}
    return np.array([theirs[tuple(p)] for p in np.round(where / unit).astype(int)])


def differences(scene, mesh, other: Scene | None = None):
    """Relative differences of stiffness, mass, load and Joule load."""
    heat, full = assemble(scene, mesh), reference.assemble(other or scene, mesh)
    order = in_grid_order(mesh, full, heat)
    found = []
    for ours, theirs in ((heat.stiffness, full.stiffness), (heat.mass, full.mass)):
        theirs = coo_array(theirs).tocsr()[order][:, order]
        found.append(float(abs(ours - theirs).max() / abs(theirs).max()))
    found.append(off(heat.loads[0], full.load[order]))
    found.append(off(*joule_loads(heat, full, order)))
    return np.array(found)


def joule_loads(heat, full, order):
    """The Joule load of both paths at the same arbitrary rise and potential."""
    random = np.random.default_rng(1)
    conductor = find_conductor(heat)
    rise, phi = np.zeros(full.basis.N), np.zeros(full.basis.N)
    rise[order[: heat.free]] = 200 * random.random(heat.free)
    nodes = np.zeros(conductor.size, dtype=int)
    live = conductor.number >= 0
    nodes[conductor.number[live]] = order[heat.number[live]]
    phi[nodes] = random.random(conductor.size)
    resistivity = conductor.resistivity(rise[order[: heat.free]])
    density = [-g / r for g, r in zip(conductor.gradient(phi[nodes]), resistivity, strict=True)]
    elements = np.flatnonzero(np.isin(full.owner, [b.box for b in conductor.blocks]))
    part = full.basis.with_elements(elements)
    sigma = 1 / (full.resistivity[0][elements] + full.resistivity[1][elements] * np.asarray(part.interpolate(rise)))
    theirs = forms.joule_heat.assemble(part, conductivity=sigma, potential=part.interpolate(phi))
    return joule_load(conductor, density, rise[order[: heat.free]]), theirs[order]


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("electrodes", ["beam-end", "pad-edge"])
def test_matrices_and_loads_of_a_graded_sink_are_those_of_the_forms(degree, electrodes):
    scene = symmetry.reduce(Sink(electrodes=electrodes, convection_coefficient=50.0).scene()).scene
    scene = replace(scene, initial_temperature=310.0)
    assert (differences(scene, plain_mesh(scene, degree)) < 1e-12).tolist() == [True] * 4


@pytest.mark.parametrize("degree", [1, 2])
def test_matrices_of_three_materials_with_sources_and_films_are_those_of_the_forms(degree):
    scene = three_materials()
    found = differences(scene, plain_mesh(scene, degree))
    assert (found < 1e-12).tolist() == [True] * 4


def test_a_conductivity_changed_by_a_millionth_is_seen():
    scene = three_materials()
    found = differences(scene, plain_mesh(scene, 1), three_materials(20.0 * (1 + 1e-6)))
    assert found[0] > 1e-10
    assert found[1] < 1e-12


def test_the_second_path_takes_one_degree_only():
    scene = Sink().scene()
    with pytest.raises(ValueError, match="one degree, 1 or 2, everywhere"):
        reference.assemble(scene, plain_mesh(scene, 3))
