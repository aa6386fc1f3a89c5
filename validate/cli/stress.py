"""`validate stress`: numerical stability and robustness."""

from __future__ import annotations

import argparse

from validate.cli.terminal import DIFFERS, FINE, Progress, show, style


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
    add("--jobs", metavar="N", help="processes at once (default: one a processor)")
    add("--markdown", metavar="FILE", help="write the table as a page of the documentation too")
    add("--quiet", action="store_true", help="print the outcome only, one line")
    add("--json", action="store_true", help="print the table as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Runs the tests and reports."""
    import json
    import time

    from validate.cli.common import jobs, whole, write_page
    from validate.report.summary import provenance
    from validate.stress import report
    from validate.stress.run import QUICK_SCENES, run

    default = str(QUICK_SCENES if arguments.quick else 200)
    scenes = whole("--scenes", arguments.scenes or default, 1, 1_000_000)
    seed = whole("--seed", arguments.seed, 0, 2**31)
    started = time.perf_counter()
    with Progress() as progress:
        rows = run(arguments.quick, scenes, seed, jobs(arguments.jobs), progress)
    seconds = time.perf_counter() - started
    if arguments.markdown is not None:
        write_page(arguments.markdown, report.markdown(rows, provenance(), seed))
    if arguments.json:
        show(json.dumps(report.document(rows, provenance(), seconds), indent=1, allow_nan=False))
    elif arguments.quiet:
        show(report.headline(rows))
    else:
        show(f"{report.text(rows, style())}\n\n{seconds:.0f} s")
    return DIFFERS if report.broken(rows) else FINE
