"""What is to be found of a scene, and how well: the engine's only view of what a run is for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem3d.results.outputs import Outputs
from meshes.symmetry import Symmetry

Quantities = dict[str, np.ndarray]  # numbers, or arrays over time


@dataclass(frozen=True, eq=False)
class Study:
    """A scene's part to be solved, and its quantities.

    ``steady`` and ``traces`` make the reported quantities of the outputs; ``steady_scales`` and ``trace_scales`` say
    of the outputs (those of the steady state where it is known) what an error of each is relative to. ``goals`` and
    ``trace_goals`` name the probe that a steady quantity, or a trace, is; ``ratios`` quantities with the goal whose
    relative error they share. ``rises`` and ``trace_rises`` are the temperatures among the quantities.
    ``extrapolated``: whether what later degrees would change, where that is known, is part of the steady quantities.
    ``field``: the largest error of the steady field at any point, over its largest rise, that needs no finer mesh; None
    where nobody looks at the field. Times in s: the ``end``, the ``earliest`` from which on
    traces hold their accuracy, and ``instants`` that must be among the rows. ``voltage`` names the drive in messages.
    ``from_start``: whether errors before ``earliest`` are wanted, too.
    """

    part: Symmetry
    accuracy: float
    voltage: float
    end: float
    earliest: float
    instants: tuple[float, ...]
    goals: dict[str, str]
    trace_goals: dict[str, str]
    rises: tuple[str, ...]
    trace_rises: tuple[str, ...]
    ratios: dict[str, str]
    steady: Callable[[Outputs], Quantities]
    traces: Callable[[Outputs], Quantities]
    steady_scales: Callable[[Outputs], dict[str, float]]
    trace_scales: Callable[[Outputs], dict[str, float]]
    field: float | None = None
    extrapolated: bool = True
    from_start: bool = False
