"""Checks in tables for the terminal and the page, in the lines under a figure's title, and in summary.json."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from compare.outcome import Outcome
from compare.report import Row, Section, Style, Table, sentences
from compare.verdict import Check, amount
from scenes.checks import DEVICE_TOLERANCES, OF_THE_REDUCTION
from scenes.formats import difference_text, percent
from scenes.result import Result

NOTE = (
    "A check differs or agrees only where that holds for every value that the difference may have given its numerical "
    "error; else it is unresolved."
)


def without_slopes(checks: Sequence[Check]) -> list[Check]:
    """Return the checks that are not of slopes, which have their own table."""
    return [check for check in checks if not check.id.startswith("slope_")]


def contrary(outcome: Outcome[Any]) -> list[Check]:
    """Return the checks that contradict the scene: a declared verdict, or a tolerance that the scene itself sets.

    With --strict every undeclared check is expected to agree, and "unresolved" is a contradiction. An equation that
    the chosen model does not use contradicts nothing.
    """
    strict, tolerances = outcome.options.strict, outcome.scene.tolerances

    def contradicts(check: Check) -> bool:
        if not check.own or (check.verdict == "unresolved" and not strict):
            return False
        if strict or check.expected is not None:
            return check.verdict != (check.expected or "agrees")
        declared = "slope" if check.id.startswith("slope_") else check.id
        return declared in tolerances and check.verdict == "differs"

    return [check for check in outcome.checks if contradicts(check)]


def counted(outcome: Outcome[Any], of: str = "") -> str:
    """Count the checks that differ, and compare with the declared verdicts; empty without checks."""
    counts = Counter(check.verdict for check in without_slopes(outcome.checks) if check.own)
    if not (total := counts.total()):
        return ""
    said = f"{of}{counts['differs']} of {total} checks differ"
    said += f", {counts['unresolved']} unresolved" if counts["unresolved"] else ""
    if against := contrary(outcome):
        return f"{said}; not as expected: {', '.join(check.id for check in against)}."
    return said + ", as the scene declares" * (outcome.scene.expected_to_differ is not None) + "."


def checked(outcome: Outcome[Any], style: Style) -> list[Section]:
    """Return the checks, first of one model against the other, and why they differ; on the page with all values."""
    checks = sorted(without_slopes(outcome.checks), key=lambda check: check.id not in OF_THE_REDUCTION)
    if not checks:
        return []
    against = {check.id for check in contrary(outcome) if check.expected not in (None, check.verdict)}
    declared = {c.id: f"the scene declares that it {c.expected} (checks.expect_differs)" for c in checks}
    reasons = {c.id: "; ".join(filter(None, (declared[c.id] * (c.id in against), c.because))) for c in checks}
    rows, short = [], all(len(check.id) < 20 for check in checks)
    others = ", ".join(check.id for check in checks if not check.own)
    others = f"Not counted, as the chosen model does not use them: {others}." * bool(others)
    for c in checks:
        off = off_by(c, style.plus_minus)
        if style.page:
            cells = [c.id, c.title, claimed(c, 5), amount(c.measured, c.unit, 5), off, c.relative_to]
        else:
            # Long ids leave no room for a title; the checks of probes have the names of the probes.
            cells = [c.id, c.title if short and not c.id.startswith(c.title.partition(",")[0]) else "", off]
        below = f"{reasons[c.id]}." if style.page and reasons[c.id] else ""
        rows.append(Row([*cells, percent(c.tolerance, 1), c.verdict], c.verdict, below))
    if style.page:
        whose = {sides(check) for check in checks}
        heads = ("check", "of", *(whose.pop() if len(whose) == 1 else ("claimed", "computed")))
        table = Table((*heads, "difference", "relative to", "tolerance", "verdict"), rows, "<<>>><><")
        return [Section("Checks", [NOTE, table, others])]
    table = Table(("check", "", "difference", "tolerance", ""), rows, "<<>><")
    said = [f"{check.id}: {reasons[check.id]}" for check in checks if check.own and reasons[check.id]]
    rises = any(reasons[c.id] and c.relative_to.endswith("3D rise") for c in checks)
    said += ["Temperatures are rises above the initial temperature"] * rises
    return [Section("Checks", [table, others], headed=False), Section("Why", sentences(said))]


def sides(check: Check) -> tuple[str, str]:
    """Name the predicted and the measured side of a check."""
    if check.id.startswith(("dev3d_claim", "dev3d_shielding")):
        return "paper", "3D"
    return ("paper", "1D") if check.id in DEVICE_TOLERANCES else ("1D", "3D")


def claimed(check: Check, digits: int = 4) -> str:
    """Write the predicted value: "100.0 ms", or "at least 50.70 ms" for a one-sided claim."""
    side = "" if check.sense == "equal" or not math.isfinite(check.predicted) else f"{check.sense} "
    return side + amount(check.predicted, check.unit, digits)


def off_by(check: Check, plus_minus: str = "\N{PLUS-MINUS SIGN}") -> str:
    """Write the difference with its error, or "open", "holds" or "fails"."""
    if not check.u_num < 1:
        return "open"
    if check.sense != "equal" and not check.difference:
        return "holds"
    return difference_text(check.difference, check.known_to, plus_minus) if math.isfinite(check.difference) else "fails"


def steady_document(result: Result, *details: str) -> dict[str, Any]:
    """Return steady values with their errors, and some of the details of a 3D result."""
    named = {"dofs" if name == "unknowns" else name: result.details.get(name) for name in details}
    return {"steady": {key: asdict(estimate) for key, estimate in result.steady.items()}, **named}


def checks_document(outcome: Outcome[Any]) -> list[dict[str, Any]]:
    """Return the checks without the uncertainties that they lack."""
    entries = [asdict(check) for check in outcome.checks]
    for entry in entries:
        entry["time_s"] = entry.pop("time")
        for name in ("u_input", "u_data", "time_s"):
            if entry[name] is None:
                del entry[name]
    return entries
