"""What was measured, part by part: as a page of markdown, and shorter on a terminal; and work-precision plots, time
over error, both logarithmic, one line a tool, a mark for each reduction."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

from compare.report.table import Row, Section, Style, Table
from validate.bench import work
from validate.bench.entries import GIVEN, NGSOLVE, OURS, REDUCTION, SCIKIT_FEM, WHOLE

Lines = list[str]
Entry = Mapping[str, Any]
Parts = list[str | Table]  # of a page
SHORT = {WHOLE: "whole run", GIVEN: "mesh given"}
WORK = {"transient": "The whole transient of the sink", "steady": "The sink's steady state"}
LOOKS = {
    WHOLE: ("#8b1a1a", "o"), GIVEN: ("#d1495b", "P"), NGSOLVE: ("#3a86c8", "s"),
    SCIKIT_FEM: ("#f0a030", "D"),
}  # fmt: skip
HOLLOW = "x+sDov"  # marks of reductions


def markdown(measurements: Mapping[str, Any], figures: Mapping[str, str]) -> str:
    """The page; ``figures`` are paths to those that were drawn, by part."""
    lines = ["# Run time against error", "", *_lines(_preface(measurements))]
    if WORK.keys() & measurements.keys():
        lines += WHAT_EACH_DOES
    for name, (title, parts, _) in SECTIONS.items():
        if name in measurements:
            lines += [f"## {title}", "", *_lines(parts(name, measurements[name]))]
            if name in figures:
                lines += [f"![{name}]({figures[name]})", ""]
    return "\n".join(lines).rstrip() + "\n"


def text(measurements: Mapping[str, Any]) -> str:
    """The parts that were measured, in tables of at most 80 columns."""
    shown = []
    for name, (title, parts, short) in SECTIONS.items():
        if name in measurements and short is not None:
            shown.append(Section(*short(title, measurements[name])).text(Style()))
        elif name in measurements:
            made = parts(name, measurements[name])
            shown.append(Section(title, [next(p for p in made if isinstance(p, Table))]).text(Style()))
    return "\n\n".join(shown)


def _lines(parts: Parts) -> Lines:
    return [line for part in parts for line in (part.markdown() if isinstance(part, Table) else [part, ""])]


def _table(
    heads: Sequence[str],
    entries: Sequence[Entry],
    name: Callable[[Entry], str],
    cells: Callable[[Entry], Sequence[str]],
) -> Table:
    """A row for each of what was found: its name, then its cells or, below it, why it failed."""
    failed = [Row([name(entry)], below=entry["failure"]) for entry in entries if entry["failure"]]
    return Table(heads, [*((name(entry), *cells(entry)) for entry in entries if not entry["failure"]), *failed])


def _preface(measurements: Mapping[str, Any]) -> Parts:
    machine = measurements["machine"]
    parts: Parts = [
        f"Made by `validate bench{' --quick' if measurements['quick'] else ''}`. Scene: the default sink at 1 V. Each "
        "entry runs in processes of its own, in turns with the others. A time is the median over them, in seconds of "
        "processor time of one thread, which other work on the machine disturbs less than the clock on the wall. "
        "Start-up (interpreter and imports; on the wall) is not in it and has a column of its own. The first solve of "
        "a process warms up and does not count where it takes less than a second on the wall.",
        Table(("", ""), list(machine.items())),
    ]
    return parts + (
        [f"Not installed here, so not compared: {NGSOLVE}."] if machine["ngsolve"] == "not installed" else []
    )


WHAT_EACH_DOES = (
    "## What each entry has to do, and has not",
    "",
    f"- *{WHOLE}* gets the scene and an accuracy. It finds the mesh, estimates the error of every number at each level "
    "from nested spaces of lower degrees, and writes traces between whose rows lines may be drawn.",
    f"- *{GIVEN}* gets what the other programs get: the cells, one degree in x and y and one in z, and settings of "
    "the iterations and of the time integration that were found by trial beforehand. It seeks no mesh and estimates "
    "no error: that is known here only from the reference.",
    "- NGSolve and scikit-fem get the same cells, and their settings were found by trial in the same way. NGSolve may "
    "have another order in z too; scikit-fem has one order for all directions, and ends at order 2.",
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


def _work(name: str, part: Mapping[str, Any]) -> Parts:
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
    parts: Parts = [f"Error: {what}. Reference: {reference['made_by']}, which is no entry; {doubt}."]
    if part["targets"]:
        tools = work.taking_part(rows)
        fastest = Table(("error", *tools), [_fastest(at, tools) for at in part["targets"]])
        parts += ["The fastest entry of each at an error no larger than:", fastest]
    if whole := work.beside_given(rows):
        parts += [
            "Whole runs: the error that was estimated and the one they had, and how many times as long they take as a "
            "solve on a given mesh with the same error (between entries that solve the electric problem too; at most "
            "as many times where none is as accurate):",
            Table(("", "estimated", "error", "time, s", "times as long as mesh given"), [_whole(*w) for w in whole]),
        ]
    head = ("entry", "unknowns", "steps", "error", "time, s", "least to most (solves)", "start-up, s", "peak MB")
    return [*parts, _table(head, rows, _named, _entry)]


def _fastest(at: Mapping[str, Any], tools: Sequence[str]) -> tuple[str, ...]:
    fastest = at["fastest"]
    by_kind = {kind: fastest[kind] for kind in OURS}
    ours = ("does not get there" if best is None else f"{best['median_s']:.3g} s" for best in by_kind.values())
    return f"{at['target'] * 100:g} %", *ours, *(work.verdict(fastest[peer], by_kind) for peer in tools[len(OURS) :])


def _whole(row: Mapping[str, Any], times: float, bound: bool) -> tuple[str, ...]:
    beside = f"{'at most ' * bound}{times:.1f}"
    return row["label"], f"{row['claimed']:.1e}", f"{row['error']:.1e}", f"{row['median_s']:.3g}", beside


def _named(row: Mapping[str, Any]) -> str:
    return f"{row['tool']}: {row['label']}"


def _entry(row: Mapping[str, Any]) -> tuple[str, ...]:
    spread = f"{row['fastest_s']:.3g} to {row['slowest_s']:.3g} ({row['solves']})"
    return (
        str(row["unknowns"]), str(row["steps"] or ""), f"{row['error']:.1e}", f"{row['median_s']:.3g}", spread,
        f"{row['start_up_s']:.2g}", f"{row['peak_MB']:.0f}",
    )  # fmt: skip


def _work_in_short(title: str, part: Mapping[str, Any]) -> tuple[str, Parts]:
    rows = part["rows"]
    tools = work.taking_part(rows)
    times: list[Row | Sequence[str]] = [
        (f"{at['target'] * 100:g} %",
         *("-" if at["fastest"][tool] is None else f"{at['fastest'][tool]['median_s']:.3g}" for tool in tools))
        for at in part["targets"]
    ]  # fmt: skip
    times += [Row([_named(row)], below=row["failure"]) for row in rows if row["failure"]]
    models = [row for row in rows if row["tool"] == REDUCTION and not row["failure"]]
    numbers = [(row["label"], f"{row['error']:.1e}", f"{row['median_s']:.3g}") for row in models]
    parts: Parts = [
        Table(("", *(SHORT.get(tool, tool) for tool in tools)), times),
        "Processor time; a dash: none is as accurate. The first two are this toolkit's.",
    ]
    parts += [Table(("1D model", "error", "time, s"), numbers)] if models else []
    return f"{title}: seconds of the fastest whose error is at most", parts


def _device(_: str, part: Mapping[str, Any]) -> Parts:
    doubt = part["uncertainty"]
    checked = "" if doubt is None else (
        f" The paper's scheme, extrapolated from its two finest grids at first order in space, stays within "
        f"{doubt[0]:.1e} of it over time, and within {doubt[1]:.1e} at the end, in the steady state that controllers "
        "hold: early on, its differences at the faces of layers that are still cold converge more slowly."
    )  # fmt: skip
    about = (
        f"From cold to {part['end_time_s'] * 1e3:g} ms. Error: the largest of sink and sensor, over time and at the "
        "end, relative to the set rise. Reference: the accurate scheme at an accuracy of 1e-08, so it is judged by "
        f"itself.{checked}"
    )
    return [about, _table(
        ("entry", "over time", "at the end", "time, s"), part["rows"], _named,
        lambda r: (f"{r['error']:.1e}", f"{r['error_at_end']:.1e}", f"{r['median_s']:.3g}"),
    )]  # fmt: skip


def _growth(_: str, part: Mapping[str, Any]) -> Parts:
    phases = ("assembly", "factorization", "one solve")
    about = (
        "The heat problem of the quarter on cells cut further and further, seconds by phase (the mesh is given), and "
        "the memory above that of the imports."
    )
    parts: Parts = [about, _table(
        ("path", "unknowns", *phases, "MB"), part["rows"], lambda r: r["path"],
        lambda r: (str(r["unknowns"]), *(f"{r['phases'][p]:.2g}" for p in phases), f"{r['own_MB']:.0f}"),
    )]  # fmt: skip
    if part["exponents"]:
        parts += ["Exponents: slopes of log time, and of log memory, over log unknowns, from 4,000 on.", Table(
            ("path", *phases, "memory", "rises fastest", "takes most at the largest"),
            [(e["path"], *(f"{e['exponents'][p]:.2f}" for p in (*phases, "memory")), e["rises"], e["largest"])
             for e in part["exponents"]],
        )]  # fmt: skip
    return parts


def _skips(_: str, part: Sequence[Mapping[str, Any]]) -> Parts:
    about = (
        "The same run in turns with the skip and without it. Solver: seconds of processor time after imports; whole "
        "commands: on the wall. Without the transient, the figures, the fields and the 3D model less is reported; the "
        "other skips leave the answer within its estimated error."
    )
    return [about, _table(
        ("skipped", "with, s", "without, s", "ratio"), part, lambda r: r["skip"],
        lambda r: (f"{r['on_s']:.3g}", f"{r['off_s']:.3g}", f"{r['off_s'] / r['on_s']:.2f}"),
    )]  # fmt: skip


def _start_up(_: str, part: Mapping[str, Any]) -> Parts:
    ratios = [(r["name"], f"{r['median']:.2f}", f"{r['smallest']:.2f} to {r['largest']:.2f}") for r in part["ratios"]]
    return [
        "Ratios of wall-clock times, each pair of processes one after the other.",
        Table(("ratio", "median", "least to most"), ratios),
        f"Largest memory of the cold run without figures: {part['peak_MB']:.0f} MB.",
    ]


SECTIONS: dict[str, tuple[str, Callable[[str, Any], Parts], Callable[..., tuple[str, Parts]] | None]] = {
    **{name: (title, _work, _work_in_short) for name, title in WORK.items()},
    "device": ("The whole sensor in 1D", _device, None),
    "growth": ("Growth with the unknowns", _growth, None),
    "skips": ("What each skip of the plan saves", _skips, None),
    "start-up": ("Start-up", _start_up, None),
}
"""By part its title, what is on the page, and what a terminal shows in place of the first table there."""


def draw(part: str, measurements: Mapping[str, Any], path: Path) -> None:
    """One plot as PNG; entries that failed are left out, and a line joins those of a tool that are the fastest at their
    error. Reductions are different models, so no line joins them: each has a mark of its own."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from validate.report.figures import drawing

    rows = [row for row in measurements["rows"] if not row["failure"]]
    with drawing.style():
        figure = drawing.new_figure(7.2, 4.6, f"{WORK[part]}: time against error", ())
        axes = figure.add_subplot()
        for tool, (colour, marker) in LOOKS.items():
            points = [(row["error"], row["median_s"]) for row in rows if row["tool"] == tool]
            if points:
                axes.plot(*zip(*points, strict=True), linestyle="none", marker=marker, color=colour, label=tool)
                axes.plot(*zip(*work.fastest(points), strict=True), color=colour, linewidth=1.2)
        models = (row for row in rows if row["tool"] == REDUCTION)
        for marker, row in zip(cycle(HOLLOW), models):
            look: dict[str, Any] = {"linestyle": "none", "marker": marker, "color": "#222222", "fillstyle": "none"}
            axes.plot(row["error"], row["median_s"], label=row["label"], **look)
        doubt = measurements["reference"]["uncertainty"]
        if doubt is not None:
            axes.axvspan(axes.get_xlim()[0], doubt, color="#dddddd", label="the reference's uncertainty")
        axes.set(xscale="log", yscale="log", xlabel="error, relative", ylabel="processor time, s (start-up apart)")
        axes.set_xlim(0.1 * min(row["error"] for row in rows), 1.0)
        axes.invert_xaxis()
        axes.legend(fontsize=8, ncols=2)
        FigureCanvasAgg(figure)
        figure.savefig(path, dpi=drawing.DPI)
