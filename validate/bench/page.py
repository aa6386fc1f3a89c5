"""The bench as a page of markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from validate.bench import work_page
from validate.bench.entries import FREEFEM, NGSOLVE
from validate.bench.markdown import Lines, table


def markdown(found: Mapping[str, Any], figures: Mapping[str, str]) -> str:
    """The page; ``figures`` are paths to those that were drawn, by part."""
    lines = ["# Run time against error", "", *_preface(found)]
    sections = {
        "transient": lambda part: work_page.section("The whole transient of the sink", part, True),
        "steady": lambda part: work_page.section("The sink's steady state", part, False),
        "device": _device,
        "growth": _growth,
        "skips": _skips,
        "start-up": _start_up,
    }
    if {"transient", "steady"} & found.keys():
        lines += work_page.WHAT_EACH_DOES
    for name, section in sections.items():
        if name in found:
            lines += section(found[name])
            if name in figures:
                lines += [f"![{name}]({figures[name]})", ""]
    return "\n".join(lines).rstrip() + "\n"


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
        *table(("", ""), machine.items()),
    ]
    if absent:
        lines += [f"Not installed here, so not compared: {' and '.join(absent)}.", ""]
    return lines


def _device(part: Mapping[str, Any]) -> Lines:
    doubt = part["uncertainty"]
    checked = "" if doubt is None else (
        f" The paper's scheme, extrapolated from its two finest grids at first order in space, stays within "
        f"{doubt[0]:.1e} of it over time, and within {doubt[1]:.1e} at the end, in the steady state that controllers "
        "hold: early on, its differences at the faces of layers that are still cold converge more slowly."
    )  # fmt: skip
    body = [
        (r["tool"], r["label"], r["failure"], "", "")
        if r["failure"]
        else (r["tool"], r["label"], f"{r['error']:.1e}", f"{r['error_at_end']:.1e}", f"{r['median_s']:.3g}")
        for r in part["rows"]
    ]
    return [
        "## The whole sensor in 1D", "",
        f"From cold to {part['end_time_s'] * 1e3:g} ms. Error: the largest of sink and sensor over time, relative "
        "to the set rise. Reference: the accurate scheme at an accuracy of 1e-08, so it is judged by itself."
        + checked, "",
        *table(("entry", "settings", "error over time", "error at the end", "time, s"), body),
    ]  # fmt: skip


def _growth(part: Mapping[str, Any]) -> Lines:
    phases = ("assembly", "factorization", "one solve")
    body = [
        (r["path"], str(r.get("unknowns", "")), *(f"{r['phases'][p]:.2g}" for p in phases), f"{r['own_MB']:.0f}")
        if not r["failure"] else (r["path"], r["failure"], "", "", "", "")
        for r in part["rows"]
    ]  # fmt: skip
    return [
        "## Growth", "",
        "The heat problem of the quarter on cells cut further and further, seconds by phase (the mesh is given), "
        "and the memory above that of the imports.", "",
        *table(("path", "unknowns", "assembly, s", "factorization, s", "one solve, s", "MB"), body),
        *(_exponents(part["exponents"], phases) if part["exponents"] else ()),
    ]  # fmt: skip


def _exponents(rows: Sequence[Mapping[str, Any]], phases: Sequence[str]) -> Lines:
    body = [
        (e["path"], *(f"{e['exponents'][p]:.2f}" for p in (*phases, "memory")), e["rises"], e["largest"]) for e in rows
    ]
    return [
        "Exponents: slopes of log time, and of log memory, over log unknowns, from 4,000 on.", "",
        *table(("path", *phases, "memory", "rises fastest", "takes most at the largest"), body),
    ]  # fmt: skip


def _skips(part: Sequence[Mapping[str, Any]]) -> Lines:
    body = [
        (r["skip"], r["failure"], "", "") if r["failure"]
        else (r["skip"], f"{r['on_s']:.3g}", f"{r['off_s']:.3g}", f"{r['off_s'] / r['on_s']:.2f}")
        for r in part
    ]  # fmt: skip
    return [
        "## What each skip of the plan saves", "",
        "The same run in turns with the skip and without it. Solver: seconds of processor time after imports; whole "
        "commands: on the wall. Without the transient, the figures, the fields and the 3D model less is reported; the "
        "other skips leave the answer within its estimated error.", "",
        *table(("skipped", "with the skip, s", "without, s", "ratio"), body),
    ]  # fmt: skip


def _start_up(part: Mapping[str, Any]) -> Lines:
    body = [(r["name"], f"{r['median']:.2f}", f"{r['smallest']:.2f} to {r['largest']:.2f}") for r in part["ratios"]]
    return [
        "## Start-up", "", "Ratios of wall-clock times, each pair of processes one after the other.", "",
        *table(("ratio", "median", "smallest to largest"), body),
        f"Largest memory of the cold run without figures: {part['peak_MB']:.0f} MB.", "",
    ]  # fmt: skip
