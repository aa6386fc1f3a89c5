"""Who takes part: one entry is a tool with its settings, timed in processes of its own."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from validate.bench import settings
from validate.bench.settings import FULL, UNIFORM

WHOLE, GIVEN = "this toolkit, whole run", "this toolkit, mesh given"
OURS = (WHOLE, GIVEN)
REDUCTION = "reductions"
SCIKIT_FEM, NGSOLVE, FREEFEM = "scikit-fem", "NGSolve", "FreeFEM"
PEERS = (SCIKIT_FEM, NGSOLVE, FREEFEM)


@dataclass(frozen=True)
class Entry:
    """``tool`` for the reader, ``label`` its settings in words, ``module`` of validate.bench.tools and its options."""

    tool: str
    label: str
    module: str
    options: dict[str, Any] = field(default_factory=dict)


def sink_entries(transient: bool, quick: bool, installed: frozenset[str]) -> list[Entry]:
    """Those of the sink's steady state or its whole transient."""
    wanted = {"transient": transient}
    accuracies = (1e-2, 1e-3) if quick else (1e-2, 1e-3, 1e-4, 3e-5, 1e-5)
    found = [Entry(WHOLE, f"accuracy {a:.0e}", "own_sink", {**wanted, "accuracy": a}) for a in accuracies]
    given = settings.GIVEN[transient][: 2 if quick else None]
    found += [_given(wanted, *s, FULL) for s in given] + [_given(wanted, *s, UNIFORM) for s in given if not transient]
    found += [_reduction(wanted, name) for name in REDUCTIONS]
    found += [_scikit_fem(wanted, *s) for s in settings.SCIKIT_FEM[transient][: 2 if quick else None]]
    if not quick:
        found.append(_full_order(wanted, *settings.FULL_ORDER[transient]))
    if NGSOLVE in installed:
        found += [_ngsolve(wanted, *s) for s in settings.NGSOLVE[transient][: 2 if quick else None]]
    if FREEFEM in installed:
        found += [_freefem(wanted, *s) for s in settings.FREEFEM[transient][: 1 if quick else None]]
    return found


REDUCTIONS = ("paper", "anchored", "fin-massless", "fin", "plate", "moments:4")


def reference(transient: bool, quick: bool) -> Entry:
    """NGSolve as no entry has it: a higher order on finer cells, smaller steps, tighter iterations."""
    if quick:
        return _ngsolve({"transient": transient}, 4, 4, 1e-3, UNIFORM, 2 * transient, 4, 1e-8)
    return _ngsolve({"transient": transient}, 6, 6, 1e-4 if transient else 1e-5, UNIFORM, 4 * transient, 4, 1e-9)


def _reduction(wanted: dict[str, bool], name: str) -> Entry:
    return Entry(REDUCTION, name, "own_sink", {**wanted, "reduction": name})


def _given(
    wanted: dict[str, bool], degree: int, layers: int, grading: float, accuracy: float, generations: int,
    electric: str,
) -> Entry:  # fmt: skip
    options = {
        **wanted, "degree": degree, "layers": layers, "grading": grading, "accuracy": accuracy,
        "generations": generations, "electric": electric,
    }  # fmt: skip
    fields = f", {generations} Krylov fields" if generations else ""
    label = f"degree {_degree(degree, layers)}, {_cells(grading, 1)}, {_current(electric)}{fields}"
    return Entry(GIVEN, label, "given_sink", options)


def _scikit_fem(
    wanted: dict[str, bool], degree: int, grading: float, cuts: int, steps: int, method: int, tolerance: float,
) -> Entry:  # fmt: skip
    options = {
        **wanted, "degree": degree, "grading": grading, "cuts": cuts, "steps": steps,
        "method": method, "tolerance": tolerance,
    }  # fmt: skip
    label = f"degree {degree}, {_cells(grading, cuts)}, {_current(UNIFORM)}{_steps(steps, method)}"
    return Entry(SCIKIT_FEM, label, "skfem_sink", options)


def _full_order(wanted: dict[str, bool], degree: int, grading: float, cuts: int, steps: int) -> Entry:
    options = {**wanted, "degree": degree, "grading": grading, "cuts": cuts, "steps": steps}
    label = f"degree {degree}, {_cells(grading, cuts)}, {_current(FULL)}{_steps(steps, 3)}, as this toolkit's check"
    return Entry(SCIKIT_FEM, label, "full_order_sink", options)


def _ngsolve(
    wanted: dict[str, bool], order: int, layers: int, grading: float, electric: str, steps: int, method: int,
    tolerance: float,
) -> Entry:  # fmt: skip
    options = {
        **wanted, "order": order, "layers": layers, "grading": grading, "electric": electric,
        "steps": steps, "method": method, "tolerance": tolerance,
    }  # fmt: skip
    label = f"order {_degree(order, layers)}, {_cells(grading, 1)}, {_current(electric)}{_steps(steps, method)}"
    return Entry(NGSOLVE, label, "ngsolve_sink", options)


def _freefem(wanted: dict[str, bool], order: int, grading: float, cuts: int, steps: int, method: int) -> Entry:
    options = {
        **wanted, "order": order, "grading": grading, "cuts": cuts, "steps": steps, "method": method,
    }  # fmt: skip
    label = f"P{order}, {_cells(grading, cuts)}, {_current(UNIFORM)}{_steps(steps, method)}"
    return Entry(FREEFEM, label, "freefem_sink", options)


def _degree(degree: int, layers: int) -> str:
    return f"{degree}" if degree == layers else f"{degree} ({layers} across thin layers)"


def _current(electric: str) -> str:
    return "uniform current" if electric == UNIFORM else "full electric problem"


def _cells(grading: float, cuts: int) -> str:
    return f"graded for {grading:.0e}" + (f", cut in {cuts}" if cuts > 1 else "")


def _steps(steps: int, method: int) -> str:
    return f", SDIRK{method}, {steps} step{'s' if steps > 1 else ''} an octave" if steps else ""
