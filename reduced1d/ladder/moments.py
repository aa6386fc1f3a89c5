"""The plate, or a row's fin, with few states: its matrices projected on fields that match its response to the current.

The rise that a source s, switched on, causes in the linear plate has the Laplace transform (G + p C)^-1 s / p. Fields
(G + p C)^-1 s, ((G + p C)^-1 C)^j (G + p C)^-1 s span a space in which it is matched at the rate p with its first
derivatives in p; with G^-1 s its steady state is matched as well (Antoulas, Approximation of Large-Scale Dynamical
Systems, chapter 11). Galerkin's projection keeps the matrices symmetric, so that the reduced model is stable and loses
no heat. Two choices remain, the same for every sink: the steady field is that of the hot sink, so that the steady
state is the plate's; and p is the geometric mean of the slowest rate and of that of the first time of interest.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import csc_matrix, diags

from reduced1d.equations import room_resistivity
from reduced1d.ladder.few_states import OUTPUTS, FewStates, Matrices, in_modes
from reduced1d.ladder.plate import Plate, factorize
from reduced1d.ladder.steady import steady_state
from reduced1d.ladder.stream import current_through_pads

FIRST_TIME = 10e-6
"""From this time (s) on the response is to be right."""

PLATE_STATES = 24
"""With so many fields the projection is the plate to 1e-5 from the first time on."""

_DEPENDENT = 1e-10  # what is left of a field that lies in the span of those before it
_SETTLED = 1e-9  # of the rise: the change that ends the search for the steady state
_PATTERN = 1e-6  # of the rise: the change that ends that for the current's pattern, which falls by far more at a time
_MOST_PATTERNS = 30


class Fields:
    """Fields orthonormal in a conductance (n, n); ``values`` is (n, fields)."""

    def __init__(self, conductance: csc_matrix) -> None:
        self._conductance = conductance
        self._fields: list[np.ndarray] = []
        self._flows: list[np.ndarray] = []

    @property
    def values(self) -> np.ndarray:
        return np.array(self._fields).T

    def add(self, field: np.ndarray) -> np.ndarray | None:
        """The field's part that is new, normalized; ``None``, and nothing added, where nothing is."""
        whole = math.sqrt(field @ (self._conductance @ field))
        # Twice is enough (Kahan) for orthogonality to rounding.
        for _ in range(2 if self._fields else 0):
            field = field - np.array(self._fields).T @ (np.array(self._flows) @ field)
        flow = self._conductance @ field
        size = math.sqrt(max(float(field @ flow), 0.0))
        if not size > _DEPENDENT * whole:
            return None
        self._fields.append(field / size)
        self._flows.append(flow / size)
        return self._fields[-1]


def project(plate: Plate, fields: np.ndarray) -> FewStates:
    """The plate with rises that are combinations of fields (n, states)."""
    whole, beam = plate.current.whole, plate.current.beam
    matrices = Matrices(
        fields.T @ (plate.capacity @ fields), fields.T @ (plate.conductance @ fields),
        whole.source @ fields, fields.T @ (whole.feedback @ fields), whole.resistance,
        beam.source @ fields, beam.resistance, {name: getattr(plate, name) @ fields for name in OUTPUTS},
    )  # fmt: skip
    _, a = room_resistivity(plate.sink.silicon, plate.sink.room_temperature)
    return in_modes(matrices, a, plate.sink.voltage)


def hot(plate: Plate) -> tuple[Plate, np.ndarray]:
    """The plate with the current as it flows in the steady state, and that state's rise (n,).

    Raises RunawayError where there is no steady state.
    """
    if plate.sink.electrodes == "beam-end":
        # Straight along the beam whatever the temperature, but for 4e-7 at 1 V (the 3D model's number).
        return plate, _steady_rise(plate)
    plate = plate.carrying(current_through_pads(plate))
    rise = _steady_rise(plate)
    for _ in range(_MOST_PATTERNS if plate.sink.silicon.temperature_coefficient else 0):
        plate = plate.carrying(current_through_pads(plate, rise))
        before, rise = rise, _steady_rise(plate)
        if np.abs(rise - before).max() <= _PATTERN * np.abs(rise).max():
            return plate, rise
    return plate, rise


def _steady_rise(plate: Plate) -> np.ndarray:
    """From the fields G^-1 s, (G^-1 S) G^-1 s ... in whose span it is, as many as change it."""
    fields, whole = Fields(plate.conductance), plate.current.whole
    new = fields.add(plate.inverse.solve(whole.source))
    rise = np.zeros(plate.unknowns)
    while new is not None:
        before, rise = rise, _steady_in(plate, fields.values)
        change = np.abs(rise - before).max()
        if change <= _SETTLED * np.abs(rise).max() or not plate.sink.silicon.temperature_coefficient:
            break
        new = fields.add(plate.inverse.solve(whole.feedback @ new))
    return rise


def _steady_in(plate: Plate, fields: np.ndarray) -> np.ndarray:
    """The steady rise (n,) among combinations of fields that are orthonormal in the conductance."""
    model = project(plate, fields)
    squared = steady_state(model)[1] ** 2
    whole = plate.current.whole
    heating = np.eye(model.states) - model.coefficient * squared * fields.T @ (whole.feedback @ fields)
    return fields @ np.linalg.solve(heating, squared * (whole.source @ fields))


def moment_fields(plate: Plate, steady_rise: np.ndarray, count: int) -> np.ndarray:
    """(n, count): the steady field, then the moments at the rate p."""
    source = plate.current.whole.source
    return _fields(plate.conductance, plate.capacity, source, plate.inverse.solve(source), steady_rise, count)


def fewer(model: FewStates, count: int) -> FewStates:
    """A model of many states on the same fields of its own. Raises RunawayError."""
    conductance, capacity = (diags(v, format="csc") for v in (model.rates, np.ones(model.states)))
    rise = steady_state(model)[0]
    fields = _fields(conductance, capacity, model.source, model.source / model.rates, rise, count)
    matrices = Matrices(
        fields.T @ fields, fields.T @ (conductance @ fields), model.source @ fields,
        fields.T @ model.feedback @ fields, model.resistance, model.source_beam @ fields, model.resistance_beam,
        {name: row @ fields for name, row in model.outputs.items()},
    )  # fmt: skip
    return in_modes(matrices, model.coefficient, model.voltage)


def _fields(
    conductance: csc_matrix, capacity: csc_matrix, source: np.ndarray, cold: np.ndarray, steady: np.ndarray, count: int
) -> np.ndarray:
    """(n, count): a steady field, then the moments; ``cold`` is what the source does at its slowest."""
    slowest = float(cold @ (conductance @ cold)) / float(cold @ (capacity @ cold))
    inverse = factorize((conductance + math.sqrt(slowest / FIRST_TIME) * capacity).tocsc())
    fields = Fields(conductance)
    fields.add(steady)
    new = fields.add(inverse.solve(source)) if count > 1 else None
    while new is not None and len(fields.values.T) < count:
        new = fields.add(inverse.solve(capacity @ new))
    return fields.values
