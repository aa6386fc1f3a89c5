"""Test numerical stability and robustness: time steps from 1 ns to 1 s, thin layers and long beams,
contrasts up to 1e8, thermal runaway, steps, ramps and square waves, accuracies, explicit coupling, and
random scenes held to invariants. What breaks is a row that says so.

examples:
  validate stress --quick
  validate stress --scenes 2000 --markdown docs/stress.md

exit status: 0 nothing breaks but what is predicted to, 1 something does, 2 bad input
"""

from __future__ import annotations

import argparse
from functools import partial

from validate.cli import common
from validate.cli.terminal import DIFFERS, FINE

OPTIONS = {
    "--quick": "fewer of each kind, in less than two minutes",
    "--scenes N": "how many random scenes (default 200, with --quick 24)",
    "--seed N": "the first random scene's seed (default 0)",
    **common.OF_A_TABLE,
}


def run(arguments: argparse.Namespace) -> int:
    from validate.stress.report import TABLE, broken
    from validate.stress.sweep import QUICK_SCENES, run

    default = str(QUICK_SCENES if arguments.quick else 200)
    scenes = common.whole("--scenes", arguments.scenes or default, 1, 1_000_000)
    seed = common.whole("--seed", arguments.seed or "0", 0, 2**31)
    rows = common.table(arguments, TABLE, partial(run, arguments.quick, scenes, seed), f" Seed {seed}.")
    return DIFFERS if broken(rows) else FINE
