"""Who takes part: one entry is a tool with its settings, timed in processes of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from validate.bench import settings
from validate.bench.settings import FULL, UNIFORM

WHOLE, GIVEN = "this toolkit, whole run", "this toolkit, mesh given"
OURS = (WHOLE, GIVEN)
REDUCTION = "reductions"
SCIKIT_FEM, NGSOLVE, FREEFEM = "scikit-fem", "NGSolve", "FreeFEM"
PEERS = (SCIKIT_FEM, NGSOLVE, FREEFEM)
REDUCTIONS = ("paper", "anchored", "fin-massless", "fin", "plate", "moments:4")
ACCURACIES = (1e-2, 1e-3, 1e-4, 3e-5, 1e-5)
KINDS = {
    "given_sink": (GIVEN, "degree ", ("degree", "layers", "grading", "accuracy", "generations", "electric")),
    "skfem_sink": (SCIKIT_FEM, "degree ", ("degree", "grading", "cuts", "steps", "method", "tolerance")),
    "ngsolve_sink": (
        NGSOLVE, "order ", ("order", "layers", "grading", "electric", "steps", "method", "tolerance"),
    ),
    "freefem_sink": (FREEFEM, "P", ("order", "grading", "cuts", "steps", "method")),
}  # fmt: skip
"""By module the tool, what its elements are called by before their degree, and the columns of its `settings`."""


@dataclass(frozen=True)
class Entry:
    """``tool`` for the reader, ``label`` its settings in words, ``module`` of validate.bench.tools and its options."""

    tool: str
    label: str
    module: str
    options: dict[str, Any] = field(default_factory=dict)


def sink_entries(transient: bool, quick: bool, installed: frozenset[str]) -> list[Entry]:
    """Those of the sink's steady state or its whole transient."""
    two = 2 if quick else None
    found = [_own(transient, f"accuracy {a:.0e}", accuracy=a) for a in ACCURACIES[:two]]
    for electric in (FULL,) if transient else (FULL, UNIFORM):
        found += [_entry("given_sink", transient, *s, electric) for s in settings.GIVEN[transient][:two]]
    found += [_own(transient, name, REDUCTION, reduction=name) for name in REDUCTIONS]
    found += [_entry("skfem_sink", transient, *s) for s in settings.SCIKIT_FEM[transient][:two]]
    if NGSOLVE in installed:
        found += [_entry("ngsolve_sink", transient, *s) for s in settings.NGSOLVE[transient][:two]]
    if FREEFEM in installed:
        found += [_entry("freefem_sink", transient, *s) for s in settings.FREEFEM[transient][: 1 if quick else None]]
    return found


def reference(transient: bool, quick: bool) -> Entry:
    """NGSolve as no entry has it: a higher order on finer cells, smaller steps, tighter iterations."""
    if quick:
        return _entry("ngsolve_sink", transient, 4, 4, 1e-3, UNIFORM, 2 * transient, 4, 1e-8)
    return _entry("ngsolve_sink", transient, 6, 6, 1e-4 if transient else 1e-5, UNIFORM, 4 * transient, 4, 1e-9)


def _own(transient: bool, label: str, tool: str = WHOLE, **options: Any) -> Entry:
    return Entry(tool, label, "own_sink", {"transient": transient, **options})


def _entry(module: str, transient: bool, *values: Any) -> Entry:
    """An entry of a module of tools from its row of `settings`."""
    tool, element, keys = KINDS[module]
    options = dict(zip(keys, values, strict=True))
    return Entry(tool, element + _label(values[0], options), module, {"transient": transient, **options})


def _label(degree: int, options: Mapping[str, Any]) -> str:
    layers, cuts, steps = options.get("layers", degree), options.get("cuts", 1), options.get("steps", 0)
    said = [
        f"{degree}" if layers == degree else f"{degree} ({layers} across thin layers)",
        f"graded for {options['grading']:.0e}",
        f"cut in {cuts}" if cuts > 1 else "",
        "full electric problem" if options.get("electric") == FULL else "uniform current",
        f"{options['generations']} Krylov fields" if options.get("generations") else "",
        f"SDIRK{options['method']}, {steps} step{'s' if steps > 1 else ''} an octave" if steps else "",
    ]
    return ", ".join(filter(None, said))
