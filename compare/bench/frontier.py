"""At each error, the fastest entry of each tool, and who is ahead."""

from __future__ import annotations

from typing import Any

from compare.bench.entries import OURS, PEERS

TARGETS = (1e-2, 1e-3, 1e-4, 1e-5)
Row = dict[str, Any]


def targets(rows: list[Row]) -> list[dict[str, Any]]:
    """For each of TARGETS the least median time of each tool at an error at or below it (``None``: not reached), and
    each peer's over ours."""
    found = []
    for target in TARGETS:
        fastest = {tool: _fastest(rows, tool, target) for tool in (OURS, *PEERS)}
        ours = fastest[OURS]
        ratios = {tool: _ratio(fastest[tool], ours) for tool in PEERS}
        found.append({"target": target, "fastest": fastest, "ratios": ratios})
    return found


def _ratio(peer: Row | None, ours: Row | None) -> float | None:
    return None if peer is None or ours is None else float(peer["median_s"] / ours["median_s"])


def _fastest(rows: list[Row], tool: str, target: float) -> Row | None:
    there = [row for row in rows if row["tool"] == tool and not row["failure"] and row["error"] <= target]
    best = min(there, key=lambda row: row["median_s"], default=None)
    return None if best is None else {key: best[key] for key in ("label", "median_s", "error", "peak_MB")}


def verdict(peer: dict[str, Any] | None, ours: dict[str, Any] | None, ratio: float | None) -> str:
    """In words, for a table."""
    if ours is None:
        return "no entry" if peer is None else f"{peer['median_s']:.3g} s; **ahead: this toolkit does not get there**"
    if peer is None or ratio is None:
        return "no entry gets there"
    if ratio >= 1:
        return f"{peer['median_s']:.3g} s, {ratio:.1f} times as long"
    return f"{peer['median_s']:.3g} s, **ahead: {1 / ratio:.1f} times as fast**"
