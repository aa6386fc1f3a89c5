"""Who takes part: one entry is a tool with its settings, timed in processes of its own.

The settings of each full-order tool were found by trial: those that none of its others clearly beats in both time and
error. Orders in time and steps are such that the error in time is no larger than that in space.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

UNIFORM, FULL = "uniform", "full"
WORDS = {UNIFORM: "uniform current", FULL: "full electric problem"}
WHOLE, GIVEN = "this toolkit, whole run", "this toolkit, mesh given"
OURS = (WHOLE, GIVEN)
REDUCTION = "reductions"
SCIKIT_FEM, NGSOLVE = "scikit-fem", "NGSolve"
PEERS = (SCIKIT_FEM, NGSOLVE)
REDUCTIONS = ("paper", "anchored", "fin-massless", "fin", "plate", "moments:4")
ACCURACIES = (1e-2, 1e-3, 1e-4, 3e-5, 1e-5)
KINDS = {
    "tools.given_sink": (GIVEN, "degree ", ("degree", "layers", "grading", "accuracy", "generations", "electric")),
    "tools.skfem_sink": (SCIKIT_FEM, "degree ", ("degree", "grading", "cuts", "steps", "method", "tolerance")),
    "tools.ngsolve_sink": (
        NGSOLVE, "order ", ("order", "layers", "grading", "electric", "steps", "method", "tolerance"),
    ),
}  # fmt: skip
"""By module the tool, what its elements are called by before their degree, and what its rows of SETTINGS are.

``layers`` is the degree across thin layers, ``accuracy`` and ``tolerance`` are of the iterations, ``generations`` those
of Krylov fields, ``steps`` are to an octave of time and ``method`` is their order."""
SETTINGS: dict[tuple[str, bool], tuple[tuple[Any, ...], ...]] = {
    (GIVEN, True): (
        (2, 2, 1e-2, 1e-2, 3), (3, 2, 1e-2, 1e-2, 3), (3, 2, 1e-3, 1e-3, 4), (4, 3, 1e-3, 1e-4, 5),
        (5, 3, 1e-3, 1e-4, 6), (5, 3, 1e-4, 1e-5, 8), (6, 3, 1e-4, 1e-5, 8), (7, 4, 1e-5, 1e-5, 8),
        (7, 4, 1e-5, 1e-6, 10),
    ),
    (GIVEN, False): (
        (2, 2, 1e-2, 1e-2, 0), (3, 2, 1e-2, 1e-2, 0), (3, 2, 1e-3, 1e-2, 0), (4, 3, 1e-3, 1e-3, 0),
        (5, 3, 1e-3, 1e-3, 0), (5, 3, 1e-4, 1e-3, 0), (6, 3, 1e-4, 1e-4, 0), (7, 3, 1e-4, 1e-4, 0),
        (7, 4, 1e-5, 1e-4, 0), (8, 4, 1e-5, 1e-5, 0),
    ),
    (SCIKIT_FEM, True): (
        (2, 1e-2, 1, 1, 3, 1e-4), (2, 1e-2, 1, 1, 4, 1e-4), (2, 1e-3, 2, 1, 4, 1e-4), (2, 1e-3, 2, 2, 4, 1e-4),
        (2, 1e-3, 3, 2, 4, 1e-4), (2, 1e-3, 4, 2, 4, 1e-4), (2, 1e-4, 6, 3, 4, 1e-5),
    ),
    (SCIKIT_FEM, False): (
        (2, 1e-2, 1, 0, 3, 1e-4), (2, 1e-3, 1, 0, 3, 1e-4), (2, 1e-3, 2, 0, 3, 1e-5), (2, 1e-4, 2, 0, 3, 1e-5),
        (2, 1e-3, 3, 0, 3, 1e-5), (2, 1e-4, 4, 0, 3, 1e-6), (2, 1e-4, 6, 0, 3, 1e-6),
    ),
    (NGSOLVE, True): (
        (2, 1, 1e-2, UNIFORM, 1, 2, 1e-3), (2, 1, 1e-2, UNIFORM, 1, 3, 1e-3), (3, 1, 1e-2, UNIFORM, 1, 4, 1e-3),
        (3, 1, 1e-2, FULL, 1, 4, 1e-3), (3, 1, 1e-3, UNIFORM, 2, 4, 1e-4), (4, 2, 1e-2, UNIFORM, 2, 4, 1e-5),
        (4, 2, 1e-3, UNIFORM, 2, 4, 1e-4), (4, 2, 1e-3, FULL, 2, 4, 1e-4), (5, 2, 1e-3, UNIFORM, 2, 4, 1e-5),
        (5, 2, 1e-3, UNIFORM, 3, 4, 1e-6), (6, 2, 1e-3, UNIFORM, 3, 4, 1e-6), (6, 2, 1e-4, UNIFORM, 3, 4, 1e-6),
    ),
    (NGSOLVE, False): (
        (2, 1, 1e-2, UNIFORM, 0, 2, 1e-4), (2, 1, 1e-3, UNIFORM, 0, 2, 1e-4), (2, 1, 1e-3, FULL, 0, 2, 1e-4),
        (3, 1, 1e-2, UNIFORM, 0, 2, 1e-4), (3, 1, 1e-3, UNIFORM, 0, 2, 1e-4), (3, 2, 1e-3, UNIFORM, 0, 2, 1e-5),
        (3, 2, 1e-3, FULL, 0, 2, 1e-5), (4, 2, 1e-3, UNIFORM, 0, 2, 1e-5), (4, 2, 1e-4, UNIFORM, 0, 2, 1e-5),
        (4, 2, 1e-5, UNIFORM, 0, 2, 1e-5), (4, 2, 1e-5, FULL, 0, 2, 1e-5), (5, 2, 1e-4, UNIFORM, 0, 2, 1e-6),
        (6, 2, 1e-4, UNIFORM, 0, 2, 1e-6),
    ),
}  # fmt: skip
"""By tool and whether it is the transient."""


@dataclass(frozen=True)
class Entry:
    """``tool`` for the reader, ``label`` its settings in words, ``module`` of validate.bench and its options."""

    tool: str
    label: str
    module: str
    options: dict[str, Any] = field(default_factory=dict)


def sink_entries(transient: bool, quick: bool, installed: frozenset[str]) -> list[Entry]:
    """Those of the sink's steady state or its whole transient."""
    two = 2 if quick else None
    entries = [own(transient, accuracy) for accuracy in ACCURACIES[:two]]
    for electric in (FULL,) if transient else (FULL, UNIFORM):
        entries += [_entry("tools.given_sink", transient, *s, electric) for s in SETTINGS[GIVEN, transient][:two]]
    for name in REDUCTIONS:
        entries.append(Entry(REDUCTION, name, "tools.reduction", {"transient": transient, "reduction": name}))
    for module, (tool, _, _) in KINDS.items():
        if tool == SCIKIT_FEM or tool in installed:
            entries += [_entry(module, transient, *s) for s in SETTINGS[tool, transient][:two]]
    return entries


