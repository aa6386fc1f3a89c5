"""`validate solve` on cases with exact solutions: every probe is within its estimated error, which is small."""

import csv
import json
from math import log, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from validate.cli import main


def solve(scene: str, *settings: str) -> dict:
    given = [part for setting in settings for part in ("--set", setting)]
    assert main(["solve", scene, "--no-figures", "--quiet", "--out", "out", *given]) == 0
    return json.loads(Path("out/summary.json").read_text(encoding="utf-8"))["fem3d"]


def plate(conductivity: float = 52.0) -> float:
    """The temperature (K) at the probe of the plate: the series in cosines across, hyperbolic functions along (Carslaw
    and Jaeger, Conduction of Heat in Solids, 2nd ed., section 5.2)."""
    width, length, ratio, x, y = 0.6, 1.0, 750.0 / conductivity, 0.6, 0.2
    found = 0.0
    for n in range(200):
        root = brentq(
            lambda u: u * np.sin(u * width) - ratio * np.cos(u * width),
            n * np.pi / width, (n + 0.5) * np.pi / width, xtol=1e-13,
        )  # fmt: skip
        weight = 100 * np.sin(root * width) / root / (width / 2 + np.sin(2 * root * width) / 4 / root)

        def along(d: float, k: float = root) -> float:
            decay = np.exp(-2 * k * d)
            return float((1 + decay) / 2 + ratio / k * (1 - decay) / 2)

        found += weight * np.cos(root * x) * np.exp(-root * y) * along(length - y) / along(length)
    return found + 273.15


@pytest.mark.parametrize("accuracy", [1e-2, 5e-3])
def test_plate_cooled_at_two_edges(accuracy):
    found = solve("plate", f"run.accuracy={accuracy}")["steady"]["E"]
    assert abs(found["value"] - plate()) <= found["error"] <= accuracy * 100.0
    # A conductivity that is off by a tenth is detected.
    assert abs(found["value"] - plate(57.2)) > 3 * found["error"]


BAR = """
run = {end_time = "2 ms", output_times = ["0.5 ms", "1 ms"]}
material = [{name = "metal", resistivity = "2e-6 ohm m"}]
box = [{material = "metal", lower = [0, 0, 0], upper = ["200 um", "10 um", "1 um"]}]
probe = [
  {name = "current in", quantity = "current", lower = [0, 0, 0], upper = [0, "10 um", "1 um"]},
  {name = "section", quantity = "current", lower = ["50 um", -1, -1], upper = ["50 um", 1, 1]},
  {name = "quarter", quantity = "potential", at = ["50 um", "5 um", 0]},
]
[[boundary]]
name = "drive"
lower = [0, 0, 0]
upper = [0, "10 um", "1 um"]
voltage = { times = [0, "1 ms", "1 ms"], values = [0, "1 V", "3 V"] }
[[boundary]]
lower = ["200 um", 0, 0]
upper = ["200 um", "10 um", "1 um"]
voltage = 0
"""


def test_current_and_potential_follow_a_ramp_and_a_jump():
    Path("bar.toml").write_text(BAR, encoding="utf-8")
    found = solve("bar.toml")["transient"]
    assert found["time_s"] == [0.5e-3, 1e-3, 2e-3]
    # 40 ohm; at the jump the later value.
    currents = [0.5 / 40, 3 / 40, 3 / 40]
    for name, exact in (("current in", currents), ("section", currents), ("quarter", [0.375, 2.25, 2.25])):
        assert found["values"][name] == pytest.approx(exact, abs=found["errors"][name] + 1e-12)
        assert found["errors"][name] < 1e-3 * max(exact)
    with open("out/traces.csv", encoding="utf-8") as file:
        rows = [{name: float(text) for name, text in row.items()} for row in csv.DictReader(file)]
    assert list(rows[0]) == ["time_s", "current in", "section", "quarter"]
    assert all(row["quarter"] == pytest.approx(30 * row["section"], abs=1e-9) for row in rows)


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
