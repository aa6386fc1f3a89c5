"""The SPICE subcircuit, by an independent evaluator of netlists."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from statespace.runtime import CompactModel
from statespace.spice import as_spice
from tests.statespace.test_runtime import document

Drive = Callable[[float], dict[str, float]]


class Circuit:
    """Kirchhoff's laws for R, C, V, E and B elements, the pins held at voltages; stepped by BDF2."""

    def __init__(self, text: str, pins: list[str]) -> None:
        body = re.sub(r"\n\+ ", " ", text).split(".subckt")[1].splitlines()[1:]
        self.elements = [line.split(None, 3) for line in body if line and line[0] not in "*."]
        names = {n for e in self.elements for n in e[1:3]} - {"0"}
        self.nodes, self.pins = sorted(names | set(pins)), pins
        self.sources = [e[0] for e in self.elements if e[0][0] in "VE" or (e[0][0] == "B" and e[3].startswith("V"))]
        self.code = [compile(self._python(e), e[0], "eval") for e in self.elements]

    @staticmethod
    def _python(element: list[str]) -> str:
        value = element[3].split("=")[1] if element[0][0] == "B" else element[3]
        if element[0][0] == "E":
            plus, _, gain = element[3].split()
            value = f"{gain}*V({plus})"
        return re.sub(r"([VI])\((\w+)\)", r'\1["\2"]', value).strip()

    def left(self, x: np.ndarray, rate: np.ndarray, given: dict[str, float]) -> np.ndarray:
        """The residuals: a current for every node, a voltage for every source."""
        count = len(self.nodes)
        V = dict(zip(self.nodes, x, strict=False)) | {"0": 0.0}
        dV = dict(zip(self.nodes, rate, strict=False)) | {"0": 0.0}
        I = dict(zip(self.sources, x[count:], strict=True))  # noqa: E741
        into = dict.fromkeys([*self.nodes, "0"], 0.0)
        volts = []
        for element, code in zip(self.elements, self.code, strict=True):
            name, plus, minus = element[:3]
            value = eval(code, {"V": V, "I": I, "max": max, "min": min})
            if name in I:
                volts.append(V[plus] - V[minus] - value)
                flow = I[name]
            elif name[0] == "B":
                flow = value
            else:
                flow = (V[plus] - V[minus]) / value if name[0] == "R" else value * (dV[plus] - dV[minus])
            into[plus] -= flow
            into[minus] += flow
        held = [V[n] - given[n] if n in given else into[n] for n in self.nodes]
        return np.array(held + volts)

    def solved(
        self, guess: np.ndarray, rate: Callable[[np.ndarray], np.ndarray], given: dict[str, float]
    ) -> np.ndarray:
        """Newton's method with differences for derivatives."""
        x = guess.copy()
        for _ in range(12):
            now = self.left(x, rate(x), given)
            steps = 1e-6 * np.maximum(np.abs(x), 1.0)
            columns = []
            for k, h in enumerate(steps):
                moved = x.copy()
                moved[k] += h
                columns.append((self.left(moved, rate(moved), given) - now) / h)
            change = np.linalg.solve(np.column_stack(columns), -now)
            x += change
            if np.abs(change).max() < 1e-9 * max(np.abs(x).max(), 1.0):
                return x
        raise AssertionError("no solution")

    def over_time(self, drive: Drive, end: float, steps: int) -> dict[str, float]:
        """The voltages at the end, from 0 V before."""
        h, size = end / steps, len(self.nodes) + len(self.sources)
        before, last = np.zeros(size), np.zeros(size)
        for k in range(1, steps + 1):
            if k == 1:
                before, last = last, self.solved(last, lambda x, b=last: (x - b) / h, drive(h))
                continue
            old, b = before, last
            before, last = b, self.solved(b, lambda x, o=old, b=b: (1.5 * x - 2 * b + 0.5 * o) / h, drive(k * h))
        return dict(zip(self.nodes, last, strict=False))


def steady(text: str, given: dict[str, float]) -> dict[str, float]:
    circuit = Circuit(text, list(given))
    size = len(circuit.nodes) + len(circuit.sources)
    return dict(zip(circuit.nodes, circuit.solved(np.zeros(size), np.zeros_like, given), strict=False))


def test_steady_with_an_extreme_and_two_current_fields() -> None:
    made = document(steady=True)
    expected = CompactModel(made).steady({"V": 1.2, "T": 2.6})
    found = steady(as_spice(made), {"V": 1.2, "T": 0.6})
    assert found["out_y"] == pytest.approx(expected["y"], rel=1e-8)
    assert found["out_t"] == pytest.approx(expected["t"] - 2.0, rel=1e-8)
    wrong = as_spice(made).replace("Rb2 b2 0 1", "Rb2 b2 0 1.01")
    assert steady(wrong, {"V": 1.2, "T": 0.6})["out_t"] != pytest.approx(expected["t"] - 2.0, rel=1e-8)


def test_over_time_with_a_ramp() -> None:
    """The first output follows the rate, too."""
    made = document()
    model = CompactModel(made)
    expected = model.simulate([1.0], {"V": 1.0, "T": ([0.0, 2.0], [2.0, 4.0])})
    found = Circuit(as_spice(made), ["V", "T"]).over_time(lambda t: {"V": 1.0, "T": t}, 1.0, 60)
    model.W[:] = 0
    still = model.simulate([1.0], {"V": 1.0, "T": ([0.0, 2.0], [2.0, 4.0])})
    assert found["out_t"] == pytest.approx(expected["t"][0] - 2.0, rel=1e-3)  # 60 steps leave 1e-4 or less
    assert found["out_t"] != pytest.approx(still["t"][0] - 2.0, rel=1e-3)


def test_heat_into_a_pin() -> None:
    """Watts into the pin of a heat source are its density times its volume."""
    made = document(steady=True)
    made["inputs"][1] |= {"kind": "heat_source", "unit": "W/m3", "port": {"row": 1, "unit": "K", "size": 4.0}}
    expected = CompactModel(made).steady({"V": 1.2, "T": 0.6})
    text = as_spice(made) + "Iheat 0 T 2.4\n"
    text = text.replace(".ends compact_model\nIheat 0 T 2.4", "Bheat 0 T I = 2.4\n.ends")
    assert steady(text, {"V": 1.2})["out_t"] == pytest.approx(expected["t"] - 2.0, rel=1e-8)
