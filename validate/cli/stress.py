"""`validate stress`: numerical stability and robustness."""

from __future__ import annotations

import argparse

from validate.cli import common
from validate.cli.terminal import DIFFERS, FINE, Progress


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.description = (
        "Test numerical stability and robustness: time steps from 1 ns to 1 s, thin layers and long beams,\n"
        "contrasts up to 1e8, thermal runaway, steps, ramps and square waves, accuracies, explicit coupling, and\n"
        "random scenes held to invariants. What breaks is a row that says so."
    )
    parser.epilog = (
        "examples:\n"
        "  validate stress --quick\n"
        "  validate stress --scenes 2000 --markdown docs/stress.md\n\n"
        "exit status: 0 nothing breaks but what is predicted to, 1 something does, 2 bad input"
    )
    add = parser.add_argument
    add("--quick", action="store_true", help="fewer of each kind, in less than two minutes")
    add("--scenes", metavar="N", help="how many random scenes (default 200, with --quick 24)")
    add("--seed", metavar="N", default="0", help="the first random scene's seed (default 0)")
    common.shared(parser, common.OF_A_TABLE)


def run(arguments: argparse.Namespace) -> int:
    """Runs the tests and reports."""
    import time
    from functools import partial

    from validate.stress import report
    from validate.stress.run import QUICK_SCENES, run

    default = str(QUICK_SCENES if arguments.quick else 200)
    scenes = common.whole("--scenes", arguments.scenes or default, 1, 1_000_000)
    seed = common.whole("--seed", arguments.seed, 0, 2**31)
    started = time.perf_counter()
    with Progress() as progress:
        rows = run(arguments.quick, scenes, seed, common.jobs(arguments.jobs), progress)
    common.show_rows(arguments, report, rows, time.perf_counter() - started, partial(report.markdown, seed=seed))
    return DIFFERS if report.broken(rows) else FINE
