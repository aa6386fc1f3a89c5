"""The ladder against 3D: how near each reduction comes, on sinks that it was not tuned for, and what puts it off again.

The limits are what the reductions are to reach: relative to the final rise, the current to its change, from 10 us on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from compare.blame import budget
from fem3d.runs.sink import solve as solve_3d
from reduced1d import ladder
from reduced1d.ladder.few_states import FewStates, result
from reduced1d.ladder.levels import Levels
from scenes.errors import RunawayError
from scenes.loading import load
from scenes.plan import Request
from scenes.result import Result
from scenes.sink import Sink
from validate.bench.ladder_table import errors, scene, slow_row, thin_row
from validate.report.analyses import budget as document
from validate.report.analyses import why as section
from validate.run.outcome import Outcome

SCENES = {
    "default": (),
    "narrow": ("sink.width=20um",),
    "thick": ("sink.thickness=5um",),
    "wide oxide": ("anchor.oxide_length=100um", "anchor.oxide_width=100um"),
    "pad-edge": ("drive.electrodes=pad-edge",),
}
LIMITS = {"fin": (2e-3, 2e-2), "plate": (1e-3, 1e-3), "moments:3": (5e-3, 3e-3), "moments:4": (1e-3, 1.5e-3)}


@dataclass(frozen=True, eq=False)
class Case:
    """A sink, its 3D result, and its plate."""

    sink: Sink
    fem3d: Result
    levels: Levels

    def off(self, model: FewStates) -> list[float]:
        """How far peak, end and current of a model are from 3D."""
        assert self.fem3d.traces is not None
        found = result("model", self.sink, model, model, False, self.fem3d.traces.time)
        return errors(found, self.fem3d)


@cache
def solved(name: str) -> Case:
    """3D to 2e-4: a current is judged by its change, which is a hundredth of it, and so a hundred times as strictly."""
    sink = load("sink", [*SCENES[name], "run.accuracy=2e-4"])
    return Case(sink, solve_3d(sink, Request()), Levels(sink))


@pytest.mark.long
@pytest.mark.parametrize("reduction", LIMITS)
@pytest.mark.parametrize("name", SCENES)
def test_how_near_it_comes(name: str, reduction: str) -> None:
    case = solved(name)
    peak, end, current = case.off(ladder.build(case.levels.fine, reduction))
    assert peak < LIMITS[reduction][0]
    assert end < LIMITS[reduction][1]
    assert current < max(LIMITS[reduction])
    if reduction == "plate":
        key = "anchor_resistance_K_per_W"
        found = ladder.solve(case.sink, "plate", steady_only=True, levels=case.levels).steady[key]
        exact = case.fem3d.steady[key].value
        assert max(abs(found.value - exact), found.error) < 1e-3 * exact


def without_thickness(sink: Sink) -> Sink:
    """A silicon that conducts across the layer as if there were no t/(3 k): the oxide takes that off in advance."""
    ratio = sink.oxide.thermal_conductivity / (3 * sink.silicon.thermal_conductivity)
    return replace(sink, oxide_thickness=sink.oxide_thickness - sink.thickness * ratio)


PUT_BACK: dict[str, tuple[str, str, Callable[[Case], FewStates]]] = {
    "the fixed parabola": ("default", "fin", lambda case: case.levels.fine.lump()),
    "pads without capacity": ("default", "fin", lambda case: case.levels.fine.fin(pad_capacity=False)),
    "no current in the pads": ("pad-edge", "fin", lambda case: case.levels.fine.fin(circuit=False)),
    "the anchor as one node": ("default", "plate", lambda case: case.levels.fine.fin()),
    "no resistance across the layer": (
        "thick", "plate", lambda case: Levels(without_thickness(case.sink)).fine.whole_plate(),
    ),
    "the steady field alone": ("default", "moments:3", lambda case: case.levels.fine.moments(1)),
}  # fmt: skip


@pytest.mark.parametrize("assumption", PUT_BACK)
def test_an_assumption_put_back_is_noticed(assumption: str) -> None:
    name, reduction, build = PUT_BACK[assumption]
    case = solved(name)
    peak, end, _ = case.off(build(case))
    assert peak > LIMITS[reduction][0] or end > LIMITS[reduction][1]


@pytest.mark.parametrize("start", ["paper", "fin", "moments:4"])
@pytest.mark.parametrize("name", ["default", "pad-edge"])
def test_the_parts_are_the_whole(name: str, start: str) -> None:
    case = solved(name)
    found = budget(case.sink, start, case.fem3d, case.levels)
    reduction = ladder.solve(case.sink, start, times=case.fem3d.traces.time, levels=case.levels)  # type: ignore[union-attr]
    assert len(found.steady) == len(found.transient) == 3
    for split in (*found.steady, *found.transient):
        assert abs(sum(part.value for part in split.parts) - split.total) <= split.error + 1e-9 * abs(split.total)
        assert all(part.error >= 0 for part in split.parts)
        if start == "paper":
            # The twin: a ladder without the rung that matters most does not reach the top.
            worst = max(split.parts, key=lambda part: abs(part.value))
            assert abs(sum(part.value for part in split.parts if part is not worst) - split.total) > split.error
    for split, key in zip(found.steady, ("peak_rise_K", "end_rise_K", "current_A"), strict=True):
        assert split.total == pytest.approx(reduction.steady[key].value - case.fem3d.steady[key].value, rel=1e-9)
    assert found.times is not None
    for key, split in (("peak", found.transient[0]), ("end", found.transient[1])):
        i = int(np.abs(found.times - split.time).argmin())
        assert found.over_time[key][:, i] == pytest.approx([part.value for part in split.parts], rel=1e-9)
        assert np.abs(found.over_time[key].sum(axis=0)).max() == pytest.approx(abs(split.total), rel=1e-9)


def test_what_is_to_blame() -> None:
    """For the paper's sink the anchor resistance in the steady state, the parabola on the way there."""
    case = solved("default")
    found = budget(case.sink, "paper", case.fem3d, case.levels)
    assert "anchor resistance" in found.sentence
    assert "eq 14" in found.sentence
    steady = {split.quantity: split for split in found.steady}
    for quantity, least in (("peak", 0.95), ("end", 0.99), ("current", 0.95)):
        split = steady[quantity]
        assert split.parts[0].blame == "anchor resistance"
        assert split.parts[0].value / split.total > least
    names = [part.blame for part in steady["peak"].parts]
    assert names == [
        "anchor resistance", "fixed parabola", "pad capacity", "oxide capacity", "anchor as one node",
        "rest (thin plate)",
    ]  # fmt: skip
    parabola = found.transient[0].parts[1]
    assert parabola.largest is not None
    assert parabola.when is not None
    assert parabola.largest > 0.04 * found.transient[0].scale
    assert 1e-4 < parabola.when < 4e-3
    # Capacities do nothing to a steady state: their parts are within their uncertainty.
    for split in found.steady:
        assert all(abs(part.value) <= part.error for part in split.parts[2:5])

    pads = solved("pad-edge")
    said = budget(pads.sink, "paper", pads.fem3d, pads.levels)
    assert "pads in the circuit" in said.sentence
    assert "pads in the circuit" in [part.blame for part in said.steady[0].parts]


