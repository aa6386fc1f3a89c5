"""What the figures show: no kink that is not real, round lengths, nothing in a legend that cannot be seen."""

from __future__ import annotations

import numpy as np
import pytest

from compare.budget import Budget, Part, Split
from compare.outcome import Outcome
from fem3d.run import solve
from scenes.loading import load
from scenes.plan import Request
from validate.report.asked import why as section
from validate.report.figures.asked_figures import seen_parts
from validate.report.figures.offscreen import round_length
from validate.report.figures.sink_figures import without_kinks
from validate.report.table import Style


def residual(accuracy: str) -> tuple[np.ndarray, np.ndarray, float]:
    """The 3D profile less its parabola (K), and the error of the rises (K)."""
    from compare.figure_checks import profile
    from compare.verdict import Models

    sink = load("sink", [f"accuracy={accuracy}"])
    found = solve(sink, Request(transient=False))
    y, rise, fitted = profile(Models(sink, found, None))
    return 1e6 * y, rise - fitted, max(found.steady[key].error for key in ("peak_rise_K", "end_rise_K"))


def kink(y: np.ndarray, values: np.ndarray) -> float:
    """The largest third difference (K) between 60 and 90 um, where two cells meet at 75 um."""
    return float(np.abs(np.diff(values, 3)[(y[:-3] > 60) & (y[:-3] < 90)]).max())


def test_the_kink_between_cells_goes_and_the_curve_stays() -> None:
    """A bump larger than the error, which must be real, stays."""
    y, raw, error = residual("1e-3")
    drawn = without_kinks(y, raw, error / 20)
    assert kink(y, drawn) < 0.1 * kink(y, raw)
    assert np.abs(drawn - raw).max() < 0.5 * error
    bumped = raw + 3 * error * np.exp(-(((y - 75) / 10) ** 2))
    assert np.abs(without_kinks(y, bumped, error / 20) - bumped).max() < 0.5 * error


@pytest.mark.parametrize(("wanted", "found"), [(260.0, 200.0), (5.0, 5.0), (1.99, 1.0), (0.06, 0.05)])
def test_round_lengths(wanted: float, found: float) -> None:
    assert round_length(wanted) == pytest.approx(found)


def split(*values: float) -> Split:
    parts = tuple(Part(f"part {n}", value, 0.01) for n, value in enumerate(values))
    return Split("peak", "K", 10.0, sum(values), 0.02, parts)


def budget(*values: float, over_time: np.ndarray | None = None) -> Budget:
    times = None if over_time is None else np.array([1e-5, 1e-3])
    return Budget("paper", (split(*values),), (), times, {} if over_time is None else {"peak": over_time}, "so it is")


def test_the_legend_has_what_can_beseen_parts() -> None:
    assert seen_parts(budget(-1.0, 0.3, 0.001)) == [0, 1]
    # What shows on the way only is seen too.
    assert seen_parts(budget(-1.0, 0.0, 0.0, over_time=np.array([[-1.0, -1.0], [0.0, 0.0], [0.1, 0.0]]))) == [0, 2]


def budget_text(*values: float) -> str:
    return section(Outcome(load("sink"), Request(), (), why=budget(*values)), Style()).text(Style())


def test_rows_of_nothing_are_one_row() -> None:
    text = budget_text(-1.0, 0.3, 0.005, -0.002)
    rows = [line for line in text.splitlines() if line.startswith("  part")]
    assert [row.split()[1] for row in rows] == ["0", "1"]
    assert "2 others, each" in text
    assert "    part 2, part 3" in text
    # A part that is more than its error keeps its row.
    assert "others" not in budget_text(-1.0, 0.3, 0.02, -0.002)
