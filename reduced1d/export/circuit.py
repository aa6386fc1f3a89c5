"""The few-state model in units that a circuit has: every state a rise in K, with a capacity and a conductance."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from reduced1d.ladder.anchor import warnings
from reduced1d.ladder.few_states import FIRST_TIME, FewStates, over_time
from reduced1d.ladder.levels import Levels
from scenes.sink import Sink, different


@dataclass(frozen=True, eq=False)
class Circuit:
    """C_k dT_k/dt = -G_k T_k + I^2 (s_k + alpha sum_j F_kj T_j),  R = r + alpha sum_k s_k T_k,  I = V / R.

    ``capacity`` (n,) in J/K, ``conductance`` (n,) in W/K, ``source`` (n,) in ohm, ``feedback`` (n, n) in ohm,
    ``resistance`` in ohm, ``coefficient`` in 1/K; ``outputs`` (n,) give rises in K. The rest says where it is valid:
    up to the ``voltage`` (V), from the ``first_time`` (s) on, to within ``deviations`` of the final rises and the
    change of current of the model that it is ``made_of``, found at the voltages ``checked``; ``remarks`` are where that
    itself is in doubt, and ``valid_to`` (K, infinite where nobody says) is where the silicon melts.
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
    made_of: str
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
            f"within {100 * worst:.2g} % of the {self.made_of} model"
        )


def circuit_of(levels: Levels, name: str) -> Circuit:
    """The circuit of a sink's few-state reduction (its canonical name). Raises RunawayError."""
    from reduced1d.ladder import build

    sink = levels.sink
    model, (made_of, whole) = build(levels.fine, name), levels.fine.most()
    outputs = _rises(sink)
    # Each state in units of what it adds to a place, to whichever it is most; heated by a current.
    places = np.array([model.outputs[name] for name in outputs if not name.endswith("mean")])
    unit = np.abs(places).max(axis=0) * np.sign(model.source)
    checked = (model.voltage / 2, model.voltage)
    return Circuit(
        name, sink.name, 1 / unit**2, model.rates / unit**2, model.source / unit,
        model.feedback / np.outer(unit, unit), model.resistance, model.coefficient,
        {key: model.outputs[key] / unit for key in outputs},
        sink.room_temperature, model.voltage, FIRST_TIME, sink.end_time, made_of,
        _deviations(model, whole, sink.end_time, checked, outputs),
        checked, tuple(warnings(sink, levels.fine.remainder)), sink.silicon.valid_to or math.inf,
    )  # fmt: skip


def _rises(sink: Sink) -> tuple[str, ...]:
    """What is read off the states: of a row the end, the mean, and the middle and the mean of each span."""
    if sink.spans == 1:
        return "peak", "end", "mean"
    spans = range(1, different(sink.spans) + 1)
    return "end", "mean", *(f"span{number}_{what}" for number in spans for what in ("middle", "mean"))


def _deviations(
    model: FewStates, whole: FewStates, end_time: float, voltages: tuple[float, ...], rises: tuple[str, ...]
) -> dict[str, float]:
    """The largest distances from the whole model at any of the voltages, from the first time on, of each rise relative
    to its final value, of the current to its change."""
    late = np.geomspace(min(FIRST_TIME, end_time), max(end_time, 2 * FIRST_TIME), 100)
    found = dict.fromkeys((*(f"{name}_K" for name in rises), "current_A"), 0.0)
    for voltage in voltages:
        ours, theirs = (over_time(replace(m, voltage=voltage), late) for m in (model, whole))
        for key in found:
            scale = abs(theirs[key][-1])
            if key == "current_A":
                scale = abs(theirs[key][-1] - voltage / whole.resistance) if whole.coefficient else scale
            found[key] = max(found[key], float(np.abs(ours[key] - theirs[key]).max()) / scale)
    return found
