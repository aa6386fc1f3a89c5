"""For a modeller: your own traces against 3D. Here they come from a one-line lumped model; yours may come from COMSOL,
a CSV or ngspice, at any times, as long as the columns have the names of quantities, with units."""

import tempfile
from pathlib import Path

import numpy as np

import compare
import scenes
from reduced1d.equations import anchor_series_resistance

scene = scenes.load("sink")
material = scene.silicon

# The beam's heat capacity, and its way out: two anchors of eq 14 side by side after the beam's own L / (12 k A).
capacity = material.density * material.specific_heat * scene.length * scene.cross_section
conductance = material.thermal_conductivity * scene.cross_section
way_out = anchor_series_resistance(scene) / 2 + scene.length / (12 * conductance)
power = scene.voltage**2 * scene.cross_section / (material.resistivity * scene.length)
time = np.concatenate([[0.0], np.geomspace(1e-6, 0.02, 200)])
mean = scene.room_temperature + power * way_out * (1 - np.exp(-time / (way_out * capacity)))

with tempfile.TemporaryDirectory() as folder:
    file = Path(folder, "lumped.csv")
    np.savetxt(file, np.column_stack([time * 1e3, mean - 273.15]), delimiter=",", comments="",
               header="time (ms),mean (degC)")  # fmt: skip
    run = compare.run(scene, against=file)

check = run.check("against_mean")
print(f"{check.id}: {check.verdict}, {check.difference:+.1%} give or take {check.u_num:.1%} of the final rise")
print(check.because)
