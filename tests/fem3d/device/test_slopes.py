"""How the device's steady state in 3D follows its keys, against differences of whole models, and laws that it obeys."""

import json

import pytest

from fem3d.runs.device import FOLLOWED, reduce_structure
from scenes.device import Device
from scenes.varied import numbers, varied
from validate.cli import main

DEVICE, STEP = Device(), 0.02


@pytest.fixture(scope="module")
def summary(tmp_path_factory):
    folder = tmp_path_factory.mktemp("device") / "run"
    options = ["--figure", "9", "--sensitivities", "--uncertain", "pdms.thermal_conductivity=5%"]
    assert main(["device", "--3d", "--no-figures", "--accuracy", "1e-2", *options, "--out", str(folder)]) in (0, 1)
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


@pytest.mark.long
def test_differences_of_models(summary):
    key = "sink.width"
    beside = [varied(DEVICE, key, 1 + step) for step in (STEP, -STEP)]
    solved = [reduce_structure(device, 1e-3).steady(device) for device in beside]
    for name in FOLLOWED:
        more, less = (getattr(state, name) for state in solved)
        slope = summary["sensitivities"][key][name]["fem3d"]
        # Models within 1e-3 over twice the step, where their meshes are not alike.
        expected = (more - less) / (STEP * (more + less))
        assert slope["value"] == pytest.approx(expected, abs=slope["error"] + 3e-3)
        assert slope["error"] < 2e-2


@pytest.mark.long
def test_laws(summary):
    """Powers go with all sizes, the offset of a centred oxide being none of them; voltages with the root of the
    resistivity; the sensor pays for the polymer."""
    table = {key: {q: s["fem3d"] for q, s in of.items()} for key, of in summary["sensitivities"].items()}
    assert set(table) == set(numbers(DEVICE))
    sizes = {key for key in table if key.startswith(("sink.", "anchor.")) or key.endswith("_thickness")}
    for name in ("sink_power_W", "sensor_power_W"):
        slopes = [table[key][name] for key in sizes - {"anchor.oxide_offset"}]
        assert sum(slope["value"] for slope in slopes) == pytest.approx(1, abs=1e-3)
    assert table["materials.gold.resistivity"]["sensor_V"]["value"] == pytest.approx(0.5, abs=1e-4)
    assert table["materials.pdms.thermal_conductivity"]["polymer_flux_W"]["value"] == pytest.approx(1, abs=1e-2)


@pytest.mark.long
def test_u_input(summary):
    """The polymer's conductivity moves power and claims, and both models alike."""
    for model_ in ("fem3d", "reduced1d"):
        power = summary[model_]["steady"]["sensor_power_W"]
        assert power["u_input"] / power["value"] == pytest.approx(0.05, rel=1e-3)
    checks = {check["id"]: check for check in summary["checks"]}
    assert checks["dev3d_sensor_power"]["u_input"] < 1e-4
    assert checks["fig9_balance"]["u_input"] < 1e-9
    # How long the polymer takes goes with one over it, and the difference is the paper's time over that.
    settling = checks["fig9_settling"]
    assert settling["u_input"] == pytest.approx(0.05 * (1 + settling["difference"]), rel=1e-2)


@pytest.mark.long
def test_checks(summary):
    checks = {check["id"]: check for check in summary["checks"]}
    # 1D's heat leaves along the sink alone, and eq 14 leaves out the constriction.
    assert checks["slope_sink.length"]["verdict"] == "differs"
    assert checks["slope_materials.gold.resistivity"]["verdict"] == "agrees"
    assert "u_input" not in checks["slope_materials.gold.resistivity"]
