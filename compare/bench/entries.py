"""Who takes part: one entry is a tool with its settings, timed in processes of its own."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

OURS, PLAIN, REDUCTION = "this toolkit", "scikit-fem, full order", "reductions"
NGSOLVE, FREEFEM = "NGSolve", "FreeFEM"
PEERS = (PLAIN, NGSOLVE, FREEFEM)


@dataclass(frozen=True)
class Entry:
    """``tool`` for the reader, ``label`` its settings in words, ``module`` of compare.bench.tools and its options."""

    tool: str
    label: str
    module: str
    options: dict[str, Any] = field(default_factory=dict)


def sink_entries(transient: bool, quick: bool, installed: frozenset[str]) -> list[Entry]:
    """Those of the sink's steady state or its whole transient."""
    wanted = {"transient": transient}
    accuracies = (1e-2, 1e-3) if quick else (1e-2, 1e-3, 1e-4, 3e-5, 1e-5)
    found = [Entry(OURS, f"accuracy {a:.0e}", "fem3d_sink", {**wanted, "accuracy": a}) for a in accuracies]
    found += [_reduction(wanted, name) for name in REDUCTIONS]
    found += [_plain(wanted, *settings) for settings in (PLAIN_SETTINGS[transient][: 1 if quick else None])]
    if NGSOLVE in installed:
        found += [_ngsolve(wanted, *s) for s in NGSOLVE_SETTINGS[transient][: 2 if quick else None]]
    if FREEFEM in installed:
        found += [_freefem(wanted, *s) for s in FREEFEM_SETTINGS[transient][: 1 if quick else None]]
    return found


REDUCTIONS = ("paper", "anchored", "fin-massless", "fin", "plate", "moments:4")


def reference(transient: bool, quick: bool) -> Entry:
    """NGSolve as no entry has it: a higher order on finer cells, smaller steps, tighter iterations."""
    if quick:
        return _ngsolve({"transient": transient}, 4, 1e-3, "uniform", 2 * transient, 4, 1e-8)
    return _ngsolve({"transient": transient}, 6, 1e-4 if transient else 1e-5, "uniform", 4 * transient, 4, 1e-9)


# Settings found by trial: orders in time and steps for which the error in time is below that in space.
# degree, grading, cuts, across, steps an octave
PLAIN_SETTINGS: dict[bool, tuple[tuple[int, float, int, int, int], ...]] = {
    True: ((1, 1e-2, 1, 1, 1), (2, 1e-2, 1, 1, 1), (2, 1e-3, 1, 1, 2)),
    False: ((1, 1e-2, 1, 1, 0), (2, 1e-2, 1, 1, 0), (2, 1e-3, 1, 1, 0), (2, 1e-3, 2, 1, 0), (2, 1e-4, 2, 2, 0)),
}
# order, grading, electric problem, steps an octave, order in time, tolerance of the iterations
NGSOLVE_SETTINGS: dict[bool, tuple[tuple[int, float, str, int, int, float], ...]] = {
    True: (
        (2, 1e-2, "uniform", 1, 3, 1e-4),
        (3, 1e-2, "uniform", 1, 4, 1e-5),
        (3, 1e-3, "uniform", 1, 4, 1e-5),
        (3, 1e-3, "full", 1, 4, 1e-5),
        (4, 1e-3, "uniform", 2, 4, 1e-6),
        (5, 1e-3, "uniform", 2, 4, 1e-6),
        (5, 1e-4, "uniform", 3, 4, 1e-7),
        (6, 1e-3, "uniform", 3, 4, 1e-7),
    ),
    False: (
        (2, 1e-2, "uniform", 0, 2, 1e-4),
        (3, 1e-2, "uniform", 0, 2, 1e-5),
        (3, 1e-3, "uniform", 0, 2, 1e-5),
        (3, 1e-3, "full", 0, 2, 1e-5),
        (4, 1e-3, "uniform", 0, 2, 1e-6),
        (4, 1e-4, "uniform", 0, 2, 1e-7),
        (5, 1e-4, "uniform", 0, 2, 1e-7),
        (5, 1e-5, "uniform", 0, 2, 1e-8),
    ),
}
# order, grading, cuts, across, steps an octave, order in time
FREEFEM_SETTINGS: dict[bool, tuple[tuple[int, float, int, int, int, int], ...]] = {
    True: (
        (2, 1e-2, 1, 1, 1, 3),
        (2, 1e-3, 1, 1, 1, 4),
        (2, 1e-3, 2, 1, 1, 4),
        (2, 1e-4, 2, 2, 1, 4),
        (2, 1e-4, 3, 2, 2, 4),
    ),
    False: (
        (1, 1e-2, 1, 1, 0, 3),
        (2, 1e-2, 1, 1, 0, 3),
        (2, 1e-3, 1, 1, 0, 3),
        (2, 1e-3, 2, 1, 0, 3),
        (2, 1e-4, 2, 2, 0, 3),
        (2, 1e-4, 4, 2, 0, 3),
    ),
}


def _reduction(wanted: dict[str, bool], name: str) -> Entry:
    return Entry(REDUCTION, name, "reduced_sink", {**wanted, "reduction": name})


def _plain(wanted: dict[str, bool], degree: int, grading: float, cuts: int, across: int, steps: int) -> Entry:
    options = {**wanted, "degree": degree, "grading": grading, "cuts": cuts, "across": across, "steps": steps}
    return Entry(PLAIN, f"degree {degree}, {_cells(grading, cuts)}{_steps(steps, 3)}", "plain_sink", options)


def _ngsolve(
    wanted: dict[str, bool], order: int, grading: float, electric: str, steps: int, method: int, tolerance: float
) -> Entry:
    options = {
        **wanted, "order": order, "grading": grading, "cuts": 1, "across": 1, "electric": electric, "steps": steps,
        "method": method, "tolerance": tolerance,
    }  # fmt: skip
    current = "uniform current" if electric == "uniform" else "full electric problem"
    return Entry(
        NGSOLVE, f"order {order}, {_cells(grading, 1)}, {current}{_steps(steps, method)}", "ngsolve_sink", options
    )


def _freefem(
    wanted: dict[str, bool], order: int, grading: float, cuts: int, across: int, steps: int, method: int
) -> Entry:
    options = {
        **wanted,
        "order": order,
        "grading": grading,
        "cuts": cuts,
        "across": across,
        "steps": steps,
        "method": method,
    }
    return Entry(
        FREEFEM, f"P{order}, {_cells(grading, cuts)}, uniform current{_steps(steps, method)}", "freefem_sink", options
    )


def _cells(grading: float, cuts: int) -> str:
    return f"graded for {grading:.0e}" + (f", cut in {cuts}" if cuts > 1 else "")


def _steps(steps: int, method: int) -> str:
    return f", SDIRK{method}, {steps} step{'s' if steps > 1 else ''} an octave" if steps else ""
