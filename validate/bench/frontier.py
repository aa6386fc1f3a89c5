"""At each error, the fastest entry of each tool, and who is ahead."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from validate.bench.entries import GIVEN, OURS, PEERS, WHOLE

TARGETS = (1e-2, 1e-3, 1e-4, 1e-5)
WORDS = {WHOLE: "our whole run", GIVEN: "our solve on a given mesh"}
Row = dict[str, Any]
Best = Mapping[str, Any] | None


def targets(rows: list[Row]) -> list[dict[str, Any]]:
    """For each of TARGETS the least median time of each tool at an error at or below it (``None``: not reached), and
    each peer's over each of ours."""
    found = []
    for target in TARGETS:
        fastest = {tool: _fastest(rows, tool, target) for tool in (*OURS, *PEERS)}
        ratios = {peer: {own: _ratio(fastest[peer], fastest[own]) for own in OURS} for peer in PEERS}
        found.append({"target": target, "fastest": fastest, "ratios": ratios})
    return found


def _ratio(peer: Best, own: Best) -> float | None:
    return None if peer is None or own is None else float(peer["median_s"] / own["median_s"])


def _fastest(rows: list[Row], tool: str, target: float) -> Row | None:
    there = [row for row in rows if row["tool"] == tool and not row["failure"] and row["error"] <= target]
    best = min(there, key=lambda row: row["median_s"], default=None)
    return None if best is None else {key: best[key] for key in ("label", "median_s", "error", "peak_MB")}


def taking_part(rows: list[Row]) -> list[str]:
    """Ours, and those of the others that have an entry: who is not installed is not said to be slow."""
    return [*OURS, *(peer for peer in PEERS if any(row["tool"] == peer for row in rows))]


def verdict(peer: Best, own: Mapping[str, Best]) -> str:
    """A peer's fastest entry beside ours of each kind, in words for a table; bold where the peer is ahead."""
    if peer is None:
        return "no entry gets there"
    return "; ".join([f"{peer['median_s']:.3g} s", *(_beside(peer, own[kind], WORDS[kind]) for kind in OURS)])


def _beside(peer: Best, own: Best, name: str) -> str:
    ratio = _ratio(peer, own)
    if ratio is None:
        return f"**ahead of {name}, which does not get there**"
    if ratio >= 1:
        return f"{ratio:.1f} times as long as {name}"
    return f"**ahead: {1 / ratio:.1f} times as fast as {name}**"
