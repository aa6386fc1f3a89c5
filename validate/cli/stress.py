"""Test numerical stability and robustness: thin layers and long beams, contrasts up to 1e8, thermal runaway, bars
of random laws near their limit, and random scenes, of boxes and on mesh files, held to invariants. A failure is
a row of the table.

examples:
  validate stress --quick
  validate stress --scenes 2000 --markdown docs/stress.md

exit status: 0 nothing breaks, 1 something does, 2 bad input
"""

from __future__ import annotations

import argparse
from functools import partial

from validate.cli import common
from validate.cli.terminal import DIFFERS, FINE

OPTIONS = {
    "--quick": "fewer of each kind",
    "--scenes N": "how many random scenes, half of them the hold-out (default 200, with --quick 24)",
    "--seed N": "the first random scene's seed (default 0)",
    **common.OF_A_TABLE,
}
ABOUT = """\
The table of one run of `validate stress`, which wrote this page. Most rows have the worst of several numbers beside its
limit. A finer solution of a random scene is ten times finer, of a plate four times, with laws of the temperature three
times; its own error bound counts too. Scenes of the *hold-out* have seeds from 1,000,000 on: no constant of the solver
is ever tuned to them.
"""


def run(arguments: argparse.Namespace) -> int:
    from benchmarks.stress import QUICK_SCENES, run

    default = str(QUICK_SCENES if arguments.quick else 200)
    scenes = common.whole("--scenes", arguments.scenes or default, 1, 1_000_000)
    seed = common.whole("--seed", arguments.seed or "0", 0, 2**31)
    find = partial(run, arguments.quick, scenes, seed)
    rows = common.table(arguments, "Numerical stability and robustness", ABOUT, find, f" Seed {seed}.")
    return DIFFERS if any(row.verdict == "differs" for row in rows) else FINE
