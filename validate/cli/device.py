"""Simulate the paper's whole sensor in 1D, and in 3D with --3d: sink, insulator, sensor, polymer and their
controllers. Check the claims of Figures 9 to 14, and the limits of gains, range and resolution.

examples:
  validate device
  validate device --3d --accuracy 1e-4
  validate device --figure 11 --set control.sample_time=2ms
  validate device --scheme paper --figure 9
  validate device --3d --uncertain materials --uncertain pdms.thermal_conductivity=5%
  validate device --max-power 20mW --meter PXI-4070
  validate device --export my-sensor

results: summary.json, traces.csv and figures in results/<scene>-<what distinguishes it>/
exit status: 0 every check came out as the scene declares, 1 one did not, 2 bad input, 3 the numerics failed
"""

from __future__ import annotations

from functools import partial

from validate.cli import common

OPTIONS = common.options_of("device")
run = partial(common.run, "device")
