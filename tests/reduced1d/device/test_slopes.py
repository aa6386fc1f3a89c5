"""How the device's steady state follows its keys, against its closed form."""

import json

import pytest

from reduced1d.slopes import of_device
from scenes.device import Device
from validate.cli import main


def test_the_sensor_pays_for_the_polymer_alone():
    """With both elements at the set temperature the sensor's power is k A / t (T_set - T_outside)."""
    device = Device()
    found = of_device(device)
    power = {key: of["sensor_power_W"] for key, of in found.items()}
    outside = device.external.final_temperature
    expected = {
        "materials.pdms.thermal_conductivity": 1.0, "device.polymer_thickness": -1.0, "sink.length": 1.0,
        "sink.width": 1.0, "materials.gold.thermal_conductivity": 0.0,
        "external.final_temperature": -outside / (device.control.set_temperature - outside),
    }  # fmt: skip
    assert {key: power[key] for key in expected} == pytest.approx(expected, abs=1e-6)
    # V is the root of power times resistance, and that is as long as the film.
    voltage = found["sink.length"]["sensor_V"]
    assert voltage == pytest.approx(1.0, abs=1e-6)


def test_the_command(tmp_path, capsys):
    arguments = ["device", "--sensitivities", "--figure", "9", "--no-figures", "--out", str(tmp_path / "run")]
    assert main(arguments) in (0, 1)
    said = capsys.readouterr().out
    assert "pdms.thermal_conductivity" in said
    assert max(map(len, said.splitlines())) <= 80
    found = json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))["sensitivities"]
    assert found["device.polymer_thickness"]["sensor_power_W"]["reduced1d"]["value"] == pytest.approx(-1, abs=1e-6)
