"""Checks in tables for the terminal and the page, and under the titles of figures."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from typing import Any

from compare.outcome import Outcome
from compare.report.table import Row, Section, Style, Table, sentences
from compare.verdict import Check
from scenes.checks import DEVICE_TOLERANCES, OF_THE_PAPER, OF_THE_REDUCTION
from scenes.formats import difference_text, percent, quantity

LONG = 20
"""Characters of an id from which on titles stand on a line of their own."""
NOTE = (
    "A check differs or agrees only where that holds for every value that the difference may have given its numerical "
    "error; else it is unresolved."
)
KINDS = {
    "energy": "3D alone", "islands": "3D alone", "against": "your data less 3D", "dev3d": "in 3D",
    **dict.fromkeys(("fig9", "fig10", "fig11", "fig12", "fig13", "meter"), "the paper's claims, in 1D"),
}  # fmt: skip
"""What a check compares, by how its id begins."""


def without_slopes(checks: Sequence[Check]) -> list[Check]:
    """Return the checks that are not of slopes, which have their own table."""
    return [check for check in checks if not check.id.startswith("slope_")]


def counted(name: str, outcome: Outcome[Any], contrary: Sequence[Check]) -> str:
    """Count the checks that differ, and compare with the declared verdicts; empty without checks."""
    counts = Counter(check.verdict for check in without_slopes(outcome.checks) if check.own)
    if not (total := counts.total()):
        return ""
    differ = f"{counts['differs']} of {total} checks {'differs' if counts['differs'] == 1 else 'differ'}"
    differ = "its one check differs" if counts["differs"] == total == 1 else differ
    agree = f"all {total} checks agree" if total > 1 else "its one check agrees"
    said = f"{name}: {differ if counts['agrees'] < total else agree}"
    said += f", {counts['unresolved']} unresolved" if counts["unresolved"] else ""
    if contrary:
        return f"{said}; not as expected: {', '.join(check.id for check in contrary)}."
    if outcome.scene.expected_to_differ is None:
        return f"{said}; nothing was declared of this scene beforehand."
    if counts["unresolved"]:
        return f"{said}; the others are as the scene declares."
    return f"{said}, as the scene declares: all were known."


def sections(checks: Sequence[Check], contrary: Sequence[Check], style: Style) -> list[Section]:
    """Return the checks by kind, and the reasons of the differences; on the page with all values."""
    checks = without_slopes(checks)
    if not checks:
        return []
    reasons = {check.id: _reason(check, contrary) for check in checks}
    whose = {sides(check) for check in checks}
    below = not style.page and any(len(check.id) >= LONG for check in checks)

    def row(c: Check) -> Row:
        off = off_by(c)
        off = off if off.isalpha() else difference_text(c.difference, c.known_to, style.plus_minus)
        if not style.page:
            cells = [c.id, "" if below else c.title, off, percent(c.tolerance, 1), c.verdict]
            repeats = c.id.startswith(c.title.partition(",")[0])  # as of a probe
            return Row(cells, c.verdict, c.title if below and not repeats else "")
        values = claimed(c, 5), amount(c.measured, c.unit, 5), off, c.relative_to
        said = f"{reasons[c.id]}." if reasons[c.id] else ""
        return Row([c.id, c.title, *values, percent(c.tolerance, 1), c.verdict], c.verdict, said)

    rows = []
    for kind, group in groupby(sorted(checks, key=lambda check: check.id not in OF_THE_REDUCTION), _kind_of):
        rows += [*[Row([kind])] * bool(kind), *map(row, group)]
    if style.page:
        both = whose.pop() if len(whose) == 1 else ("claimed", "computed")
        heads = ("check", "of", *both, "difference", "relative to", "tolerance", "verdict")
        return [Section("Checks", [NOTE, Table(heads, rows, "<<>>><><")])]
    table = Table(("check", "", "difference", "tolerance", ""), rows, "<<>><")
    said = [f"{check.id}: {reasons[check.id]}" for check in checks if check.own and reasons[check.id]]
    return [Section("Checks", [table], headed=False), Section("Why", [sentences(said)])]


def _kind_of(check: Check) -> str:
    if check.id in OF_THE_REDUCTION:
        return "one model against the other: 1D less 3D"
    if check.id in OF_THE_PAPER:
        whose = "the paper's equations" if check.own else "the paper's equations (not this model's)"
        return f"{whose}: 3D numbers in, relative to 3D's own"
    return KINDS.get(check.id.partition("_")[0], "")


def _reason(check: Check, contrary: Sequence[Check]) -> str:
    declared = ""
    if check in contrary and check.expected is not None and check.verdict != check.expected:
        declared = f"the scene declares that it {check.expected} (checks.expect_differs)"
    return "; ".join(filter(None, (declared, check.because)))


def sides(check: Check) -> tuple[str, str]:
    """Name the predicted and the measured side of a check."""
    if check.id.startswith(("dev3d_claim", "dev3d_shielding")):
        return "paper", "3D"
    return ("paper", "1D") if check.id in DEVICE_TOLERANCES else ("1D", "3D")


def claimed(check: Check, digits: int = 4) -> str:
    """Write the predicted value: "100.0 ms", or "at least 50.70 ms" for a one-sided claim."""
    side = "" if check.sense == "equal" or not math.isfinite(check.predicted) else f"{check.sense} "
    return side + amount(check.predicted, check.unit, digits)


def amount(value: float, unit: str, digits: int = 4) -> str:
    """Write a check's value: "50.70 ms"; "never" for an infinite time, "none" for other values that are not finite."""
    if math.isfinite(value):
        return quantity(value, "" if unit == "1" else unit, digits)
    return "never" if unit == "s" else "none"


def off_by(check: Check) -> str:
    """Write the difference briefly: "+97 %", or "<1e-08 %" within its error."""
    if not check.u_num < 1:
        return "open"
    if check.sense != "equal" and not check.difference:
        return "holds"
    if not math.isfinite(check.difference):
        return "fails"
    if abs(check.difference) <= check.u_num:
        return f"<{percent(check.u_num, 1)}" if check.u_num else "0 %"
    return percent(check.difference, sign=True)


def with_mu(text: str) -> str:
    """Replace the "u" of micro by the letter mu."""
    return re.sub(r"(?<=[\d(] )u(?=[A-Zmos])|(?<=\()u(?=[A-Zmos])", "\N{MICRO SIGN}", text)


def drawn(check: Check) -> str:
    """Return a check as a line under a figure's title."""
    mark = {"agrees": "\N{CHECK MARK}", "differs": "\N{MULTIPLICATION X}", "unresolved": "?"}[check.verdict]
    verdict = check.verdict.upper() if check.verdict == "differs" else check.verdict
    measured, off, (claimant, finder) = amount(check.measured, check.unit), off_by(check), sides(check)
    off = off if off.isalpha() else f"off by {off}"
    said = f"{check.title}, {claimant} {claimed(check)}, {finder} {measured} ({off})"
    return with_mu(f"{mark} {check.id} {verdict}: {said}")
