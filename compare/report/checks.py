"""Checks in tables for the terminal and the page, and under the titles of figures."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

from compare.report.table import Row, Section, Style, Table, sentences
from compare.verdict import Check
from scenes.checks import DEVICE_TOLERANCES, OF_THE_PAPER, OF_THE_REDUCTION
from scenes.formats import difference_text, percent, quantity

if TYPE_CHECKING:
    from compare.outcome import Outcome

NAMES = {
    "sink_K": ("sink temperature", "K"),
    "sensor_K": ("sensor temperature", "K"),
    "sink_V": ("sink voltage", "V"),
    "sensor_V": ("sensor voltage", "V"),
    "sink_power_W": ("sink power", "W"),
    "sensor_power_W": ("sensor power", "W"),
    "polymer_flux_W": ("heat into polymer", "W"),
}
"""Words and units of the device's quantities."""
_KINDS = {
    "slope": "how the models follow a key: 1D less 3D",
    "energy": "3D alone", "islands": "3D alone", "against": "your data less 3D",
}  # fmt: skip
"""What a check compares, by how its id begins."""
SHARED = 30
"""Characters of a clause from which on it is written once."""
_LONG = 20
"""Characters of an id from which on titles stand on a line of their own."""
_NOTE = (
    "A check differs or agrees only where that holds for every value that the difference may have given its numerical "
    "error; else it is unresolved."
)


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
    """Return the sink's checks by kind, and the reasons of the differences."""
    if style.page or not checks:
        return on_page(checks, contrary)
    below = any(len(check.id) >= _LONG for check in checks)

    def row(c: Check) -> Row:
        difference = difference_text(c.difference, c.known_to, style.plus_minus)
        cells = [c.id, "" if below else c.title, difference, percent(c.tolerance, 1), c.verdict]
        return Row(cells, c.verdict, c.title if below else "")

    table = Table(("check", "", "difference", "tolerance", ""), _by_kind(checks, row), "<<>><")
    reasons = {check.id: said for check in checks if check.own and (said := _said(check, contrary))}
    return [Section("Checks", [table], headed=False), Section("Why", [sentences(_once(reasons))])]


def of_device(checks: Sequence[Check], contrary: Sequence[Check], style: Style) -> list[Section]:
    """Return the device's checks, the paper against 1D and 1D against 3D, with their reasons."""
    if style.page or not checks:
        return on_page(checks, contrary)
    tables = []
    for whose, group in groupby(checks, sides):
        rows = [
            Row([c.id, c.title, claimed(c), amount(c.measured, c.unit), off_by(c), c.verdict], c.verdict) for c in group
        ]
        tables.append(Section("Checks", [Table(("check", "", *whose, "off by", ""), rows, "<<>>><")], headed=False))
    reasons = _once({check.id: _said(check, contrary) for check in checks})
    in_full = [_in_full(check, style.plus_minus) for check in checks]
    texts = [f"{reason}; {full}" for reason, full in zip(reasons, in_full, strict=True)]
    return [*tables, Section("Why", [sentences(texts)])]


def _once(reasons: Mapping[str, str]) -> list[str]:
    """Write a clause that several checks share once; the later checks name the first."""
    first: dict[str, str] = {}
    texts = []
    for name, reason in reasons.items():
        clauses, shared = reason.split("; "), list[str]()
        for clause in clauses:
            if len(clause) >= SHARED and first.setdefault(clause, name) != name:
                shared.append(first[clause])
        kept = [clause for clause in clauses if len(clause) < SHARED or first[clause] == name]
        kept += [f"as {' and '.join(dict.fromkeys(shared))}"] * bool(shared)
        texts.append(f"{name}: {'; '.join(kept)}")
    return texts


