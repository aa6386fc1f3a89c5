"""The sections of the page of `validate bench`: sentences, and tables as (heads, rows of cells)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from benchmarks import bench

Table = tuple[Sequence[str], Sequence[Sequence[str]]]
Part = str | Table
ABOUT = (
    f"*{bench.OURS}* gets the scene and an accuracy: it finds the mesh and estimates the error of every number. "
    "NGSolve and scikit-fem are plain programs: they get a graded mesh of the "
    "quarter, take the current density as uniform, which only this scene's ideal electrodes allow, and know no error. "
    "Their settings were found by trial. The time begins with the assembly; no time includes imports."
)


def preface(measurements: Mapping[str, Any]) -> list[Part]:
    """Return the beginning of the page: how the numbers were made, and on which machine."""
    quick = " --quick" if measurements["quick"] else ""
    return [
        f"Made by `validate bench{quick}` on the default sink at 1 V. Each entry runs in processes of its own, in "
        "turns with the others. A time is the median, in seconds of processor time of one thread. A process repeats "
        "its solve for a second, with emptied caches; the first one warms up.",
        (("", ""), [*measurements["machine"].items()]),
    ]  # fmt: skip


def _work(part: Mapping[str, Any]) -> list[Part]:
    doubt = part["uncertainty"]
    checked = "not checked by another program" if doubt is None else f"{doubt:.1e} off {part['checked_by']}"
    rows = part["rows"]
    tools = [tool for tool in bench.TOOLS if any(row["tool"] == tool for row in rows)]
    times = []
    for target in bench.TARGETS:
        best = (bench.fastest(rows, tool, target) for tool in tools)
        times.append([f"{target * 100:g} %", *("-" if seconds is None else f"{seconds:.3g}" for seconds in best)])
    return [
        "Seconds of the fastest entry whose error is at most:", (("error", *tools), times),
        "Error: the largest of the rises of peak, end and mean and of the current, over time at octaves from 10 us on, "
        f"relative to the last value. Reference: {part['made_by']}, {checked}.",
        _entries(("unknowns", "error", "error bound", "time, s", "range, s", "start-up, s", "MB"), rows, lambda row: (
            str(row["unknowns"]), f"{row['error']:.1e}", f"{row['bound']:.1e}" if row.get("bound") else "",
            f"{row['median_s']:.3g}", f"{row['fastest_s']:.3g} to {row['slowest_s']:.3g}", f"{row['start_up_s']:.2g}",
            f"{row['peak_MB']:.0f}")),
        ABOUT,
    ]  # fmt: skip


def _entries(heads: Sequence[str], rows: Sequence[Mapping[str, Any]], cells: Callable[[Any], Sequence[str]]) -> Table:
    """A row for each entry: its name, then its cells or the failure."""
    return ("entry", *heads), [
        [f"{row['tool']}: {row['label']}", *([row["failure"]] if row["failure"] else cells(row))] for row in rows
    ]


def _device(part: Mapping[str, Any]) -> list[Part]:
    return [
        f"From cold to {part['end_time_s'] * 1e3:g} ms. Error: the largest of sink and sensor, over time and at the "
        "end, relative to the set rise. Reference: the accurate scheme at an accuracy of 1e-08.",
        _entries(("over time", "at the end", "time, s"), part["rows"], lambda row: (
            f"{row['error']:.1e}", f"{row['error_at_end']:.1e}", f"{row['median_s']:.3g}")),
    ]  # fmt: skip


def _growth(part: Mapping[str, Any]) -> list[Part]:
    slopes = [(name, *(f"{each:.2f}" for each in both)) for name, both in part["exponents"].items() if both]
    return [
        "Whole runs of the sink at higher and higher accuracy.",
        _entries(("unknowns", "time, s", "MB"), part["rows"], lambda row: (
            str(row["unknowns"]), f"{row['median_s']:.3g}", f"{row['peak_MB']:.0f}")),
        "Exponents: slopes of log time and of log memory over log unknowns.", (("", "time", "memory"), slopes),
    ]  # fmt: skip


def _skips(part: Sequence[Mapping[str, Any]]) -> list[Part]:
    rows = [(r["name"], f"{r['first_s']:.3g}", f"{r['second_s']:.3g}", f"{1 / r['ratio']:.2f}") for r in part]
    return ["Whole commands from cold, on the wall, in turns.", (("skipped", "with, s", "without, s", "ratio"), rows)]


def _start_up(part: Mapping[str, Any]) -> list[Part]:
    rows = [(r["name"], f"{r['ratio']:.2f}", f"{r['least']:.2f} to {r['most']:.2f}") for r in part["rows"]]
    return [
        "Wall-clock time over that of `import skfem`, each pair of processes one after the other.",
        (("", "ratio", "range"), rows), f"Largest memory of the cold run without figures: {part['peak_MB']:.0f} MB.",
    ]  # fmt: skip


SECTIONS: dict[str, tuple[str, Callable[[Any], list[Part]]]] = {
    "transient": ("The whole transient of the sink", _work),
    "steady": ("The sink's steady state", _work),
    "device": ("The whole sensor in 1D", _device),
    "growth": ("Growth with the unknowns", _growth),
    "skips": ("What each skip of the plan saves", _skips),
    "start-up": ("Start-up", _start_up),
}


def sections(measurements: Mapping[str, Any]) -> dict[str, tuple[str, list[Part]]]:
    """Return the title and the content of each part that was measured."""
    return {name: (title, make(measurements[name])) for name, (title, make) in SECTIONS.items() if name in measurements}
