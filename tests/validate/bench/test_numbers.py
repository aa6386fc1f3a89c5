"""What the bench reckons with: steps, methods, exponents, and who is ahead."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fem3d.spaces import element
from meshes import connected
from scenes.sink import Sink
from validate.bench import growth, measure, page, problem, work
from validate.bench.entries import GIVEN, NGSOLVE, OURS, REDUCTION, SCIKIT_FEM, WHOLE
from validate.verify.methods import METHODS, march


def test_every_instant_of_the_comparison_is_a_step():
    for per_interval in (1, 2, 3):
        times = problem.step_times(per_interval)
        assert np.allclose(times[problem.at_times(times)], problem.TIMES, rtol=1e-12, atol=0)
        assert (np.diff(times) > 0).all()
    with pytest.raises(ValueError, match="not among the steps"):
        problem.at_times(np.linspace(0.0, problem.END, 1000))


class Forced:
    """y' = -y^2 + cos t from rest, and t' = 1."""

    mass, stiffness, size = np.eye(2), np.zeros((2, 2)), 2

    def load(self, state):
        return np.array([np.cos(state[1]) - state[0] ** 2, 1.0])

    def factors(self, mass, stiffness):
        return lambda load: load / mass


@pytest.mark.parametrize("order", [2, 3, 4])
def test_the_methods_have_their_orders_and_a_wrong_weight_has_not(order, monkeypatch):
    exact = solve_ivp(lambda t, y: np.cos(t) - y**2, (0, 1), [0.0], "DOP853", rtol=1e-13, atol=1e-14).y[0, -1]

    def observed():
        ends = [list(march(Forced(), np.linspace(0, 1, n + 1), order, 1e-14))[-1][0][0] for n in (20, 40)]
        coarse, fine = np.abs(np.array(ends) - exact)
        return np.log2(coarse / fine)

    assert abs(observed() - order) < 0.25  # the next term of the error at these steps
    *stages, (first, *rest) = METHODS[order]
    monkeypatch.setitem(METHODS, order, (*stages, (first + 1e-2, *rest)))
    assert observed() < 1.2


def row(tool, seconds, off, failure=""):
    if failure:
        return {"tool": tool, "label": "", "failure": failure}
    return {"tool": tool, "label": "", "failure": "", "median_s": seconds, "error": off, "peak_MB": 1.0}


def test_the_fastest_at_an_error_counts_and_a_peer_is_held_against_both_of_ours():
    rows = [
        row(WHOLE, 1.0, 5e-3), row(WHOLE, 3.0, 5e-5), row(GIVEN, 0.25, 5e-3), row(NGSOLVE, 0.5, 9e-3),
        row(NGSOLVE, 6.0, 9e-5), row(NGSOLVE, 0.1, 2e-2), row(SCIKIT_FEM, 0, 0, "took too long"),
    ]  # fmt: skip
    percent, tenth, hundredth, last = work.targets(rows)
    none = dict.fromkeys(OURS)
    assert percent["ratios"] == {SCIKIT_FEM: none, NGSOLVE: {WHOLE: 0.5, GIVEN: 2.0}}
    assert tenth["ratios"][NGSOLVE] == hundredth["ratios"][NGSOLVE] == {WHOLE: 2.0, GIVEN: None}
    assert last["fastest"] == dict.fromkeys((*OURS, *work.PEERS))
    said = work.verdict(percent["fastest"][NGSOLVE], percent["fastest"])
    assert "**ahead: 2.0 times as fast as our whole run**" in said
    assert "2.0 times as long as our solve on a given mesh" in said
    assert said.count("ahead") == 1
    behind = work.verdict(tenth["fastest"][NGSOLVE], tenth["fastest"])
    assert "**ahead of our solve on a given mesh, which does not get there**" in behind
    assert work.verdict(None, last["fastest"]) == "no entry gets there"


def test_a_whole_run_is_held_against_a_given_mesh_of_its_own_error():
    full = "full electric problem"
    rows = [
        row(WHOLE, 3.0, 1e-3), row(WHOLE, 4.0, 1e-6), {**row(GIVEN, 1.0, 1e-2), "label": full},
        {**row(GIVEN, 4.0, 1e-4), "label": full}, {**row(GIVEN, 9.0, 2e-4), "label": full}, row(GIVEN, 0.1, 1e-5),
    ]  # fmt: skip
    inside, finer = work.beside_given(rows)
    # Half way between two errors a solve takes the geometric mean of their times: 2 s; others are faster with less.
    assert inside == (rows[0], pytest.approx(1.5), False)
    assert finer == (rows[1], pytest.approx(1.0), True)
    assert work.beside_given(rows[:1]) == []


def test_reductions_are_named_points_and_no_line_joins_them(monkeypatch, tmp_path):
    drawn = []
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda figure, path, dpi: drawn.append(figure))
    names = ("paper", "plate", "moments:4")
    rows = [{**row(REDUCTION, 0.1 * n, 1e-3 / n), "label": name} for n, name in enumerate(names, 1)]
    rows += [row(NGSOLVE, 0.1 * n, 1e-3 / n) for n in (1, 2)]
    page.draw("steady", {"rows": rows, "reference": {"uncertainty": 1e-6}}, tmp_path / "a.png")
    (axes,) = drawn[0].axes
    named = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    assert tuple(name for name in named if name in names) == names
    assert len({named[name].get_marker() for name in names}) == 3
    assert all(named[name].get_linestyle() == "None" and len(named[name].get_xdata()) == 1 for name in names)
    joined = [line.get_linestyle() for line in axes.lines if line.get_color() == page.LOOKS[NGSOLVE][0]]
    assert joined == ["None", "-"]


def test_only_points_that_no_other_beats_are_joined():
    assert work.fastest([(1e-2, 1.0), (1e-3, 3.0), (2e-2, 2.0), (1e-3, 4.0)]) == [(1e-2, 1.0), (1e-3, 3.0)]


def test_a_solve_finds_nothing_of_the_scene_that_an_earlier_one_worked_out():
    connected.anchored(Sink().scene())
    table = element.factors(3)
    measure.forget()
    assert connected.anchored.cache_info().currsize == connected.coarsest.cache_info().currsize == 0
    assert element.factors(3) is table


def test_exponents_of_power_laws_are_found_above_the_small_sizes():
    sizes = (1000, 5000, 20000, 100000)
    rows = [
        {"path": "a", "failure": "", "unknowns": n, "own_MB": 1e-3 * n**1.2,
         "phases": {"assembly": 1e-5 * n, "factorization": 1e-8 * n**1.5 if n > 1000 else 9.0}}
        for n in sizes
    ]  # fmt: skip
    (found,) = growth.exponents(rows)
    expected = {"assembly": 1.0, "factorization": 1.5, "memory": 1.2}
    assert all(abs(found["exponents"][name] - value) < 1e-9 for name, value in expected.items())
    assert (found["rises"], found["largest"]) == ("factorization", "assembly")
