"""Entries in processes of their own: what they find agrees where it must."""

from importlib import import_module

import numpy as np
import pytest

from meshes import symmetry
from scenes.sink import Sink
from tests.fem3d.second_path import quantities
from validate.bench import growth, measure, problem
from validate.bench.entries import Entry
from validate.bench.problem import QUANTITIES, errors
from validate.verify import reference

CELLS = {"grading": 1e-2, "cuts": 1, "transient": False, "steps": 0}


def found(module, **options):
    return measure.once(Entry("a tool", "some settings", f"tools.{module}", options))


def here(module, **options):
    """What `found` finds, without a process of its own."""
    solve, read = import_module(f"validate.bench.tools.{module}").prepare(options)
    return read(solve())


@pytest.fixture(scope="module")
def plain():
    """The second path on the same cells: scikit-fem with the electric problem in full."""
    sink = Sink()
    part = symmetry.reduce(sink.scene())
    full = reference.assemble(part.scene, problem.graded(part.scene, 1e-2, 1, 2))
    found = quantities(sink, part, full, reference.steady(full))
    return {"values": {q: [float(found[q])] for q in QUANTITIES}}


def test_a_worker_says_what_it_took_and_found():
    answer = measure.once(Entry("1D", "", "tools.reduction", {"transient": True, "reduction": "paper"}), 3, 10.0)
    assert len(answer["seconds"]) == 3
    assert 0 < answer["imported_MB"] <= answer["peak_MB"]
    assert all(len(answer["values"][q]) == 12 for q in QUANTITIES)


@pytest.mark.long
def test_an_entry_that_fails_says_which_and_why():
    with pytest.raises(measure.EntryError, match=r"a tool \(some settings\) failed: KeyError: 3"):
        found("skfem_sink", degree=3, tolerance=1e-10, **CELLS)


def apart(one, other):
    return max(errors(one["values"], other["values"], other["values"]).values())


def given(degree, layers, electric="full"):
    return here("given_sink", degree=degree, layers=layers, accuracy=1e-8, generations=0, electric=electric, **CELLS)


def ngsolve(order, electric, layers=None):
    pytest.importorskip("ngsolve")
    options = {"order": order, "layers": layers or order, "electric": electric, "method": 2, "tolerance": 1e-10}
    return here("ngsolve_sink", **options, **CELLS)


def test_on_a_given_mesh_the_solver_finds_what_the_second_path_finds_there(plain):
    # The same space; the electric iteration ends at the accuracy asked for.
    assert apart(given(2, 2), plain) < 1e-8
    assert apart(given(2, 1), plain) > 1e-4


def test_the_transient_on_a_given_mesh_is_that_of_another_method_in_another_program():
    cells = {**CELLS, "transient": True}
    stepped = here("skfem_sink", degree=1, method=4, tolerance=1e-8, **{**cells, "steps": 2})["values"]
    end = {q: stepped[q][-1:] for q in QUANTITIES}
    ours = {"accuracy": 1e-6, "generations": 8, "electric": "full", **cells}
    answer = here("given_sink", degree=1, layers=1, **ours)
    # The same space; but its potential follows the resistivity, where the other's current is uniform: 1e-3 at degree 1.
    assert max(errors(answer["values"], stepped, end).values()) < 2e-3
    other = here("given_sink", degree=2, layers=1, **ours)
    assert max(errors(other["values"], stepped, end).values()) > 5e-3


def test_on_a_given_mesh_a_uniform_current_is_nearly_the_one_in_full():
    # To 4e-7 of the power, once the space of the potential is rich enough for the uneven resistivity.
    assert apart(given(5, 3, "uniform"), given(5, 3)) < 2e-6
    assert apart(given(2, 2, "uniform"), given(5, 3)) > 1e-4


@pytest.mark.long
def test_ngsolve_finds_what_the_others_find_and_its_uniform_current_nearly_what_the_full_problem_does():
    rough, fine, full = ngsolve(2, "uniform"), given(6, 4), ngsolve(4, "full")
    assert apart(here("skfem_sink", degree=2, method=2, tolerance=1e-10, **CELLS), rough) < 1e-8
    # Tensor-product elements of order 4 and serendipity ones of degree 6 on these cells: both are 1e-4 off or so.
    assert apart(full, fine) < 3e-4 < apart(rough, fine)
    # The uniform current is an approximation to 4e-7 (of the power), once the space of the potential is rich enough for
    # the uneven resistivity.
    assert apart(ngsolve(4, "uniform"), full) < 2e-6


def test_ngsolve_with_another_order_across_the_layers_has_the_unknowns_of_a_tensor_product():
    assert ngsolve(3, "uniform", layers=1)["unknowns"] == unknowns(3, 1)
    assert ngsolve(3, "uniform")["unknowns"] == unknowns(3, 3) != unknowns(3, 1)


def test_growth_is_measured_without_the_making_of_the_mesh_and_on_the_same_unknowns_but_ours(monkeypatch):
    pytest.importorskip("ngsolve")
    paths = ("own", "scikit-fem", "ngsolve")
    ready = [growth.prepare({"path": path, "degree": 2, "cuts": 1}) for path in paths]
    expected = unknowns(2, 2)
    monkeypatch.setattr(problem, "graded", None)
    monkeypatch.setattr("validate.verify.ngsolve_sink.mesh_of", None)
    ours, *theirs = (read(solve())["unknowns"] for solve, read in ready)
    assert theirs == [expected, expected]
    assert ours < expected


def unknowns(degree, layers):
    """Nodes of the quarter's tensor-product elements that are not on the substrate, counted on their lattice."""
    grid = problem.graded(symmetry.reduce(Sink().scene()).scene, 1e-2, 1, degree, layers)
    ends = [np.concatenate([[0], np.cumsum(d)]) for d in grid.degrees]
    nodes = np.zeros([e[-1] + 1 for e in ends], dtype=bool)
    for cell in np.argwhere(grid.solid):
        nodes[tuple(slice(e[i], e[i + 1] + 1) for e, i in zip(ends, cell, strict=True))] = True
    return int(nodes[:, :, 1:].sum())
