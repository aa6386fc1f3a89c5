"""`validate verify`: the code against theory, exact solutions, published benchmarks and a second code."""

from __future__ import annotations

import argparse

from validate.cli import common
from validate.cli.terminal import DIFFERS, FINE, Progress

_FAMILIES = ("orders", "exact", "published", "second")


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.description = (
        "Verify the code: observed orders of convergence on manufactured solutions against theory, exact\n"
        "solutions, published benchmarks, and a second code on the sink where it is installed."
    )
    parser.epilog = (
        "examples:\n"
        "  validate verify\n"
        "  validate verify --only exact --only published\n"
        "  validate verify --markdown docs/verification.md\n\n"
        "exit status: 0 every row agrees or was skipped with a reason, 1 one differs or is unresolved, 2 bad input"
    )
    parser.add_argument("--only", action="append", default=[], choices=_FAMILIES,
                        help="this family of cases only, as often as needed")  # fmt: skip
    common.shared(parser, common.OF_A_TABLE)


def run(arguments: argparse.Namespace) -> int:
    """Runs the cases and reports."""
    import time

    from validate.verify import report
    from validate.verify.cases import run

    started = time.perf_counter()
    with Progress() as progress:
        rows = run(arguments.only or _FAMILIES, common.jobs(arguments.jobs), progress)
    common.show_rows(arguments, report, rows, time.perf_counter() - started, report.markdown)
    return FINE if all(row.verdict in ("agrees", "skipped") for row in rows) else DIFFERS
