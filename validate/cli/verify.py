"""Verify the code: observed orders of convergence on manufactured solutions against theory, exact
solutions, published benchmarks, and a second path.

examples:
  validate verify
  validate verify --only exact --only published
  validate verify --markdown docs/verification.md

exit status: 0 every row agrees, 1 one differs or is unresolved, 2 bad input
"""

from __future__ import annotations

import argparse
from functools import partial

from validate.cli import common
from validate.cli.terminal import DIFFERS, FINE

_ONLY = "this family of cases only, as often as needed"
OPTIONS = {"--only {orders,exact,published,second} ...": _ONLY, **common.OF_A_TABLE}
ABOUT = """\
The table of one run of `validate verify`, which wrote this page. *Within* is the error bound that the solver states for
the number that it found, plus the error of the expected value (the rounding of a printed number, straight lines in
place of a sine). A row agrees where the difference is within that bound and the bound is as small as required.
Temperatures are in kelvin. Of a quantity with several values the row has the one that is furthest off.

Manufactured solutions: a smooth field is chosen, and loads in the interior and on the faces are computed so that it is
the exact solution on the brick elements of the solver. The second path is Newton's method on scikit-fem's own
hexahedra. L2 and H1 are norms of the error of the whole field.
"""


def run(arguments: argparse.Namespace) -> int:
    from validate.verify.cases import CASES, run

    families = arguments.only or [case.family for case in CASES]
    rows = common.table(arguments, "Code verification", ABOUT, partial(run, families))
    return FINE if all(row.verdict == "agrees" for row in rows) else DIFFERS
