"""Solve the paper's active sink in 3D and with its 1D reduction, and report how far they agree:
a verdict for equations 12 to 18 and Figures 4 to 7, with the estimated numerical error.

examples:
  validate sink --voltage 1
  validate sink --voltage 2V --set sink.width=20um --set drive.electrodes=pad-edge
  validate sink --export my-model
  validate sink --why
  validate sink --left-out
  validate sink --sensitivities
  validate scene sink > mine.toml; validate sink mine.toml --accuracy 1e-4 --strict

results: summary.json, traces.csv and figures in results/<scene>-<what distinguishes it>/
exit status: 0 every check came out as the scene declares, 1 one did not, 2 bad input, 3 the numerics failed
"""

from __future__ import annotations

from functools import partial

from validate.cli import common

OPTIONS = common.options_of("sink")
run = partial(common.run, "sink")
