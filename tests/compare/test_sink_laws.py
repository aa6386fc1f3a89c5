"""A sink whose silicon conducts less when it is hot, in 3D and in the 1D models."""

from dataclasses import replace

import pytest

from compare.made import made_checks
from reduced1d import ladder
from scenes.laws import PowerLaw, Table
from scenes.plan import Request
from scenes.sink import Sink
from validate.run.pipeline import answer

LAW = PowerLaw(130.0, 293.0, -1.3)
SINK = replace(Sink(voltage=2.0, accuracy=1e-2), silicon=replace(Sink().silicon, thermal_conductivity=LAW))


@pytest.mark.long
def test_the_constant_conductivity_is_an_assumption_of_its_own():
    outcome = answer(SINK, Request(transient=False, why=True))
    (peak,) = [split for split in outcome.why.steady if split.quantity == "peak"]
    parts = {part.blame: part.value for part in peak.parts}
    without, law = (
        ladder.solve(each, "plate", steady_only=True).steady["peak_rise_K"].value for each in (SINK.plain, SINK)
    )
    assert law - without > 15.0
    assert parts["constant conductivity"] == pytest.approx(without - law, rel=1e-3)
    assert sum(parts.values()) == pytest.approx(peak.total, rel=1e-9)
    assert abs(parts["rest (thin plate)"]) < 1e-2 * abs(parts["constant conductivity"])
    assert "constant conductivity" in outcome.answer
    # The paper's equations are as they are, and every check of them is made.
    papers = ladder.solve(SINK.plain, "paper", steady_only=True)
    assert outcome.reduced1d.steady == papers.steady
    made = made_checks(SINK, Request(transient=False))
    assert [check.id for check in outcome.checks] == list(made)
    assert {"fig4", "eq16"} <= set(made)
    (eq16,) = [check for check in outcome.checks if check.id == "eq16"]
    assert "of what it does at room temperature" in eq16.because


def test_the_ladder_starts_anywhere():
    from reduced1d.ladder.levels import Levels, rungs

    blamed = {start: [rung.blame for rung in rungs(Levels(SINK), start)] for start in ("paper", "anchored", "fin")}
    assert ["constant conductivity" in blames for blames in blamed.values()] == [True, True, False]
    assert "constant conductivity" not in [rung.blame for rung in rungs(Levels(SINK.plain), "paper")]
    radiating = [rung.blame for rung in rungs(Levels(Sink(emissivity=0.7)), "paper")]
    assert radiating[-2:] == ["radiation", "rest (thin plate)"]


@pytest.mark.long
def test_a_table_that_1d_gets_out_of_is_said():
    table = Table((293.0, 350.0), (130.0, 100.0))
    sink = replace(SINK, silicon=replace(SINK.silicon, thermal_conductivity=table))

    def said(sink, reduction):
        return answer(sink, Request(models=("reduced1d",), reduction=reduction, transient=False)).warnings

    (left,) = (text for text in said(sink, "fin") if "is a table" in text)
    assert "from 293 to 350 K, and 293 to 388 K are reached" in left
    assert not said(sink, "paper")
    assert not said(replace(sink, voltage=1.0), "fin")
