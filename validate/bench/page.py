"""What was measured, part by part: as a page of markdown, and shorter on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from validate.bench import work
from validate.bench.entries import FREEFEM, GIVEN, NGSOLVE, OURS, REDUCTION, WHOLE
from validate.report.table import Row, Style, Table

Lines = list[str]
Entry = Mapping[str, Any]
SHORT = {WHOLE: "whole run", GIVEN: "mesh given"}
WORK = {"transient": "The whole transient of the sink", "steady": "The sink's steady state"}


@dataclass(frozen=True)
class Section:
    """A part: its title, what its numbers are, its tables, each with what is said before it, and what is said last."""

    title: str
    about: str
    tables: list[tuple[str, Table]]
    last: str = ""


def markdown(found: Mapping[str, Any], figures: Mapping[str, str]) -> str:
    """The page; ``figures`` are paths to those that were drawn, by part."""
    lines = ["# Run time against error", "", *_preface(found)]
    if WORK.keys() & found.keys():
        lines += WHAT_EACH_DOES
    for name in (*WORK, *SECTIONS):
        if name in found:
            lines += _work(name, found[name]) if name in WORK else _paragraphs(SECTIONS[name](found[name]))
            if name in figures:
                lines += [f"![{name}]({figures[name]})", ""]
    return "\n".join(lines).rstrip() + "\n"


def text(found: Mapping[str, Any]) -> str:
    """The parts that were measured, in tables of at most 80 columns."""
    lines: Lines = []
    for name in (*WORK, *SECTIONS):
        if name in found:
            lines += _work_in_short(WORK[name], found[name]) if name in WORK else _in_short(SECTIONS[name](found[name]))
            lines.append("")
    return "\n".join(lines).rstrip()


def _paragraphs(section: Section) -> Lines:
    lines = [f"## {section.title}", "", section.about, ""]
    for before, table in section.tables:
        lines += [*([before, ""] if before else []), *table.markdown()]
    return [*lines, *([section.last, ""] if section.last else [])]


def _in_short(section: Section) -> Lines:
    lines = [section.title]
    for _, table in section.tables[:1]:
        lines.append(table.text(Style()))
    return [*lines, *([section.last] if section.last else [])]


def _table(
    heads: Sequence[str], found: Sequence[Entry], name: Callable[[Entry], str], cells: Callable[[Entry], Sequence[str]]
) -> Table:
    """A row for each of what was found: its name, then its cells or, below it, why it failed."""
    failed = [Row([name(entry)], below=entry["failure"]) for entry in found if entry["failure"]]
    return Table(heads, [*((name(entry), *cells(entry)) for entry in found if not entry["failure"]), *failed])


def _preface(found: Mapping[str, Any]) -> Lines:
    machine = found["machine"]
    absent = [tool for tool, key in ((NGSOLVE, "ngsolve"), (FREEFEM, FREEFEM)) if machine[key] == "not installed"]
    lines = [
        f"Made by `validate bench{' --quick' if found['quick'] else ''}`. Scene: the default sink at 1 V. Each entry "
        "runs in processes of its own, in turns with the others. A time is the median over them, in seconds of "
        "processor time of one thread, which other work on the machine disturbs less than the clock on the wall. "
        "Start-up (interpreter and imports; on the wall) is not in it and has a column of its own. The first solve of "
        "a process warms up and does not count where it takes less than a second on the wall.",
        "",
        *Table(("", ""), list(machine.items())).markdown(),
    ]
    if absent:
        lines += [f"Not installed here, so not compared: {' and '.join(absent)}.", ""]
    return lines


WHAT_EACH_DOES = (
    "## What each entry has to do, and has not",
    "",
    f"- *{WHOLE}* gets the scene and an accuracy. It finds the mesh, estimates the error of every number at each level "
    "from nested spaces of lower degrees, and writes traces between whose rows lines may be drawn.",
    f"- *{GIVEN}* gets what the other programs get: the cells, one degree in x and y and one in z, and settings of "
    "the iterations and of the time integration that were found by trial beforehand. It seeks no mesh and estimates "
    "no error: that is known here only from the reference.",
    "- NGSolve, FreeFEM and scikit-fem get the same cells (FreeFEM each cut into six tetrahedra), and their settings "
    "were found by trial in the same way. NGSolve may have another order in z too; FreeFEM and scikit-fem have none "
    "but one order for all directions, and end at order 3 and 2.",
    "- All solve the same quarter of the sink. Where the mesh is given, so is the quarter: no time includes finding "
    "the symmetry, or making the mesh in the program's own form. Whole runs find the symmetry too.",
    "- Whole runs of this toolkit always solve the electric problem, at the initial temperature and at the hot state, "
    "and find there that they need not follow the change of the current's pattern any further. Others with a \"full "
    'electric problem" solve it anew in every iteration. "Uniform current" takes for granted that the current density '
    "does not vary, which only this scene's ideal electrodes allow: those entries solve no electric problem at all.",
    "- No repeated solve finds what an earlier one has worked out on the scene or the mesh; tables of reference "
    "elements are kept.",
    "",
)


def _work(name: str, part: Mapping[str, Any]) -> Lines:
    """Times beside errors: the fastest at each error, and all entries."""
    reference, rows = part["reference"], part["rows"]
    known = reference["uncertainty"]
    what = (
        "the largest difference over time (octaves from 10 us to 20 ms) of the rises of peak, end and mean, relative "
        "to their final values, and of the current, relative to itself"
        if name == "transient"
        else "the largest relative difference of the rises of peak, end and mean and of the current"
    )
    doubt = (
        f"its uncertainty is taken as its distance from {reference['checked_by']}: {known:.1e}"
        if known is not None
        else "no other program is installed to check it, so it says little of this toolkit's own errors"
    )
    lines = [
        f"## {WORK[name]}", "", f"Error: {what}. Reference: {reference['made_by']}, which is no entry; {doubt}.", "",
    ]  # fmt: skip
    if part["targets"]:
        tools = work.taking_part(rows)
        fastest = Table(("error", *tools), [_fastest(at, tools) for at in part["targets"]])
        lines += ["The fastest entry of each at an error no larger than:", "", *fastest.markdown()]
    whole = [row for row in rows if row["tool"] == WHOLE and not row["failure"]]
    each = "; ".join(f"{r['label']}: {r['claimed']:.1e}, {r['error']:.1e}" for r in whole)
    lines += [f"What whole runs were asked for, estimated and had: {each}.", ""] if whole else []
    head = ("entry", "unknowns", "steps", "error", "time, s", "least to most (solves)", "start-up, s", "peak MB")
    return [*lines, *_table(head, rows, _named, _entry).markdown()]


def _fastest(at: Mapping[str, Any], tools: Sequence[str]) -> tuple[str, ...]:
    fastest = at["fastest"]
    own = {kind: fastest[kind] for kind in OURS}
    ours = ("does not get there" if best is None else f"{best['median_s']:.3g} s" for best in own.values())
    return f"{at['target'] * 100:g} %", *ours, *(work.verdict(fastest[peer], own) for peer in tools[len(OURS) :])


def _named(row: Mapping[str, Any]) -> str:
    return f"{row['tool']}: {row['label']}"


def _entry(row: Mapping[str, Any]) -> tuple[str, ...]:
    spread = f"{row['fastest_s']:.3g} to {row['slowest_s']:.3g} ({row['solves']})"
    return (
        str(row["unknowns"]), str(row["steps"] or ""), f"{row['error']:.1e}", f"{row['median_s']:.3g}", spread,
        f"{row['start_up_s']:.2g}", f"{row['peak_MB']:.0f}",
    )  # fmt: skip


def _work_in_short(title: str, part: Mapping[str, Any]) -> Lines:
    rows = part["rows"]
    tools = work.taking_part(rows)
    times: list[Row | Sequence[str]] = [
        (f"{at['target'] * 100:g} %",
         *("-" if at["fastest"][tool] is None else f"{at['fastest'][tool]['median_s']:.3g}" for tool in tools))
        for at in part["targets"]
    ]  # fmt: skip
    times += [Row([_named(row)], below=row["failure"]) for row in rows if row["failure"]]
    lines = [
        f"{title}: seconds of the fastest whose error is at most",
        Table(("", *(SHORT.get(tool, tool) for tool in tools)), times).text(Style()),
        "Processor time; a dash: none is as accurate. The first two are this toolkit's.",
    ]
    models = [
        (row["label"], f"{row['error']:.1e}", f"{row['median_s']:.3g}")
        for row in rows
        if row["tool"] == REDUCTION and not row["failure"]
    ]
    return [*lines, "", Table(("1D model", "error", "time, s"), models).text(Style())] if models else lines


def _device(part: Mapping[str, Any]) -> Section:
    doubt = part["uncertainty"]
    checked = "" if doubt is None else (
        f" The paper's scheme, extrapolated from its two finest grids at first order in space, stays within "
        f"{doubt[0]:.1e} of it over time, and within {doubt[1]:.1e} at the end, in the steady state that controllers "
        "hold: early on, its differences at the faces of layers that are still cold converge more slowly."
    )  # fmt: skip
    table = _table(
        ("entry", "over time", "at the end", "time, s"), part["rows"], _named,
        lambda r: (f"{r['error']:.1e}", f"{r['error_at_end']:.1e}", f"{r['median_s']:.3g}"),
    )  # fmt: skip
    about = (
        f"From cold to {part['end_time_s'] * 1e3:g} ms. Error: the largest of sink and sensor, over time and at the "
        "end, relative to the set rise. Reference: the accurate scheme at an accuracy of 1e-08, so it is judged by "
        f"itself.{checked}"
    )
    return Section("The whole sensor in 1D", about, [("", table)])


def _growth(part: Mapping[str, Any]) -> Section:
    phases = ("assembly", "factorization", "one solve")
    table = _table(
        ("path", "unknowns", *phases, "MB"), part["rows"], lambda r: r["path"],
        lambda r: (str(r["unknowns"]), *(f"{r['phases'][p]:.2g}" for p in phases), f"{r['own_MB']:.0f}"),
    )  # fmt: skip
    slopes = Table(("path", *phases, "memory", "rises fastest", "takes most at the largest"), [
        (e["path"], *(f"{e['exponents'][p]:.2f}" for p in (*phases, "memory")), e["rises"], e["largest"])
        for e in part["exponents"]
    ])  # fmt: skip
    about = (
        "The heat problem of the quarter on cells cut further and further, seconds by phase (the mesh is given), and "
        "the memory above that of the imports."
    )
    said = "Exponents: slopes of log time, and of log memory, over log unknowns, from 4,000 on."
    return Section("Growth with the unknowns", about, [("", table), *([(said, slopes)] if slopes.rows else [])])


def _skips(part: Sequence[Mapping[str, Any]]) -> Section:
    table = _table(
        ("skipped", "with, s", "without, s", "ratio"), part, lambda r: r["skip"],
        lambda r: (f"{r['on_s']:.3g}", f"{r['off_s']:.3g}", f"{r['off_s'] / r['on_s']:.2f}"),
    )  # fmt: skip
    about = (
        "The same run in turns with the skip and without it. Solver: seconds of processor time after imports; whole "
        "commands: on the wall. Without the transient, the figures, the fields and the 3D model less is reported; the "
        "other skips leave the answer within its estimated error."
    )
    return Section("What each skip of the plan saves", about, [("", table)])


def _start_up(part: Mapping[str, Any]) -> Section:
    table = Table(("ratio", "median", "least to most"), [
        (r["name"], f"{r['median']:.2f}", f"{r['smallest']:.2f} to {r['largest']:.2f}") for r in part["ratios"]
    ])  # fmt: skip
    about = "Ratios of wall-clock times, each pair of processes one after the other."
    last = f"Largest memory of the cold run without figures: {part['peak_MB']:.0f} MB."
    return Section("Start-up", about, [("", table)], last)


SECTIONS: dict[str, Callable[[Any], Section]] = {
    "device": _device,
    "growth": _growth,
    "skips": _skips,
    "start-up": _start_up,
}
