"""A model of one's own of the sink: where it is the paper's, it is judged as the paper's is."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import compare
from compare.models import open_model
from compare.slopes import own_model
from reduced1d.ladder import solve
from reduced1d.network.solution import solve_sink as by_lines
from scenes.loading import from_dict

OF_ONE = ("fig4", "fig6_peak", "fig6_end", "fig7_current")


def papers(scene: dict[str, Any], times: np.ndarray | None) -> dict[str, Any]:
    """The paper's own model, as a function of the sink in plain numbers."""
    found = solve(from_dict(scene), steady_only=times is None, times=times)
    if times is None:
        return {name: found.steady[name].value for name in ("peak_rise_K", "end_rise_K", "current_A")}
    return {name: found.over_time.values[name] for name in ("peak_K", "end_K", "current_A")}


def hotter(scene: dict[str, Any], times: np.ndarray | None) -> dict[str, Any]:
    """Its steady peak alone, 5 % larger."""
    return {} if times is not None else {"peak_rise_K": 1.05 * papers(scene, times)["peak_rise_K"]}


@pytest.mark.long
def test_the_papers_model_as_a_function_is_judged_as_the_papers(tmp_path):
    own = compare.run("sink", reduction=papers, accuracy=1e-2, sensitivities=True, uncertain={"sink.width": "1%"})
    paper = compare.run("sink", accuracy=1e-2, sensitivities=True, uncertain={"sink.width": "1%"})
    for check in OF_ONE:
        one, other = own.check(check), paper.check(check)
        assert one.difference == pytest.approx(other.difference, rel=1e-9)
        assert one.verdict == other.verdict
        # Slopes by differences over 1e-3 are off by their square.
        assert one.u_input == pytest.approx(other.u_input, rel=1e-3)
    slopes = []
    for found in (own, paper):
        slopes.append(found.sensitivities["reduced1d"].relative["sink.width"]["end_rise_K"].value)
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-4)
    assert own.answer.startswith("The 1D model papers is 6.6 % low at the peak and 30 % low at the ends")
    assert own.outcome.scene.expected_to_differ is None


@pytest.mark.long
@pytest.mark.usefixtures("no_field")
def test_a_model_of_one_number(tmp_path):
    """Checks of missing quantities are not made, pictures and files are."""
    out = tmp_path / "run"
    found = compare.run("sink", reduction=hotter, accuracy=1e-2, out=out, figures=True)
    known = compare.run("sink", accuracy=1e-2, steady=True)
    assert found.check("fig4").difference == pytest.approx(1.05 * (1 + known.check("fig4").difference) - 1, abs=1e-9)
    assert [check for check in OF_ONE if check in found.checks] == ["fig4"]
    assert any('has no value of "end_rise_K"' in text for text in found.outcome.warnings)
    assert (out / "figure6.png").exists()
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert list(summary["reduced1d"]["steady"]) == ["peak_rise_K"]


def test_a_spike_between_two_rows_of_3d_is_found():
    traces = compare.run("sink", only="3d", accuracy=1e-2).fem3d.traces
    first, last = traces.time[-2:]

    def spiky(scene: dict[str, Any], times: np.ndarray | None) -> dict[str, Any]:
        t, values = np.zeros(0) if times is None else times, traces.values["peak_K"]
        spike = 5 * np.exp(-(((t - first) / (last - first) - 0.5) ** 2) / 0.02)
        return {} if times is None else {"peak_K": np.interp(t, traces.time, values) + spike}

    run = compare.run("sink", reduction=spiky, accuracy=1e-2)
    check = run.check("fig6_peak")
    assert check.difference == pytest.approx(5 / run["peak_rise_K"].value, abs=check.u_num)
    assert check.verdict == "differs"
    assert {len(column) for column in run.traces.values()} == {len(run.reduced1d.traces.time)}
    said = " ".join(run.report().split())
    assert 'spiky has no value of "peak_rise_K", "end_rise_K", "mean_rise_K", "current_A" and' in said
    assert "Not counted, as the chosen model does not use them: eq12, eq13" in said


def test_a_table_of_values(tmp_path):
    (tmp_path / "rest.csv").write_text("peak_rise_K, 20 K\n", encoding="utf-8")
    run = compare.run("sink", reduction=str(tmp_path / "rest.csv"), steady=True, accuracy=1e-2)
    assert run.check("fig4").predicted == 20.0
    assert "rest.csv is 1.6" in run.answer


@pytest.mark.long
def test_the_network_is_judged_and_has_no_slope_where_it_jumps():
    """Pads and oxide are square: with another side the longest they lie another way, so that there is no slope."""
    run = compare.run("sink", reduction="network", accuracy=1e-2, steady=True)
    sink, three = run.outcome.scene, run.outcome.fem3d

    def peak(voltage: float) -> float:
        return by_lines(replace(sink, voltage=voltage)).steady["peak_rise_K"].value

    assert run.check("fig4").difference == pytest.approx(peak(1.0) / three.steady["peak_rise_K"].value - 1, rel=1e-9)
    keys = ["anchor.pad_width", "anchor.oxide_length", "drive.voltage"]
    model = open_model("network")
    assert repr(model) == "Model(name='network')"
    slopes = own_model(model, sink, run.reduced1d, keys, three)
    assert set(slopes.left_out) == {"anchor.pad_width", "anchor.oxide_length"}
    assert all("not differentiable" in why for why in slopes.left_out.values())
    # Slopes by differences over 1e-3 are off by its square.
    by_voltage = (peak(1.001) - peak(0.999)) / 0.002
    slope = slopes.relative["drive.voltage"]["peak_rise_K"].value
    assert slope * peak(1.0) == pytest.approx(by_voltage, rel=1e-6)
    assert by_voltage != pytest.approx(2 * peak(1.0), rel=1e-3)
