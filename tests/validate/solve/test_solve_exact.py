"""`validate solve` on cases with exact solutions: every probe is within its estimated error, which is small."""

import json
from math import log, sqrt
from pathlib import Path

import pytest

from validate.cli import main


def solve(scene: str, *settings: str) -> dict:
    given = [part for setting in settings for part in ("--set", setting)]
    assert main(["solve", scene, "--no-figures", "--quiet", "--out", "out", *given]) == 0
    return json.loads(Path("out/summary.json").read_text(encoding="utf-8"))["fem3d"]


BLOCK = """
run.output_times = [1, 2]
material = [{name = "clay", thermal_conductivity = 1, density = 1000, specific_heat = 800}]
probe = [{name = "centre", at = [5e-3, 5e-3, 5e-3]}]
[[box]]
name = "block"
material = "clay"
lower = [0, 0, 0]
upper = [0.01, 0.01, 0.01]
heat_source = { times = [0, 1], values = [0, "4e6 W/m3"] }
"""


def test_insulated_block_stores_all_its_heat():
    Path("block.toml").write_text(BLOCK, encoding="utf-8")
    found = solve("block.toml")["transient"]
    # 2.5 K after the ramp, 5 K more each second.
    assert found["values"]["centre"] == pytest.approx([295.5, 300.5], abs=found["errors"]["centre"])
    assert found["errors"]["centre"] < 1e-3 * 7.5
    half = solve("block.toml", "box.block.heat_source.values=[0, 2e6]")["transient"]
    assert half["values"]["centre"] == pytest.approx([294.25, 296.75], abs=half["errors"]["centre"])


# A bar whose ends are at T0 and 0 and V volts: the integral of k/sigma over T, from T0 to the peak, is V^2/8.
K, COLD, HOT, PEAK = 100.0, 1e5, 2.5e4, 500.0
SLOPE = (HOT - COLD) / 400
VOLTS = sqrt(8 * K / SLOPE * log((COLD + SLOPE * (PEAK - 300)) / COLD))
HELD_BAR = f"""
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


def test_a_table_of_conductivity_is_exact_between_its_rows(ran):
    Path("bar.toml").write_text(HELD_BAR, encoding="utf-8")
    summary, _ = ran("solve bar.toml --uncertain material.metal.electrical_conductivity=2%")
    middle = summary["fem3d"]["steady"]["middle"]
    assert abs(middle["value"] - PEAK) <= middle["error"] < 0.05
    # d peak / d ln sigma = sigma(peak) V^2 / (8 k); the uncertainty is 2 % of it.
    slope = (COLD + SLOPE * (PEAK - 300)) * VOLTS**2 / 8 / K
    assert middle["u_input"] == pytest.approx(0.02 * slope, rel=1e-3)
