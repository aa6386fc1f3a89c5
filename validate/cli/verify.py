"""Verify the code: observed orders of convergence on manufactured solutions against theory, exact
solutions, published benchmarks, and a second code on the sink where it is installed.

examples:
  validate verify
  validate verify --only exact --only published
  validate verify --markdown docs/verification.md

exit status: 0 every row agrees or was skipped with a reason, 1 one differs or is unresolved, 2 bad input
"""

from __future__ import annotations

import argparse
from functools import partial

from validate.cli import common
from validate.cli.terminal import DIFFERS, FINE

_ONLY = "this family of cases only, as often as needed"
OPTIONS = {"--only {orders,exact,published,second} ...": _ONLY, **common.OF_A_TABLE}


def run(arguments: argparse.Namespace) -> int:
    from validate.verify.cases import CASES, run
    from validate.verify.report import TABLE

    families = arguments.only or [case.family for case in CASES]
    rows = common.table(arguments, TABLE, partial(run, families))
    return FINE if all(row.verdict in ("agrees", "skipped") for row in rows) else DIFFERS
