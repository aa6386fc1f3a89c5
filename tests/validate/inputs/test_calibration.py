"""Keys fitted to data with a given truth."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from compare import quantities
from compare.against import Data
from compare.data.read import read_uncertainty
from compare.fitting import Fit, Modelled, fit_scene, keys_of
from reduced1d import slopes
from reduced1d.ladder import solve
from scenes.errors import SceneError
from scenes.sink import Sink
from scenes.varied import varied
from validate.cli import main

OXIDE, SILICON = "materials.oxide.thermal_conductivity", "materials.silicon.thermal_conductivity"
TIMES = np.linspace(2e-4, 0.02, 40)
NOISE = 0.05


def measured(truth: Sink, seed: int) -> Data:
    """Data as the paper's model of a sink has them, with noise."""
    traces = solve(truth, times=TIMES).traces
    drawn = np.random.default_rng(seed).standard_normal((2, len(TIMES))) * NOISE
    values = {n: traces.values[n] + noise for n, noise in zip(("peak_K", "end_K"), drawn, strict=True)}
    return Data("mine.csv", "CSV", TIMES, values, dict.fromkeys(values, "x"))


def in_1d(sink: Sink, keys: Sequence[str], times: np.ndarray) -> Modelled:
    """Traces of the paper's 1D model, and their derivatives."""
    return solve(sink, times=times).over_time.values, slopes.of_sink(sink, "paper", keys, times)[1]


def fitted(data: Data, *keys: str) -> Fit:
    sink = Sink()
    data = replace(data, u=read_uncertainty(quantities.of(sink), data, [f"{NOISE}K"]))
    return fit_scene(sink, data, keys_of(sink, keys), in_1d)


@pytest.mark.long
def test_the_truth_is_within_the_interval_as_often_as_is_said():
    truth = varied(varied(Sink(), OXIDE, 0.85), SILICON, 1.05)
    inside = dict.fromkeys((OXIDE, SILICON), 0)
    for seed in range(100):
        found = fitted(measured(truth, seed), OXIDE, SILICON)
        for key, value in ((OXIDE, truth.oxide.thermal_conductivity), (SILICON, truth.silicon.thermal_conductivity)):
            low, high = found.interval(key)
            inside[key] += low < value < high
        assert found.misfit == pytest.approx(1, abs=0.6)
    # 95 of 100 give or take 2.2; these draws are the same in every run.
    assert all(93 <= count <= 99 for count in inside.values()), inside


@pytest.mark.long
def test_the_spread_of_the_fits_is_their_uncertainty():
    found = [fitted(measured(Sink(), seed), OXIDE) for seed in range(60)]
    spread = np.log([f.fitted[OXIDE] for f in found]).std(ddof=1)
    assert spread == pytest.approx(found[0].u[OXIDE], rel=0.25)


def test_keys_that_go_together_are_named():
    """The paper's anchor has but the oxide's thickness over its conductivity."""
    found = fitted(measured(Sink(), 1), OXIDE, "oxide_thickness")
    assert abs(found.correlations[0, 1]) > 0.99
    assert any("can't be told apart" in text and "ratio" in text for text in found.warnings())


def test_a_model_that_is_wrong_is_seen():
    """Ends that are 1 K hotter for a reason that no oxide is."""
    data = measured(Sink(), 1)
    wrong = replace(data, values=data.values | {"end_K": data.values["end_K"] + 1.0})
    assert any("something else" in text for text in fitted(wrong, OXIDE).warnings())
    assert not fitted(data, OXIDE).warnings()


@pytest.mark.parametrize(("keys", "said"), [
    (["pad_witdh"], "unknown key"), ([OXIDE, OXIDE], "twice"), (["convection_coefficient"], "no number"),
])  # fmt: skip
def test_refused(keys, said):
    with pytest.raises(SceneError, match=said):
        keys_of(Sink(), keys)


def test_fewer_points_than_unknowns_are_refused():
    data = measured(Sink(), 0)
    few = replace(data, time=data.time[:1], values={"peak_K": data.values["peak_K"][:1]})
    with pytest.raises(SceneError, match="1 point, which can't tell 2 keys"):
        fitted(few, OXIDE, SILICON)


def test_what_nothing_follows_is_refused():
    with pytest.raises(SceneError, match="follows it, so that it can't be fitted"):
        fitted(measured(Sink(), 0), "materials.oxide.density")


@pytest.mark.long
def test_the_command(tmp_path, ran):
    """Data of 3D itself with another oxide, by 3D's own slope: the fit recovers it."""
    ran(f"sink --set {OXIDE}=1.2 --accuracy 1e-2 --only 3d")
    traces = (tmp_path / "run" / "traces.csv").read_text(encoding="utf-8")
    names, *rows = [line.split(",") for line in traces.splitlines()]
    columns = [names.index(name) for name in ("time_s", "fem3d_peak_K", "fem3d_end_K")]
    file = tmp_path / "mine.csv"
    lines = [",".join(row[c] for c in columns) for row in rows]
    file.write_text("\n".join(["time (s),peak (K),end (K)", *lines]) + "\n", encoding="utf-8")
    summary, said = ran(f"sink --against {file} --data-uncertainty 0.1K --calibrate {OXIDE} --accuracy 1e-2")
    assert "not validated by them" in said
    (line,) = re.findall(r"thermal_conductivity = (\S+)", said)
    assert len(line) <= 7
    found = summary["calibration"]["keys"][OXIDE]
    assert found["start"] == 1.38
    assert found["interval"][0] < 1.2 < found["interval"][1]
    assert summary["scene"]["materials"]["oxide"]["thermal_conductivity"] == found["value"]


@pytest.mark.parametrize("given", [["--calibrate", OXIDE], ["--against", "FILE", "--calibrate", OXIDE]])
def test_without_data_or_their_uncertainty_it_is_refused(given, tmp_path, capsys):
    file = tmp_path / "mine.csv"
    file.write_text("time (ms),peak (K)\n0,293\n1,303\n2,306\n3,308\n", encoding="utf-8")
    assert main(["sink", *(str(file) if word == "FILE" else word for word in given)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
