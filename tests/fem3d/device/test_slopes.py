"""How the device's steady state in 3D follows its keys, against differences of whole models, and laws that it obeys."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fem3d.device.solve import Model, model
from fem3d.device_sensitivity import FOLLOWED, of_device
from fem3d.sensitivity import Table
from scenes.device import Device
from scenes.varied import numbers, varied
from validate.cli import main

DEVICE, STEP = Device(), 0.02


@pytest.fixture(scope="module")
def table() -> Table:
    found, left_out = of_device(DEVICE, model(DEVICE, 1e-2))
    assert not left_out
    assert set(found) == set(numbers(DEVICE))
    return found


@pytest.mark.parametrize("key", ["sink.width", "device.polymer_thickness"])
def test_differences_of_models(table: Table, key: str) -> None:
    def solved(factor: float) -> tuple[Model, Device]:
        other = varied(DEVICE, key, factor)
        return model(other, 1e-3), other

    more, less = (own.steady(other) for own, other in map(solved, (1 + STEP, 1 - STEP)))
    for name in FOLLOWED:
        a, b = getattr(more, name), getattr(less, name)
        # Models known to 1e-3 over twice the step, where their meshes are not alike.
        assert table[key][name].value == pytest.approx((a - b) / (STEP * (a + b)), abs=table[key][name].error + 3e-3)


def test_laws(table: Table) -> None:
    """Powers go with all sizes; voltages with the root of the resistivity; the sensor pays for the polymer."""
    sizes = [key for key in table if key.startswith(("sink.", "anchor.")) or key.endswith("_thickness")]
    for name in ("sink_power_W", "sensor_power_W"):
        slopes = [table[key][name] for key in sizes]
        error = sum(slope.error for slope in slopes)
        assert sum(slope.value for slope in slopes) == pytest.approx(1, abs=error)
        assert error < 0.1
    assert table["materials.gold.resistivity"]["sensor_V"].value == pytest.approx(0.5, abs=1e-4)
    assert table["materials.pdms.thermal_conductivity"]["polymer_flux_W"].value == pytest.approx(1, abs=1e-2)


def test_the_command(tmp_path: Path) -> None:
    arguments = ["device", "--3d", "--sensitivities", "--figure", "9", "--no-figures", "--accuracy", "1e-2"]
    assert main([*arguments, "--out", str(tmp_path / "run")]) in (0, 1)
    found = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert "error" in found["sensitivities"]["sink.width"]["sink_power_W"]["fem3d"]
    checks = {check["id"]: check for check in found["checks"]}
    assert checks["slope_sink.length"]["verdict"] == "differs"
    assert checks["slope_materials.gold.resistivity"]["verdict"] == "agrees"