def on_page(checks: Sequence[Check], contrary: Sequence[Check]) -> list[Section]:
    """Return every check with its values and its reason."""
    if not checks:
        return []
    whose, relative = {sides(check) for check in checks}, any(check.relative_to for check in checks)

    def row(c: Check) -> Row:
        said, off = _said(c, contrary), off_by(c)
        sense = "" if c.sense == "equal" or not math.isfinite(c.predicted) else f"{c.sense} "
        off = off if off.isalpha() else difference_text(c.difference, c.known_to, "\N{PLUS-MINUS SIGN}")
        values = sense + amount(c.predicted, c.unit, 5), amount(c.measured, c.unit, 5), off
        cells = [c.id, c.title, *values, *[c.relative_to] * relative, percent(c.tolerance, 1), c.verdict]
        return Row(cells, c.verdict, f"{said}." if said else "")

    both = whose.pop() if len(whose) == 1 else ("claimed", "found")
    heads = ("check", "of", *both, "difference", *["relative to"] * relative, "tolerance", "verdict")
    return [Section("Checks", [_NOTE, Table(heads, _by_kind(checks, row), f"<<>>>{'<' * relative}><")])]


def _by_kind(checks: Sequence[Check], row: Callable[[Check], Row]) -> list[Row]:
    rows = []
    for kind, group in groupby(sorted(checks, key=lambda check: check.id not in OF_THE_REDUCTION), _kind_of):
        rows += [*[Row([kind])] * bool(kind), *map(row, group)]
    return rows


def _kind_of(check: Check) -> str:
    if check.id in OF_THE_REDUCTION:
        return "one model against the other: 1D less 3D"
    if check.id in OF_THE_PAPER:
        whose = "the paper's equations" if check.own else "the paper's equations (not this model's)"
        return f"{whose}: 3D numbers in, relative to 3D's own"
    return _KINDS.get(check.id.partition("_")[0], "")


def _said(check: Check, contrary: Sequence[Check]) -> str:
    declared = ""
    if check in contrary and check.expected is not None and check.verdict != check.expected:
        declared = f"the scene declares that it {check.expected} (checks.expect_differs)"
    return "; ".join(filter(None, (declared, check.because)))


def sides(check: Check) -> tuple[str, str]:
    """Name the predicted and the measured side of a check."""
    if check.id.startswith(("dev3d_claim", "dev3d_shielding", "dev3d_array")):
        return "paper", "3D"
    return ("paper", "1D") if check.id in DEVICE_TOLERANCES else ("1D", "3D")


def claimed(check: Check) -> str:
    """Write the predicted value: "100.0 ms", or ">=50.70 ms" for a one-sided claim."""
    side = {"equal": "", "at least": ">=", "at most": "<="}[check.sense] if math.isfinite(check.predicted) else ""
    return side + amount(check.predicted, check.unit)


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


def _reference(check: Check) -> str:
    """Write the value that a difference is relative to, where it is not the measured one."""
    apart = check.predicted - check.measured
    if not check.difference or not math.isfinite(apart) or not math.isfinite(check.difference):
        return ""
    scale = apart / check.difference
    return "" if math.isclose(scale, check.measured, rel_tol=1e-3) else amount(abs(scale), check.unit)


def _in_full(check: Check, plus_minus: str) -> str:
    tolerance = f"tolerance {percent(check.tolerance, 2)}"
    if off_by(check).isalpha():
        return tolerance
    off = difference_text(check.difference, check.u_num, plus_minus) if check.u_num else percent(check.difference, 4)
    if reference := check.relative_to or _reference(check):
        return f"{' less '.join(sides(check))} is {off} of {reference}, {tolerance}"
    return f"{'/'.join(sides(check))} - 1 = {off}, {tolerance}"


def with_mu(text: str) -> str:
    """Replace the "u" of micro by the letter mu."""
    return re.sub(r"(?<=[\d(] )u(?=[A-Zmos])|(?<=\()u(?=[A-Zmos])", "\N{MICRO SIGN}", text)


def judged(check: Check) -> str:
    """Return a check's id with its verdict, as a figure's title has it."""
    mark = {"agrees": "\N{CHECK MARK}", "differs": "\N{MULTIPLICATION X}", "unresolved": "?"}[check.verdict]
    return f"{mark} {check.id} {check.verdict.upper() if check.verdict == 'differs' else check.verdict}"


def drawn(check: Check) -> str:
    """Return a check as a line under a figure's title."""
    measured, off, (claimant, finder) = amount(check.measured, check.unit), off_by(check), sides(check)
    off = off if off.isalpha() else f"off by {off}"
    return with_mu(f"{judged(check)}: {check.title}, {claimant} {claimed(check)}, {finder} {measured} ({off})")
