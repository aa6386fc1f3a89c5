"""The section of the page on one kind of work: the steady state, or the transient."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from validate.bench import frontier
from validate.bench.entries import GIVEN, OURS, WHOLE
from validate.bench.markdown import Lines, table


def section(title: str, part: Mapping[str, Any], transient: bool) -> Lines:
    """Times beside errors: the fastest at each error, what each entry does, and all entries."""
    reference, rows = part["reference"], part["rows"]
    known = reference["uncertainty"]
    what = (
        "the largest difference over time (octaves from 10 us to 20 ms) of the rises of peak, end and mean, relative "
        "to their final values, and of the current, relative to itself"
        if transient
        else "the largest relative difference of the rises of peak, end and mean and of the current"
    )
    doubt = (
        f"its uncertainty is taken as its distance from {reference['checked_by']}: {known:.1e}"
        if known is not None
        else "no other program is installed to check it, so it says little of this toolkit's own errors"
    )
    lines = [f"## {title}", "", f"Error: {what}. Reference: {reference['made_by']}, which is no entry; {doubt}.", ""]
    if part["targets"]:
        lines += [
            "The fastest entry of each at an error no larger than:",
            "",
            *_targets(part["targets"], frontier.taking_part(rows)),
        ]
    lines += _claims(rows)
    head = (
        "entry",
        "settings",
        "unknowns",
        "steps",
        "error",
        "time, s",
        "least to most (solves)",
        "start-up, s",
        "peak MB",
    )
    body = [_entry(row) for row in rows]
    return [*lines, *table(head, body)]


WHAT_EACH_DOES = (
    "## What each entry has to do, and has not",
    "",
    f"- *{WHOLE}* gets the scene and an accuracy. It finds the mesh, solves on four meshes at each level to estimate "
    "the error of every number, and writes traces between whose rows lines may be drawn.",
    f"- *{GIVEN}* gets what the other programs get: the cells, one degree in x and y and one in z, and settings of "
    "the iterations and of the time integration that were found by trial beforehand. It seeks no mesh and estimates "
    "no error: that is known here only from the reference.",
    "- NGSolve, FreeFEM and scikit-fem get the same cells (FreeFEM each cut into six tetrahedra), and their settings "
    "were found by trial in the same way. NGSolve may have another order in z too; FreeFEM and scikit-fem have none "
    "but one order for all directions, and end at order 3 and 2.",
    "- All solve the same quarter of the sink. Where the mesh is given, so is the quarter: no time includes finding "
    "the symmetry, or making the mesh in the program's own form. Whole runs find the symmetry too.",
    "- This toolkit always solves the electric problem, at the initial temperature and at the hot state, and finds "
    "there that it need not follow the change of the current's pattern any further. Others with a \"full electric "
    'problem" solve it anew in every iteration. "Uniform current" takes for granted that the current density does not '
    "vary, which only this scene's ideal electrodes allow: those entries solve no electric problem at all.",
    "- No repeated solve finds what an earlier one has worked out on the scene or the mesh; tables of reference "
    "elements are kept.",
    "",
)


def _claims(rows: Sequence[Mapping[str, Any]]) -> Lines:
    whole = [row for row in rows if row["tool"] == WHOLE and not row["failure"]]
    each = "; ".join(f"{r['label']}: {r['claimed']:.1e}, {r['error']:.1e}" for r in whole)
    return [f"What whole runs were asked for, estimated and had: {each}.", ""] if whole else []


def _targets(targets: Sequence[Mapping[str, Any]], tools: Sequence[str]) -> Lines:
    body = []
    for at in targets:
        fastest = at["fastest"]
        own = {kind: fastest[kind] for kind in OURS}
        ours = ("does not get there" if best is None else f"{best['median_s']:.3g} s" for best in own.values())
        peers = (frontier.verdict(fastest[peer], own) for peer in tools[len(OURS) :])
        body.append((f"{at['target'] * 100:g} %", *ours, *peers))
    return table(("error", *tools), body)


def _entry(row: Mapping[str, Any]) -> tuple[str, ...]:
    if row["failure"]:
        return (row["tool"], row["label"], "", "", row["failure"], "", "", "", "")
    spread = f"{row['fastest_s']:.3g} to {row['slowest_s']:.3g} ({row['solves']})"
    return (
        row["tool"], row["label"], str(row["unknowns"]), str(row["steps"] or ""), f"{row['error']:.1e}",
        f"{row['median_s']:.3g}", spread, f"{row['start_up_s']:.2g}", f"{row['peak_MB']:.0f}",
    )  # fmt: skip