def test_the_budget_in_words_and_numbers() -> None:
    from validate.report.table import Style

    case = solved("default")
    found = budget(case.sink, "paper", case.fem3d, case.levels)
    text = section(found, Outcome(case.sink, Request(), ()), Style()).text(Style())
    assert max(map(len, text.splitlines())) <= 80
    made = document(found)
    assert set(made["steady"]) == set(made["transient"]) == {"peak", "end", "current"}
    end = made["steady"]["end"]
    assert sum(part["value"] for part in end["parts"]) == pytest.approx(end["difference"]["value"], rel=1e-9)
    assert made["transient"]["end"]["time_s"] >= 1e-5
    steady_only = replace(case.fem3d, traces=None)
    short = budget(case.sink, "paper", steady_only, case.levels)
    assert short.transient == ()
    assert short.steady[2].scale == pytest.approx(found.steady[2].scale, rel=1e-4)


def test_a_model_of_the_ladder_that_runs_away_is_named() -> None:
    """At 4.2 V with a falling resistance the fin has a steady state, the paper's shape on the same anchor has none."""
    sink = load("sink", ["silicon.temperature_coefficient=-1e-3", "voltage=4.2"])
    ladder.solve(sink, "fin", steady_only=True)
    with pytest.raises(RunawayError, match="in the model anchored"):
        budget(sink, "paper", solved("default").fem3d, Levels(sink))


@pytest.mark.long
@pytest.mark.parametrize("transient", [True, False])
def test_the_budget_is_drawn(transient: bool, tmp_path: Path) -> None:
    from validate.report.figures.analysis_figures import why as draw
    from validate.report.figures.drawing import save, style

    case = solved("default")
    fem3d = case.fem3d if transient else replace(case.fem3d, traces=None)
    why = budget(case.sink, "fin", fem3d, case.levels)
    with style():
        figure = draw(Outcome(case.sink, Request(transient=transient), (), fem3d, None, (), why=why))
        assert save(figure, tmp_path, "why") == ["why.png", "why.svg"]
    # A bar for each quantity, and over time an area beside each.
    assert len(figure.axes) == (6 if transient else 3)
    text = (tmp_path / "why.svg").read_text(encoding="utf-8")
    assert all(part.blame in text for part in why.steady[0].parts)


@pytest.mark.long
def test_the_plates_estimate_of_what_it_leaves_out() -> None:
    """Silicon of 10 um, where it is 0.1 %: the estimate is right to a half of itself."""
    sink = load("sink", ["sink.thickness=10um", "run.accuracy=1e-4"])
    exact = solve_3d(sink, Request(transient=False)).steady["anchor_resistance_K_per_W"]
    found = ladder.solve(sink, "plate", steady_only=True)
    off = abs(found.steady["anchor_resistance_K_per_W"].value / exact.value - 1)
    assert exact.error / exact.value < 0.1 * off
    assert off / 1.5 < found.details["thin_plate_remainder"] < 1.5 * off
    assert any("thin-plate" in text for text in found.details["warnings"])


@pytest.mark.long
def test_a_row_of_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the cheapest 3D solution; what matters is that every model has its row."""
    monkeypatch.setattr("validate.bench.ladder_table.REPEATS", 1)
    monkeypatch.setattr("validate.bench.ladder_table.MODELS", ("paper", "plate", "moments:3"))
    lines = scene("A title", ["sink.width=150um"], "1e-3").splitlines()
    assert lines[0] == "## A title (`--set sink.width=150um`)"
    rows = [line for line in lines if line.startswith("| `")]
    assert len(rows) == 3
    assert all(row.count("|") == lines[4].count("|") for row in rows)
    assert "own error at most" in lines[2]
    assert slow_row("150um")[-1] == "no"
    assert thin_row("10um", "1e-3")[-1] == "yes"