def reference(transient: bool, quick: bool) -> Entry:
    """NGSolve as no entry has it: a higher order on finer cells, smaller steps, tighter iterations."""
    grading = 1e-3 if quick else 1e-4 if transient else 1e-5
    order, steps, tolerance = (4, 2, 1e-8) if quick else (6, 4, 1e-9)
    return _entry("tools.ngsolve_sink", transient, order, order, grading, UNIFORM, steps * transient, 4, tolerance)


def own(transient: bool, accuracy: float) -> Entry:
    """This toolkit's 3D model as its users call it."""
    return Entry(WHOLE, f"accuracy {accuracy:.0e}", "tools.own_sink", {"transient": transient, "accuracy": accuracy})


def _entry(module: str, transient: bool, *values: Any) -> Entry:
    """An entry of a module of tools from its row of SETTINGS."""
    tool, element, keys = KINDS[module]
    options = dict(zip(keys, values, strict=True))
    return Entry(tool, element + _label(values[0], options), module, {"transient": transient, **options})


def _label(degree: int, options: Mapping[str, Any]) -> str:
    layers, cuts, steps = options.get("layers", degree), options.get("cuts", 1), options.get("steps", 0)
    said = [
        f"{degree}" if layers == degree else f"{degree} ({layers} across thin layers)",
        f"graded for {options['grading']:.0e}",
        f"cut in {cuts}" if cuts > 1 else "",
        WORDS[options.get("electric", UNIFORM)],
        f"{options['generations']} Krylov fields" if options.get("generations") else "",
        f"SDIRK{options['method']}, {steps} step{'s' if steps > 1 else ''} an octave" if steps else "",
    ]
    return ", ".join(filter(None, said))
