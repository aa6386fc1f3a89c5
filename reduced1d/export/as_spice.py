"""The few-state model as a SPICE subcircuit: an RC pair for every state, heated by the current through the port."""

from __future__ import annotations

import numpy as np

from reduced1d.export.circuit import Circuit

_TEMPLATE = """\
* Heated sink "{scene}": {name}, {states} states. Thermal nodes in K above room temperature ({room:g} K) as volts,
* heat in W as amperes. Port: plus, minus. Outputs (rises, ideal voltage sources against node 0): {ports}.
* Valid {validity}.
* Written for ngspice and other simulators with behavioural (B) sources. Start from rest: 0 V before the step, or uic.
.subckt sink_model plus minus {ports}
* the circuit: the resistance follows the rise; node amps is the current
Bamps amps 0 V = V(plus,minus)/({resistance})
Bport plus minus I = V(amps)
* the states
{states_text}
* what is read off them
{outputs}
.ends sink_model
"""


def as_spice(circuit: Circuit) -> str:
    """The subcircuit's text."""
    names = [f"t{k + 1}" for k in range(circuit.states)]
    resistance = f"{circuit.resistance:.12g}{_sum(circuit.coefficient * circuit.source, names)}"
    lines = []
    for k, node in enumerate(names):
        heat = f"{circuit.source[k]:.12g}{_sum(circuit.coefficient * circuit.feedback[k], names)}"
        lines += [
            f"C{k + 1} {node} 0 {circuit.capacity[k]:.12g}",
            f"R{k + 1} {node} 0 {1 / circuit.conductance[k]:.12g}",
            f"B{k + 1} 0 {node} I = V(amps)*V(amps)*({heat})",
        ]
    outputs = [f"B{key} {key} 0 V = 0{_sum(row, names)}" for key, row in circuit.outputs.items()]
    return _TEMPLATE.format(
        scene=" ".join(circuit.scene.split()), name=circuit.name, states=circuit.states, room=circuit.room_temperature,
        validity=circuit.validity, ports=" ".join(circuit.outputs), resistance=resistance,
        states_text="\n".join(lines), outputs="\n".join(outputs),
    )  # fmt: skip


def _sum(factors: np.ndarray, names: list[str]) -> str:
    """ "+a*V(t1)-b*V(t2)": to be added to a number."""
    return "".join(f"{factor:+.12g}*V({name})" for factor, name in zip(factors, names, strict=True))
