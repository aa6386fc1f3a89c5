"""Effects that both models leave out: each change equals a solution with the effect, and so does the change of all."""

import json
from dataclasses import replace
from functools import cache

import pytest

import compare
from compare.analyses import left_out
from compare.analyses.left_out import CONDUCTIVITY
from compare.outcome import Outcome, Progress
from fem3d.runs.sink import solve
from scenes.errors import RunawayError
from scenes.result import Result
from scenes.sink import OF_A_SINK, Sink

SINK = Sink(accuracy=5e-2)


def study(sink: Sink) -> left_out.LeftOut:
    return left_out.LeftOutStudy().run(Outcome(sink, results={"fem3d": steady(sink)}), Progress())


solved = cache(solve)


@pytest.fixture(scope="module", autouse=True)
def found():
    """Solved no more closely than the tests need, every sink once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fem3d.runs.sink.solve", solved)
        yield study(SINK)
    solved.cache_clear()


def steady(sink: Sink) -> Result:
    return solved(sink, transient=False)


def test_an_effect_is_the_sink_with_it_over_the_sink_without(found):
    cooled = steady(replace(SINK, **left_out.effects(SINK)["air"].changed))
    for asked in OF_A_SINK.values():
        ratio = cooled.steady[asked.steady].value / steady(SINK).steady[asked.steady].value
        assert found.effects["air"].changes[asked.steady].value == pytest.approx(ratio - 1, rel=1e-12)
    assert found.effects["air"].changes["peak_rise_K"].value < -10 * found.effects["air"].changes["peak_rise_K"].error


def test_the_largest_comes_first_and_in_air_the_gas_below_decides(found):
    sizes = [abs(each.changes["peak_rise_K"].value) for name, each in found.effects.items() if name != "together"]
    assert sizes == sorted(sizes, reverse=True)
    below = steady(replace(SINK, gap_gas_conductivity=CONDUCTIVITY)).steady["peak_rise_K"].value
    change = below / steady(SINK).steady["peak_rise_K"].value - 1
    assert found.effects["gap_gas"].changes["peak_rise_K"].value == pytest.approx(change, rel=1e-12)


def few(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    """Some of the effects alone."""
    every = left_out.effects
    monkeypatch.setattr(left_out, "effects", lambda sink: {name: every(sink)[name] for name in names})


def test_what_the_scene_has_is_not_left_out(found, monkeypatch):
    few(monkeypatch, "contact", "gap_gas", "air")
    cooled = study(replace(SINK, convection_coefficient=50.0, gap_gas_conductivity=0.01))
    assert {"air", "gap_gas"} <= {*found.effects}
    assert not {"air", "gap_gas"} & {*cooled.effects}
    assert cooled.skipped == dict.fromkeys(("gap_gas", "air"), "the scene has it")


def test_what_a_row_cannot_have_is_said(monkeypatch):
    few(monkeypatch, "contact", "gap_gas", "substrate")
    row = study(replace(SINK, spans=2))
    for effect in ("substrate", "gap_gas"):
        assert effect not in row.effects
        assert "sink.spans = 2" in row.skipped[effect]


def test_an_effect_with_which_the_sink_runs_away_decides(monkeypatch):
    def away(sink: Sink, transient: bool) -> Result:
        if sink.substrate_thickness is not None:
            raise RunawayError("runs away", 0.5)
        return solved(sink, transient=transient)

    monkeypatch.setattr("fem3d.runs.sink.solve", away)
    found = study(SINK)
    assert next(iter(found.effects)) == "substrate"
    assert not found.effects["substrate"].changes
    assert not found.effects["together"].changes


@pytest.mark.long
@pytest.mark.usefixtures("no_field")
def test_it_is_told_and_kept(tmp_path):
    run = compare.run(SINK, steady=True, left_out=True, out=tmp_path / "run", figures=True)
    summary = json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))
    effects = {"conductivity", "contact", "gap_gas", "radiation", "substrate", "air"}
    assert {*summary["left_out"]} == {*effects, "together"}
    for name, entry in summary["left_out"].items():
        assert {*entry} == {"assumed", "source", *(asked.steady for asked in OF_A_SINK.values())}
        assert {*entry["peak_rise_K"]} == {"change", "error"}
        assert bool(entry["source"]) == (name != "together")
    assert "left_out" in run.outcome.analyses
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "What both models leave out" in page
    assert any(step["step"] == "left_out" for step in summary["plan"])
