"""A table of an electrical conductivity against the closed form of a bar that is held at both ends."""

import json
from math import log, sqrt

import pytest

from validate.cli import main

# A bar whose ends are at T0 and 0 and V volts: the integral of k/sigma over T, from T0 to the peak, is V^2/8.
K, COLD, HOT, PEAK = 100.0, 1e5, 2.5e4, 500.0
SLOPE = (HOT - COLD) / 400
VOLTS = sqrt(8 * K / SLOPE * log((COLD + SLOPE * (PEAK - 300)) / COLD))
BAR = f"""
[run]
steady = true
accuracy = 1e-4
[[material]]
name = "metal"
thermal_conductivity = {K}
electrical_conductivity = {{temperatures = ["300 K", "700 K"], values = ["{COLD} S/m", "{HOT} S/m"]}}
[[box]]
name = "bar"
material = "metal"
lower = [0, 0, 0]
upper = ["1 mm", "10 um", "10 um"]
""" + "".join(f"""
[[boundary]]
name = "{name}"
lower = ["{x} mm", 0, 0]
upper = ["{x} mm", "10 um", "10 um"]
voltage = {volts}
[[boundary]]
name = "{name} end"
lower = ["{x} mm", 0, 0]
upper = ["{x} mm", "10 um", "10 um"]
temperature = 300
""" for name, x, volts in (("left", 0, VOLTS), ("right", 1, 0))) + """
[[probe]]
name = "middle"
at = ["0.5 mm", "5 um", "5 um"]
"""  # fmt: skip


def test_a_table_of_conductivity_is_exact_between_its_rows(tmp_path):
    (tmp_path / "bar.toml").write_text(BAR, encoding="utf-8")
    given = ["--uncertain", "material.metal.electrical_conductivity=2%", "--no-figures", "--quiet", "--out"]
    assert main(["solve", str(tmp_path / "bar.toml"), *given, str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    middle = summary["fem3d"]["steady"]["middle"]
    assert abs(middle["value"] - PEAK) <= middle["error"] < 0.05
    # d peak / d ln sigma = sigma(peak) V^2 / (8 k); the uncertainty is 2 % of it.
    slope = (COLD + SLOPE * (PEAK - 300)) * VOLTS**2 / 8 / K
    assert middle["u_input"] == pytest.approx(0.02 * slope, rel=1e-3)
