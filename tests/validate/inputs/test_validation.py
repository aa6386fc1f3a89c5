"""Results of a comparison with data with a given truth."""

from dataclasses import replace

import numpy as np
import pytest

from compare import quantities
from compare.against import Data
from compare.analyses.against import Statement, Validation, finding, validate
from compare.data.read import read_uncertainty
from compare.options import Options
from compare.outcome import Outcome
from compare.slopes import sink_1d
from reduced1d.ladder import solve
from scenes.errors import SceneError
from scenes.result import Result
from scenes.sink import Sink
from scenes.uncertain import read
from validate.cli import main

TIMES = np.linspace(2e-4, 0.02, 60)
OXIDE = "materials.oxide.thermal_conductivity"


def model(sink: Sink) -> Result:
    return solve(sink, times=TIMES)


def measured(truth: Sink, noise: float, seed: int = 0, off: float = 0.0) -> Data:
    """Data as the paper's model of a sink has them, with noise (K), and off by something the model doesn't have."""
    traces = model(truth).traces
    drawn = np.random.default_rng(seed).standard_normal((2, len(TIMES))) * noise
    values = {"peak_K": traces.values["peak_K"] + drawn[0], "end_K": traces.values["end_K"] + drawn[1] + off}
    return Data("mine.csv", "CSV", TIMES, values, dict.fromkeys(values, "x"), others={"u (K)": np.full(60, 0.2)})


def known(data: Data, *given: str) -> Data:
    return replace(data, u=read_uncertainty(quantities.of(Sink()), data, given))


def statements(data: Data, given: list[str]) -> dict[tuple[str, str], Statement]:
    sink = Sink()
    one, uncertain = model(sink), read(sink, given) if given else None
    slopes = sink_1d(sink, one, TIMES) if given else None
    made = validate(sink, data, {"1D": (one, slopes)}, uncertain)
    return {(s.quantity, s.where): s for s in made.statements}


def test_data_of_the_model_itself_show_no_error():
    sink, data = Sink(), known(measured(Sink(), 0.2), "0.2K")
    made = validate(sink, data, {"1D": (model(sink), None)}, None)
    # 95 % of normally distributed noise lies within 2 u_D; of 60 points 57 give or take 1.7.
    for points in Validation().document(made, Outcome(sink))["points"]:
        assert 52 <= points["within_2_u_val"] <= 60
    assert not any(s.seen for s in made.statements)


def test_an_error_of_the_model_lies_in_its_interval():
    """The data's ends are 1.5 K hotter than the model has them: its error is -1.5 K."""
    found = statements(known(measured(Sink(), 0.1, off=1.5), "0.1K"), [])
    low, high = found["end_K", "end"].interval
    assert low < -1.5 < high
    assert found["end_K", "end"].seen
    assert not found["peak_K", "end"].seen


def test_an_oxide_that_is_known_badly_explains_what_it_does():
    """A sink whose oxide conducts 10 % less: detected where the oxide is exact, not where its uncertainty is 15 %."""
    oxide = Sink().oxide
    data = measured(Sink(oxide=replace(oxide, thermal_conductivity=0.9 * oxide.thermal_conductivity)), 0.01)
    data = known(data, "0.01K")
    assert statements(data, [])["end_K", "end"].seen
    loose = statements(data, [f"{OXIDE}=15%"])["end_K", "end"]
    assert not loose.seen
    assert loose.u_input == pytest.approx(1.5 * abs(loose.E), rel=0.2)
    assert loose.said().startswith("-")
    assert loose.interval[1] > 0


def test_the_room_moves_temperatures_by_itself():
    data = measured(Sink(), 0.01)
    found = statements(data, ["room_temperature=1K"])["end_K", "end"]
    assert found.u_input == pytest.approx(1.0, rel=0.02)


def test_how_data_uncertainty_is_given():
    data = measured(Sink(), 0.1)
    found = read_uncertainty(quantities.of(Sink()), data, ["0.5K", "end=1%"])
    assert found["peak_K"] == pytest.approx(np.full(60, 0.5))
    assert found["end_K"] == pytest.approx(0.01 * np.abs(data.values["end_K"] - 293.0))
    assert read_uncertainty(quantities.of(Sink()), data, ["end=u (K)"])["end_K"] == pytest.approx(np.full(60, 0.2))


@pytest.mark.parametrize("given", ["-0.5K", "0K", "1A", "peek=1K", "much", "current=1uA", "-1%"])
def test_refused(given):
    with pytest.raises(SceneError, match="data-uncertainty"):
        read_uncertainty(quantities.of(Sink()), measured(Sink(), 0.1), [given])


@pytest.mark.long
def test_the_command(tmp_path, ran):
    data, file = measured(Sink(), 0.1), tmp_path / "mine.csv"
    rows = zip(data.time, data.values["peak_K"], data.values["end_K"], np.full(60, 0.1), strict=True)
    lines = [",".join(map(str, row)) for row in rows]
    file.write_text("\n".join(["time (s),peak (K),end (K),sigma (K)", *lines]) + "\n", encoding="utf-8")
    given = f"--against {file} --data-uncertainty 'sigma (K)' --uncertain {OXIDE}=5% --accuracy 1e-2"
    # The data are none of 3D's, which the scene does not declare.
    summary, said = ran(f"sink {given}", status=1)
    assert "Points of the data within 2 u_val" in " ".join(said.split())
    found, checks = summary["validation"], {check["id"]: check for check in summary["checks"]}
    # The ends are worst late: of data / 3D - 1 it is 5 % by the sensitivity of 3D's end to the oxide's conductivity.
    against = checks["against_end"]
    assert against["u_input"] == pytest.approx(0.05 * 0.235 * (1 + against["difference"]), rel=0.1)
    assert checks["energy"]["u_input"] == 0
    end = {(s["model"], s["quantity"], s["where"]): s for s in found["statements"]}["3D", "end_K", "end"]
    # The data are from the paper's model; in 3D the ends are 1.3 K hotter.
    assert end["interval"][0] < 1.32 < end["interval"][1]
    assert end["seen"]
    assert end["u_val"] == pytest.approx(np.hypot(end["u_data"], np.hypot(end["u_input"], end["u_num"])))
    assert "Validation" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")


def test_the_figure():
    """The result is its title; every row of the data is there; a current is in mA, and its differences in uA."""
    from validate.report.figures import analysis_figures
    from validate.report.figures.drawing import kept

    sink = Sink()
    data = known(measured(sink, 0.1), "0.1K")
    current = model(sink).over_time.values["current_A"] + 2e-6
    data = replace(
        data, values=data.values | {"current_A": current}, u={**data.u, "current_A": np.full(len(TIMES), 1e-7)}
    )
    made = validate(sink, data, {"1D": (model(sink), None)}, None)
    outcome = Outcome(sink, Options(against=data), analyses={"validation": made})
    figure = analysis_figures.validation(outcome)
    labels = [axes.get_ylabel() for axes in figure.axes]
    mu = "\N{MICRO SIGN}"
    assert labels[:3] == ["peak rise (K)", "end rise (K)", "current (mA)"]
    assert labels[5] == f"E = S - D ({mu}A)"
    assert figure.texts[0].get_text() == kept(finding(made))
    assert finding(made).startswith("1D is off: current -2.")
    assert any(len(line.get_xdata()) == len(TIMES) and line.get_label() == "data" for line in figure.axes[0].lines)
    assert "60\N{NO-BREAK SPACE}rows" in figure.texts[1].get_text()


def test_without_data_it_is_refused(capsys):
    assert main(["sink", "--data-uncertainty", "0.5K"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
