"""The few-state model as a Python file that needs nothing but Python."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite

from reduced1d.export.circuit import Circuit

_TEMPLATE = '''\
"""Heated sink "{scene}": {name}, {states} states, from rest at room temperature, without any package.
Valid {validity}."""
from math import exp
from warnings import warn

C = {capacity}  # J/K
G = {conductance}  # W/K
S = {source}  # W/A^2
F = {feedback}  # W/A^2
R0, ALPHA, ROOM = {resistance}, {coefficient}, {room}  # ohm, 1/K, K
ROWS = {{{rows}}}
LIMITS = {volts}, {hottest}  # V, K: what the model was checked up to, and where silicon melts


def sink(times, voltage={voltage}, longest_step={longest}):
    """Temperatures (K) and current (A) at ascending times (s) for a voltage (V), a number or a function of time."""
    volts = voltage if callable(voltage) else lambda t: voltage
    def current(t, T):
        return volts(t) / (R0 + ALPHA * sum(s * x for s, x in zip(S, T)))
    def heat(t, T):
        square = current(t, T) ** 2
        return [square * (s + ALPHA * sum(f * x for f, x in zip(row, T))) for s, row in zip(S, F)]
    t, T, found = 0.0, [0.0] * len(C), {{name: [] for name in (*ROWS, "current_A")}}
    for target in times:
        while t < target:  # exponential Runge-Kutta of order 2: conduction exact, heat linear within a step
            h = min(target - t, 1e-8 + t / 20, longest_step)
            decay, p = [exp(-g * h / c) for g, c in zip(G, C)], heat(t, T)
            T = [x * d + q * (1 - d) / g for x, d, q, g in zip(T, decay, p, G)]
            t = target if h == target - t else t + h
            T = [x + (n - o) / g * (1 - (1 - d) * c / (g * h))
                 for x, n, o, d, g, c in zip(T, heat(t, T), p, decay, G, C)]
        for name, row in ROWS.items():
            found[name].append(ROOM + sum(r * x for r, x in zip(row, T)))
        found["current_A"].append(current(t, T))
    hottest = [max(found[name][k] for name in ROWS) for k in range(len(found["current_A"]))]
    for unit, values, limit in zip("VK", ([abs(volts(t)) for t in times], hottest), LIMITS):
        if max(values, default=0.0) > limit * (1 + 1e-9):
            warn(f"{{max(values):.6g}} {{unit}} is past the model's range, up to {{limit:.6g}} {{unit}}", stacklevel=2)
    return found
'''


def as_python(circuit: Circuit) -> str:
    """The file's text: the model's numbers and one function of 29 lines."""
    feedback = ",\n     ".join(_list(row) for row in circuit.feedback)
    return _TEMPLATE.format(
        scene=circuit.scene.replace("\\", "/").replace('"', "'"), name=circuit.name, states=circuit.states,
        validity=circuit.validity, capacity=_list(circuit.capacity), conductance=_list(circuit.conductance),
        source=_list(circuit.source), feedback=f"[{feedback}]", resistance=f"{circuit.resistance:.12g}",
        coefficient=repr(circuit.coefficient), room=repr(circuit.room_temperature), voltage=repr(circuit.voltage),
        longest=repr(circuit.end_time / 200), volts=repr(abs(circuit.voltage)),
        hottest=f'{circuit.valid_to:.12g}' if isfinite(circuit.valid_to) else 'float("inf")',
        rows=",\n        ".join(f'"{key}_K": {_list(row)}' for key, row in circuit.outputs.items()),
    )  # fmt: skip


def _list(numbers: Iterable[float]) -> str:
    """Twelve digits, which is more than the model is worth."""
    return f"[{', '.join(f'{number:.12g}' for number in numbers)}]"
