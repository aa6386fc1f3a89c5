"""Quantities to compute for a scene, with their accuracy: the solver's only view of a run's purpose."""

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

    ``steady`` and ``traces`` compute the reported quantities from the outputs. ``steady_scales`` and ``trace_scales``
    compute the references of relative errors from the outputs (of the steady state where available). ``goals`` and
    ``trace_goals`` name the probe of a steady quantity, or of a trace; ``ratios`` map quantities to the goal with the
    same relative error. ``rises`` and ``trace_rises`` are the temperatures among the quantities.
    ``extrapolated``: whether steady quantities include the estimated change by higher degrees, where available.
    ``field``: tolerance of the steady field at any point, over its largest rise; None where the field is not used.
    Times in s: the ``end``, the ``earliest`` time at which the accuracy of traces holds, and ``instants`` that must be
    among the rows. ``voltage`` names the drive in messages.
    ``from_start``: whether errors before ``earliest`` are needed, too.
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
