"""Solve any scene of boxes, or on a Gmsh or Nastran mesh, in 3D: heat, current or both; steady or
over time; every probe with its estimated numerical error.

examples:
  validate scene bridge > mine.toml; validate solve mine.toml
  validate solve bridge --set "boundary.left electrode.voltage=3V" --accuracy 1e-4
  validate solve hotplate --end-time 2ms --explain
  validate solve bridge --model lumped.py:bridge
  validate solve bridge --sensitivities
  validate solve hotplate --against measured.csv --data-uncertainty 0.5K
  validate solve hotplate --export my-model --model-accuracy 1e-2

results: summary.json, traces.csv (a column per probe) and figures in
results/<scene>-<what distinguishes it>/
exit status: 0 solved, 1 a check of a model is not as declared, 2 bad input, 3 the numerics failed
"""

from __future__ import annotations

from functools import partial

from validate.cli import common

OPTIONS = common.options_of("free")
run = partial(common.run, "free")
