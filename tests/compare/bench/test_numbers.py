"""What the bench reckons with: steps, methods, exponents, and who is ahead."""

import numpy as np
import pytest

from compare.bench import frontier, growth, plots, sample
from compare.bench.entries import FREEFEM, NGSOLVE, OURS, PLAIN
from compare.bench.runge_kutta import METHODS


def test_every_instant_of_the_comparison_is_a_step():
    for per_interval in (1, 2, 3):
        times = sample.step_times(per_interval)
        assert np.allclose(times[sample.at_times(times)], sample.TIMES, rtol=1e-12, atol=0)
        assert (np.diff(times) > 0).all()
    with pytest.raises(ValueError, match="not among the steps"):
        sample.at_times(np.linspace(0.0, sample.END, 1000))


def error(method, steps):
    """Of y' = -y^2 + cos t, y(0) = 1, at 1, against many more steps of order 4."""
    y, h, gamma = 1.0, 1.0 / steps, method[0][0]
    for n in range(steps):
        rates = []
        for weights in method:
            # Autonomous in t's place: the abscissa of a stage is the sum of its weights.
            t, start = (n + sum(weights)) * h, y + h * sum(w * r for w, r in zip(weights, rates, strict=False))
            rate = 0.0
            for _ in range(60):
                rate = -((start + gamma * h * rate) ** 2) + np.cos(t)
            rates.append(rate)
        y = start + gamma * h * rates[-1]
    return y


@pytest.mark.parametrize("order", [2, 3, 4])
def test_the_methods_have_their_orders_and_a_wrong_weight_has_not(order):
    exact = error(METHODS[4], 4000)
    coarse, fine = (abs(error(METHODS[order], n) - exact) for n in (20, 40))
    assert abs(np.log2(coarse / fine) - order) < 0.2  # the next term of the error at these steps
    wrong = (*METHODS[order][:-1], (METHODS[order][-1][0] + 1e-2, *METHODS[order][-1][1:]))
    coarse, fine = (abs(error(wrong, n) - exact) for n in (20, 40))
    assert np.log2(coarse / fine) < 1.2


def row(tool, seconds, off, failure=""):
    if failure:
        return {"tool": tool, "label": "", "failure": failure}
    return {"tool": tool, "label": "", "failure": "", "median_s": seconds, "error": off, "peak_MB": 1.0}


def test_the_fastest_at_an_error_counts_and_a_peer_that_is_ahead_is_said_to_be():
    rows = [
        row(OURS, 1.0, 5e-3), row(OURS, 3.0, 5e-5), row(NGSOLVE, 0.5, 9e-3), row(NGSOLVE, 6.0, 9e-5),
        row(NGSOLVE, 0.1, 2e-2), row(FREEFEM, 0, 0, "took too long"),
    ]  # fmt: skip
    percent, tenth, hundredth, last = frontier.targets(rows)
    assert percent["ratios"] == {PLAIN: None, NGSOLVE: 0.5, FREEFEM: None}
    assert tenth["ratios"][NGSOLVE] == hundredth["ratios"][NGSOLVE] == 2.0
    assert last["fastest"] == dict.fromkeys((OURS, *frontier.PEERS))
    ours, peer = percent["fastest"][OURS], percent["fastest"][NGSOLVE]
    assert "ahead: 2.0 times as fast" in frontier.verdict(peer, ours, 0.5)
    assert "ahead" in frontier.verdict(peer, None, None)
    assert "ahead" not in frontier.verdict(peer, ours, 2.0)


def test_only_points_that_no_other_beats_are_joined():
    assert plots.fastest([(1e-2, 1.0), (1e-3, 3.0), (2e-2, 2.0), (1e-3, 4.0)]) == [(1e-2, 1.0), (1e-3, 3.0)]


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
