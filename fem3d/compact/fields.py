"""The fields of a compact model: rational Krylov fields of all loads.

A field (M + g K)^-1 F for every load F, at g = infinity (the steady response) and at shifts g between the earliest time
and the slowest response, which are added where the residual is large. Source: Ruhe, Linear
Algebra Appl. 58, 1984; Antoulas, Approximation of Large-Scale Dynamical Systems, 2005, chapter 11.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.solution.reduced import Reduced, orthonormal
from fem3d.solution.transient import Base

FIRST, MOST = 4, 16  # how many shifts to begin with, and at most
SOONER = 3.0  # the first shift of the Krylov fields is the earliest time over this


def slowest(heat: HeatProblem) -> float:
    """Return the relaxation time (s) of a uniformly heated structure."""
    n = heat.free
    load = (heat.mass @ heat.unit)[:n]
    return float(heat.unit[:n] @ (heat.inner_mass @ heat.solve_steady(load)) / max(heat.unit[:n] @ load, 1e-300))


def jumps_of(heat: HeatProblem, steps: np.ndarray) -> list[np.ndarray]:
    """Return the heat (J, all nodes) that a step of each given temperature, of size ``steps`` (channels,), takes at
    once; as a state, it decays from then on."""
    return [s * (heat.mass @ lift) for s, lift in zip(steps[1:], heat.lifts[1:], strict=True) if lift.any()]


def loads_of(base: Base, steps: np.ndarray) -> list[np.ndarray]:
    """Return the loads (W, all nodes) of a model, scaled by the inputs' steps (channels,): the load of every channel,
    the Joule heat of every pair of current fields, and its change by temperature."""
    heat, conductor = base.heat, base.conductor
    loads = [s * v for s, v in zip(steps[1:], heat.loads[1:], strict=True) if v.any()]
    if not heat.anchored:
        loads += [s * (heat.stiffness @ v) for s, v in zip(steps[1:], heat.lifts[1:], strict=True) if v.any()]
    if conductor is not None:
        loads += _joule(heat, conductor, base, steps)
    return loads


def _joule(heat: HeatProblem, conductor: Conductor, base: Base, steps: np.ndarray) -> list[np.ndarray]:
    n, none = heat.free, np.zeros(heat.size)
    driven = [c for c, v in enumerate(conductor.voltages) if c and v.any()]
    size = max((float(steps[c]) for c in driven), default=0.0) ** 2
    lifts = [s * lift for s, lift in zip(steps[1:], heat.lifts[1:], strict=True) if lift.any()]
    loads = []
    for i, a in enumerate(base.patterns):
        for b in base.patterns[: i + 1]:
            cold = size * conductor.joule_load(a.density, none, b.density)
            loads.append(cold)
            if conductor.warms:
                warmed = [heat.whole(heat.solve_steady(cold[:n])), *lifts]
                loads += [size * conductor.joule_load(a.density, u, b.density) - cold for u in warmed]
    return [load for load in loads if load.any()]


def rational(heat: HeatProblem, loads: list[np.ndarray], times: tuple[float, float] | None, enough: float) -> Any:
    """(free nodes, fields): the fields of some loads for times (s) from the earliest to the slowest, or of the steady
    state alone, until the residual at any shift between is below ``enough`` of its load."""
    n = heat.free
    each = [load[:n] for load in loads]
    fields = [heat.solve_steady(load) for load in each]
    if times is None or not each:
        return np.column_stack(fields) if fields else np.empty((n, 0))
    shifts = np.geomspace(times[0] / SOONER, max(times), FIRST).tolist()
    missing = shifts
    while True:
        for shift in missing:
            solve = heat.solve_shifted(shift)
            fields += [solve(load) for load in each]
        basis = orthonormal(heat, np.column_stack(fields))
        between = [float(np.sqrt(a * b)) for a, b in pairwise(shifts)]
        missing = [g for g in between if _residual(heat, basis, each, g) > enough]
        if not missing or len(shifts) >= MOST:
            return basis
        shifts = sorted([*shifts, *missing])


def _residual(heat: HeatProblem, basis: np.ndarray, loads: list[np.ndarray], shift: float) -> float:
    """Estimate the largest relative error of (M + g K) u = F in the fields, in the energy norm. The diagonal of
    the matrix suffices: the residual is orthogonal to the fields, hence rough."""
    mass, stiffness = heat.inner_mass, heat.inner_stiffness
    product = mass @ basis + shift * (stiffness @ basis)
    weight = 1 / (mass.diagonal() + shift * stiffness.diagonal())
    F = np.column_stack(loads)
    tested = basis.T @ F
    solution = np.linalg.solve(basis.T @ product, tested)
    residual = F - product @ solution
    return float(np.sqrt(((weight[:, None] * residual**2).sum(axis=0) / (tested * solution).sum(axis=0)).max()))


def responses(
    reduced: Reduced, loads: list[np.ndarray], jumps: list[np.ndarray], times: tuple[float, float] | None
) -> np.ndarray:
    """(states, any): the reduced responses to loads, at rest and over time, and to jumps."""
    n = len(reduced.basis)
    rates, modes = np.linalg.eigh((reduced.stiffness + reduced.stiffness.T) / 2)
    rates = np.maximum(rates, 1e-12 * rates[-1])

    def inner(vectors: list[np.ndarray]) -> np.ndarray:
        kept = np.column_stack([v[:n] for v in vectors]) if vectors else np.empty((n, 0))
        product: np.ndarray = modes.T @ (reduced.basis.T @ kept)
        return product

    heating, decaying = inner(loads), inner(jumps)
    responses = [heating / rates[:, None]]
    for g in [] if times is None else np.geomspace(times[0] / SOONER, max(times), 12):
        responses += [g * heating / (1 + g * rates)[:, None], decaying / (1 + g * rates)[:, None]]
    return np.asarray(modes @ np.column_stack(responses))
