"""The few-state model in units that a circuit has: every state a rise in K, with a capacity and a conductance."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from reduced1d.ladder.answer import over_time
from reduced1d.ladder.few_states import FewStates
from reduced1d.ladder.levels import Levels
from reduced1d.ladder.moments import FIRST_TIME
from reduced1d.ladder.validity import warnings


@dataclass(frozen=True, eq=False)
class Circuit:
    """C_k dT_k/dt = -G_k T_k + I^2 (s_k + alpha sum_j F_kj T_j),  R = r + alpha sum_k s_k T_k,  I = V / R.

    ``capacity`` (n,) in J/K, ``conductance`` (n,) in W/K, ``source`` (n,) in ohm, ``feedback`` (n, n) in ohm,
    ``resistance`` in ohm, ``coefficient`` in 1/K; ``outputs`` (n,) give rises in K. The rest says where it is valid:
    up to the ``voltage`` (V), from the ``first_time`` (s) on, to within ``deviations`` of the plate's final rises and
    change of current, found at the voltages ``checked``; ``remarks`` are where the plate itself is in doubt, and
    ``valid_to`` (K, infinite where nobody says) is where the silicon melts.
    """

    name: str
    scene: str
    capacity: np.ndarray
    conductance: np.ndarray
    source: np.ndarray
    feedback: np.ndarray
    resistance: float
    coefficient: float
    outputs: dict[str, np.ndarray]
    room_temperature: float
    voltage: float
    first_time: float
    end_time: float
    deviations: dict[str, float]
    checked: tuple[float, ...]
    remarks: tuple[str, ...]
    valid_to: float

    @property
    def states(self) -> int:
        """How many there are."""
        return len(self.capacity)

    @property
    def validity(self) -> str:
        """In words, one line."""
        worst = max(self.deviations.values())
        return (
            f"from rest, 0 to {abs(self.voltage):g} V, from {self.first_time * 1e6:g} us after a step on, "
            f"within {100 * worst:.2g} % of the plate model"
        )


def circuit_of(levels: Levels, name: str) -> Circuit:
    """The circuit of a sink's few-state reduction (its canonical name). Raises RunawayError."""
    from reduced1d.ladder import build

    sink = levels.sink
    model, plate = build(levels.fine, name), levels.fine.whole_plate()
    # Each state in units of what it adds to the peak or to the end, whichever is more; heated by a current.
    unit = np.maximum(np.abs(model.outputs["peak"]), np.abs(model.outputs["end"])) * np.sign(model.source)
    checked = (sink.voltage / 2, sink.voltage)
    return Circuit(
        name, sink.name, 1 / unit**2, model.rates / unit**2, model.source / unit,
        model.feedback / np.outer(unit, unit), model.resistance, model.coefficient,
        {key: model.outputs[key] / unit for key in ("peak", "end", "mean")},
        sink.room_temperature, sink.voltage, FIRST_TIME, sink.end_time,
        _deviations(model, plate, sink.end_time, checked),
        checked, tuple(warnings(sink, levels.fine.remainder)), sink.silicon.valid_to or math.inf,
    )  # fmt: skip


def _deviations(model: FewStates, plate: FewStates, end_time: float, voltages: tuple[float, ...]) -> dict[str, float]:
    """The largest distances from the plate at any of the voltages, from the first time on, of each quantity relative to
    its final value, of the current to its change."""
    late = np.geomspace(min(FIRST_TIME, end_time), max(end_time, 2 * FIRST_TIME), 100)
    found = dict.fromkeys(("peak_K", "end_K", "mean_K", "current_A"), 0.0)
    for voltage in voltages:
        ours, theirs = (over_time(replace(m, voltage=voltage), late) for m in (model, plate))
        for key in found:
            scale = abs(theirs[key][-1])
            if key == "current_A":
                scale = abs(theirs[key][-1] - voltage / plate.resistance) if plate.coefficient else scale
            found[key] = max(found[key], float(np.abs(ours[key] - theirs[key]).max()) / scale)
    return found
