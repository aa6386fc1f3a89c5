"""The plate, or a row's fin, with few states: its matrices projected on fields that match its response to the current.

The rise that a source s, switched on, causes in the linear plate has the Laplace transform (G + p C)^-1 s / p. Fields
(G + p C)^-1 s, ((G + p C)^-1 C)^j (G + p C)^-1 s span a space in which it is matched at the rate p with its first
derivatives in p; with G^-1 s its steady state is matched as well (Antoulas, Approximation of Large-Scale Dynamical
Systems, chapter 11). Galerkin's projection keeps the matrices symmetric, so that the reduced model is stable and loses
no heat. Two choices remain, the same for every sink: the steady field is the hot sink's, so that the steady
state is the plate's; and p is the geometric mean of the slowest rate and one over the first time of interest.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from reduced1d.ladder.few_states import FewStates, steady_state
from reduced1d.ladder.plate import Plate, current_through_pads, factorize
from scenes.checks import FIRST_TIME

PLATE_STATES = 24
"""With so many fields the projection equals the plate to 1e-5 at all times that are compared."""


def added(fields: np.ndarray, field: np.ndarray, model: FewStates) -> np.ndarray | None:
    """Fields (n, states), orthonormal in the model's conductance, extended by another; ``None`` if it depends on
    them."""
    whole = math.sqrt(field @ (model.conductance @ field))
    # Twice is enough (Kahan) for orthogonality to rounding.
    for _ in range(2):
        field = field - fields @ (fields.T @ (model.conductance @ field))
    size = math.sqrt(max(float(field @ (model.conductance @ field)), 0.0))
    return np.column_stack([fields, field / size]) if size > 1e-10 * whole else None


def hot(plate: Plate) -> tuple[Plate, np.ndarray]:
    """The plate with the current as it flows in the steady state, and that state's rise (n,).

    Raises RunawayError where there is no steady state.
    """
    if plate.sink.electrodes == "beam-end":
        # Straight along the beam whatever the temperature, but for 4e-7 at 1 V (the 3D model's number).
        return plate, steady_rise(plate.model, plate.inverse)
    plate = plate.carrying(*current_through_pads(plate))
    rise = steady_rise(plate.model, plate.inverse)
    for _ in range(30 if plate.model.coefficient else 0):
        plate = plate.carrying(*current_through_pads(plate, rise))
        before, rise = rise, steady_rise(plate.model, plate.inverse)
        # Each step gains far more than this change.
        if np.abs(rise - before).max() <= 1e-6 * np.abs(rise).max():
            break
    return plate, rise


def steady_rise(model: FewStates, inverse: Any) -> np.ndarray:
    """From the fields G^-1 s, (G^-1 S) G^-1 s ... in whose span it is, as many as change it; ``inverse`` are the
    factors of G."""
    rise = np.zeros(model.states)
    fields = added(np.empty((model.states, 0)), inverse.solve(model.source), model)
    while fields is not None:
        before, small = rise, model.on(fields)
        squared = steady_state(small.in_modes())[1] ** 2
        heating = np.eye(small.states) - model.coefficient * squared * small.feedback
        rise = fields @ np.linalg.solve(heating, squared * small.source)
        if np.abs(rise - before).max() <= 1e-9 * np.abs(rise).max() or not model.coefficient:
            break
        fields = added(fields, inverse.solve(model.feedback @ fields[:, -1]), model)
    return rise


def projected(model: FewStates, inverse: Any, steady: np.ndarray, count: int) -> FewStates:
    """The model on a ``steady`` field (n,) and moments, with some states; ``inverse`` are the factors of G."""
    return model.on(moment_fields(model, inverse.solve(model.source), steady, count)).in_modes()


def moment_fields(model: FewStates, cold: np.ndarray, steady: np.ndarray, count: int) -> np.ndarray:
    """(n, count): a steady field, then the moments at the rate p; ``cold`` is the steady response of the cold sink."""
    from scipy.sparse import csc_matrix

    fields = added(np.empty((model.states, 0)), steady, model)
    if fields is None or count == 1:
        return np.empty((model.states, 0)) if fields is None else fields
    slowest = float(cold @ (model.conductance @ cold)) / float(cold @ (model.capacity @ cold))
    rate = math.sqrt(slowest / FIRST_TIME)
    solve, heat = factorize(csc_matrix(model.conductance + rate * model.capacity)).solve, model.source
    while fields.shape[1] < count and (more := added(fields, solve(heat), model)) is not None:
        fields, heat = more, model.capacity @ more[:, -1]
    return fields
