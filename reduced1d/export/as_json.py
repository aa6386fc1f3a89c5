"""The few-state model as JSON."""

from __future__ import annotations

import json
from math import isfinite

from reduced1d.export.circuit import Circuit


def as_json(circuit: Circuit) -> str:
    """Every number of the model to full precision, with its equations, units and validity in words."""
    document = {
        "schema": 1,
        "model": circuit.name,
        "scene": circuit.scene,
        "equations": [
            "C_k dT_k/dt = -G_k T_k + I^2 (s_k + a sum_j F_kj T_j), T_k(0) = 0",
            "R = r + a sum_k s_k T_k, I = V / R",
            "rise = sum_k row_k T_k, temperature = room + rise",
        ],
        "input": {"V": "voltage across the electrodes, V"},
        "states": {"T": "parts of a rise, K", "count": circuit.states},
        "C_J_per_K": circuit.capacity.tolist(),
        "G_W_per_K": circuit.conductance.tolist(),
        "s_ohm": circuit.source.tolist(),
        "F_ohm": circuit.feedback.tolist(),
        "r_ohm": circuit.resistance,
        "a_1_per_K": circuit.coefficient,
        "room_temperature_K": circuit.room_temperature,
        "outputs": {f"{key}_rise_K": row.tolist() for key, row in circuit.outputs.items()},
        "validity": {
            "text": circuit.validity,
            "largest_voltage_V": abs(circuit.voltage),
            "highest_temperature_K": circuit.valid_to if isfinite(circuit.valid_to) else None,
            "first_time_s": circuit.first_time,
            f"deviation_from_{circuit.made_of}": circuit.deviations,
            "checked_at_V": list(circuit.checked),
            "remarks": list(circuit.remarks),
        },
    }
    return json.dumps(document, indent=1, allow_nan=False) + "\n"
