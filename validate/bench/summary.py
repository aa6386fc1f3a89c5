"""The bench on a terminal: what was measured, in tables of at most 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from validate.bench import frontier
from validate.bench.entries import GIVEN, REDUCTION, WHOLE
from validate.report.table import WIDTH

_SHORT = {WHOLE: "whole run", GIVEN: "mesh given"}


def text(found: Mapping[str, Any]) -> str:
    """The parts that were measured, each with what its times are."""
    parts = {
        "transient": lambda part: _work("The sink's whole transient", part),
        "steady": lambda part: _work("The sink's steady state", part),
        "device": _device,
        "growth": _growth,
        "skips": _skips,
        "start-up": _start_up,
    }
    blocks = [line for name, part in parts.items() if name in found for line in (*part(found[name]), "")]
    return "\n".join(blocks).rstrip()


def _work(title: str, part: Mapping[str, Any]) -> Iterator[str]:
    rows = part["rows"]
    tools = frontier.taking_part(rows)
    yield f"{title}: seconds of the fastest whose error is at most"
    body = []
    for at in part["targets"]:
        times = (at["fastest"][tool] for tool in tools)
        body.append(
            (f"{at['target'] * 100:g} %", *("-" if best is None else f"{best['median_s']:.3g}" for best in times))
        )
    yield from _table(("", *(_SHORT.get(tool, tool) for tool in tools)), body)
    yield "Processor time; a dash: none is as accurate. The first two are this toolkit's."
    reductions = [row for row in rows if row["tool"] == REDUCTION and not row["failure"]]
    if reductions:
        yield ""
        body = [(r["label"], f"{r['error']:.1e}", f"{r['median_s']:.3g}") for r in reductions]
        yield from _table(("1D model", "error", "time, s"), body)
    yield from _failures(rows)


def _device(part: Mapping[str, Any]) -> Iterator[str]:
    yield "The whole sensor in 1D, errors relative to the set rise"
    body = [
        (r["label"], f"{r['error']:.1e}", f"{r['error_at_end']:.1e}", f"{r['median_s']:.3g}")
        for r in part["rows"]
        if not r["failure"]
    ]
    yield from _table(("settings", "error over time", "at the end", "time, s"), body)
    yield from _failures(part["rows"])


def _growth(part: Mapping[str, Any]) -> Iterator[str]:
    yield "Growth with the unknowns: seconds by phase, and memory above that of imports"
    phases = ("assembly", "factorization", "one solve")
    body = [
        (r["path"], str(r["unknowns"]), *(f"{r['phases'][phase]:.2g}" for phase in phases), f"{r['own_MB']:.0f}")
        for r in part["rows"]
        if not r["failure"]
    ]
    yield from _table(("path", "unknowns", *phases, "MB"), body)
    yield from _failures(part["rows"])


def _skips(part: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield "What each skip of the plan saves, seconds"
    body = [
        (r["skip"], f"{r['on_s']:.3g}", f"{r['off_s']:.3g}", f"{r['off_s'] / r['on_s']:.2f}")
        for r in part
        if not r["failure"]
    ]
    yield from _table(("skipped", "with", "without", "ratio"), body)
    yield from _failures(part)


def _start_up(part: Mapping[str, Any]) -> Iterator[str]:
    yield "Start-up, ratios on the wall"
    body = [(r["name"], f"{r['median']:.2f}", f"{r['smallest']:.2f} to {r['largest']:.2f}") for r in part["ratios"]]
    yield from _table(("ratio", "median", "least to most"), body)
    yield f"Largest memory of the cold run without figures: {part['peak_MB']:.0f} MB."


def _failures(rows: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    for row in rows:
        if row["failure"]:
            name = ", ".join(str(row[key]) for key in ("tool", "label", "path", "skip") if row.get(key))
            yield from textwrap.wrap(f"{name}: {row['failure']}", WIDTH, subsequent_indent="  ")


def _table(head: Sequence[str], body: Sequence[Sequence[str]]) -> Iterator[str]:
    """Columns as wide as they need; the first is cut short where the row would be wider than a terminal."""
    widths = [max(len(row[k]) for row in (head, *body)) for k in range(len(head))]
    widths[0] = min(widths[0], WIDTH - 2 - sum(width + 2 for width in widths[1:]))
    for row in (head, *body):
        first = textwrap.shorten(row[0], widths[0], placeholder=" ...") if row[0] else ""
        cells = [
            f"{first:<{widths[0]}}",
            *(f"{cell:>{width}}" for cell, width in zip(row[1:], widths[1:], strict=True)),
        ]
        yield "  " + "  ".join(cells).rstrip()
