"""`validate verify`: the code against theory, exact solutions, published benchmarks and a second code."""

from __future__ import annotations

import argparse

from validate.cli.terminal import DIFFERS, FINE, Progress, show, style

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
    add = parser.add_argument
    add("--only", action="append", default=[], choices=_FAMILIES, help="this family of cases only, as often as needed")
    add("--jobs", metavar="N", help="processes at once (default: one a processor)")
    add("--markdown", metavar="FILE", help="write the table as a page of the documentation too")
    add("--quiet", action="store_true", help="print the outcome only, one line")
    add("--json", action="store_true", help="print the table as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Runs the cases and reports."""
    import json
    import time

    from validate.cli.common import jobs, write_page
    from validate.report.summary import provenance
    from validate.verify import report
    from validate.verify.cases import run

    started = time.perf_counter()
    with Progress() as progress:
        rows = run(arguments.only or _FAMILIES, jobs(arguments.jobs), progress)
    seconds = time.perf_counter() - started
    if arguments.markdown is not None:
        write_page(arguments.markdown, report.markdown(rows, provenance()))
    if arguments.json:
        show(json.dumps(report.document(rows, provenance(), seconds), indent=1, allow_nan=False))
    elif arguments.quiet:
        show(report.headline(rows))
    else:
        show(f"{report.text(rows, style())}\n\n{seconds:.0f} s")
    return FINE if all(row.verdict in ("agrees", "skipped") for row in rows) else DIFFERS
