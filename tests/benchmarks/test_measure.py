"""Entries in processes of their own, and the programs that are compared."""

from importlib import import_module

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks import bench, measure, sdirk, sink_programs
from benchmarks.measure import Entry

COARSE = {"first": 3e-5, "ratio": 4, "steps": 1, "order": 2}


def here(module, **options):
    """The numbers of an entry, without a process of its own."""
    solve, read = import_module(f"benchmarks.{module}").prepare(options)
    return read(solve())


def test_a_worker_reports_its_time_and_numbers():
    answer = measure.once(Entry("1D", "", "own_models", {"model": "paper", "transient": True}), 10.0)
    assert len(answer["seconds"]) == measure.MOST
    assert all(len(answer["values"][q]) == len(sink_programs.TIMES) for q in sink_programs.QUANTITIES)


def test_an_entry_that_fails_tells_which_and_why():
    with pytest.raises(measure.EntryError, match=r"a tool \(some settings\) failed: KeyError"):
        measure.once(Entry("a tool", "some settings", "own_models", {"model": "device"}))


def test_the_plain_program_converges_to_this_toolkit():
    ours = here("own_models", model="3d", transient=False, accuracy=1e-4)
    rough, fine = (here("skfem_sink", transient=False, **(COARSE | {"first": first})) for first in (3e-5, 8e-6))
    errors = [bench.error_of(each["values"], ours["values"]) for each in (rough, fine)]
    assert errors[1] < errors[0] < 1e-2
    assert errors[1] < 1e-3
    assert ours["bound"] < 1e-4


@pytest.mark.long
def test_ngsolve_finds_the_same_on_the_same_mesh():
    pytest.importorskip("ngsolve")
    for transient in (False, True):
        one, other = (here(module, transient=transient, **COARSE) for module in ("skfem_sink", "ngsolve_sink"))
        assert bench.error_of(one["values"], other["values"]) < 1e-6


class Forced:
    """y' = -y^2 + cos t from rest, and t' = 1."""

    mass, stiffness, size = np.eye(2), np.zeros((2, 2)), 2

    def load(self, state):
        return np.array([np.cos(state[1]) - state[0] ** 2, 1.0])

    def factors(self, mass, stiffness):
        return lambda load: load / mass


def test_the_method_in_time_has_its_order_and_a_wrong_weight_has_not(monkeypatch):
    exact = solve_ivp(lambda t, y: np.cos(t) - y**2, (0, 1), [0.0], "DOP853", rtol=1e-13, atol=1e-14).y[0, -1]

    def observed():
        ends = [list(sdirk.march(Forced(), np.linspace(0, 1, n + 1), 1e-14))[-1][0] for n in (20, 40)]
        coarse, fine = np.abs(np.array(ends) - exact)
        return np.log2(coarse / fine)

    assert abs(observed() - sdirk.ORDER) < 0.25
    *stages, (first, *rest) = sdirk.TABLEAU
    monkeypatch.setattr(sdirk, "TABLEAU", (*stages, (first + 1e-2, *rest)))
    assert observed() < 1.2


def test_the_fastest_entry_of_an_error_counts():
    rows = [{"tool": "a", "failure": "", "median_s": s, "error": e} for s, e in ((1.0, 5e-3), (3.0, 5e-5))]
    rows.append({"tool": "a", "failure": "took too long"})
    assert [bench.fastest(rows, "a", target) for target in (1e-2, 1e-4, 1e-5)] == [1.0, 3.0, None]
    assert bench.fastest(rows, "b", 1.0) is None
