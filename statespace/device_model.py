"""The device as a linear state-space model with two heated films, and as the document of a part of somebody's system.

In modes that decay on their own

    db/dt = -rates b + shape^T u,      rises = shape b + external T,      b jumps by -jump dT with the outer rise T

and the substrate's temperature is another such input; constant contributions are an offset of the rises. The first two
responses are the mean rises of sink and sensor, on which their resistances depend (eq 7), and the heat u (W) of the two
is the electrical power V^2/R (eqs 6, 7). Further responses are departures of a film's local temperature from its mean:
heat is rho J^2 with the resistivity of the place, so that u_j = P a dT_j / (1 + a dT), which moves heat and makes none.

In the document (`statespace.runtime`) inputs are both voltages and both temperatures, and the current fields belong to
the films, so that A c = S g is the circuit with its common lead. The states are b plus the jumps of both temperatures,
so that no input is differentiated. The heat that enters where a temperature is given follows from the heat equation
tested with the steady rise w per kelvin there: the rate of the stored heat weighed with w, and the heat that w
conducts, less the films' heat weighed with w.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scenes.device import Device
from statespace.circuit import settings
from statespace.document import described, in_kelvin


@dataclass(frozen=True, eq=False)
class Inlet:
    """A given temperature of a model, per kelvin.

    external : (m,), the steady rises (K/K)
    jump : (n,), the change of the modes by a step of the temperature
    flux : (k,), the steady heat flows (W/K)
    taken : the heat that enters where the temperature is given (W/K)
    """

    external: np.ndarray
    jump: np.ndarray
    flux: np.ndarray
    taken: float = 0.0


@dataclass(frozen=True, eq=False)
class Modal:
    """The model of a device, with n modes, m responses and k heat flows (W), flux b + flux_external T + feed u.

    rates : (n,), decay rates in 1/s, ascending
    shape : (m, n), rises per amplitude, and amplitudes per heat
    film : (m,), 0 where a response belongs to the sink, 1 for the sensor
    resistance, coefficient : (2,) of (sink, sensor), ohm at no rise, and 1/K
    external, jump : (m,), (n,), the response to the outer temperature, as of `Inlet`
    flux, flux_external, feed : (k, n), (k,), (k, m)
    substrate : the substrate's temperature as an input
    offset, flux_offset : (m,), (k,) or 0, constant rises and flows
    """

    rates: np.ndarray
    shape: np.ndarray
    film: np.ndarray
    resistance: np.ndarray
    coefficient: np.ndarray
    external: np.ndarray
    jump: np.ndarray
    flux: np.ndarray
    flux_external: np.ndarray
    feed: np.ndarray
    substrate: Inlet
    offset: np.ndarray | float = 0.0
    flux_offset: np.ndarray | float = 0.0

    @property
    def outside(self) -> Inlet:
        """The outer temperature as an input: all heat that leaves the polymer at rest enters there."""
        return Inlet(self.external, self.jump, self.flux_external, -float(self.flux_external[0]))

    def above_substrate(self, outer: float) -> Modal:
        """The model whose outer rise stays (K), and whose input is the substrate's temperature instead."""
        substrate = self.substrate
        return replace(
            self, external=substrate.external, jump=substrate.jump, flux_external=substrate.flux,
            offset=self.offset + outer * self.external, flux_offset=self.flux_offset + outer * self.flux_external,
        )  # fmt: skip

    def within(self, sums: np.ndarray) -> Modal:
        """The model of some ``sums`` (n, k) of its modes, which are orthonormal, in modes of its own."""
        rates, vectors = np.linalg.eigh(sums.T @ (self.rates[:, None] * sums))
        basis, substrate = sums @ vectors, self.substrate
        return replace(
            self, rates=rates, shape=self.shape @ basis, jump=self.jump @ basis, flux=self.flux @ basis,
            substrate=replace(substrate, jump=substrate.jump @ basis),
        )  # fmt: skip

    @property
    def count(self) -> int:
        return len(self.rates)

    @property
    def responses(self) -> int:
        return len(self.film)

    def heat(self, power: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """(m,): the heat u for powers (2,) at rises (m,) of the responses."""
        a, film = self.coefficient[self.film], self.film
        local = a * rise / (1 + a * rise[film])
        local[:2] = 1.0
        return power[film] * local


INPUTS = {
    "sink.voltage": ("V", "voltage"), "sensor.voltage": ("V", "voltage"),
    "outside.temperature": ("K", "temperature"), "substrate.temperature": ("K", "temperature"),
}  # fmt: skip
"""Unit and kind of each input."""
FILMS = ("sink", "sensor")
OUTPUTS = {
    **{f"{film}_K": "K" for film in FILMS}, **{f"{film}_ohm": "ohm" for film in FILMS},
    **{f"{film}_A": "A" for film in FILMS}, **{f"{film}_power_W": "W" for film in FILMS},
}  # fmt: skip
"""Unit of each output: mean temperatures, resistances as measured, currents, and powers in the films."""
GIVEN = 1 + len(INPUTS)
"""Number of entries of z = (1, inputs, states) before the states."""


def document(modal: Modal, device: Device, name: str, inputs: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Write the document of a model without errors; ``inputs`` has the value, rest, step and range of each input."""
    return _Maker(modal, device).document(name, inputs)


class _Maker:
    """Rows of z, with temperatures as rises above room until `in_kelvin`."""

    def __init__(self, modal: Modal, device: Device) -> None:
        self.modal, self.device = modal, device
        self.size = GIVEN + modal.count
        self.inlets = [modal.outside, modal.substrate]
        self.columns = [GIVEN - 2, GIVEN - 1]
        rises = np.zeros((modal.responses, self.size))
        rises[:, GIVEN:] = modal.shape
        for column, inlet in zip(self.columns, self.inlets, strict=True):
            rises[:, column] = inlet.external - modal.shape @ inlet.jump
        constant = np.eye(self.size)[0]
        # A film's resistance, and the heat of each response per current squared, which is affine like it.
        cold, change = modal.resistance[modal.film][:, None], modal.coefficient[modal.film][:, None]
        self.rises, self.heats = rises, cold * change * rises
        self.heats[:2] += cold[:2] * constant

    def document(self, name: str, inputs: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
        modal, device, ground = self.modal, self.device, self.device.control.ground_resistance
        F, Q = np.zeros((modal.count, self.size)), np.zeros((3, modal.count, self.size))
        F[:, GIVEN:] = -np.diag(modal.rates)
        for column, inlet in zip(self.columns, self.inlets, strict=True):
            F[:, column] = modal.rates * inlet.jump
        for response, film in enumerate(modal.film):
            Q[2 * film] += modal.shape[response][:, None] * self.heats[response]
        A, S = np.zeros((2, 2, self.size)), np.zeros((2, self.size))
        A[..., 0] = ground
        for e in (0, 1):
            A[e, e] += self.heats[e]
            S[e, 1 + e] = 1.0
        rows, outputs = self._rows(ground)
        ports = [len(rows) + k for k in range(len(INPUTS))]
        rows += [rows[outputs[f"{film}_A"][0]] for film in FILMS] + [self._entering(inlet) for inlet in self.inlets]
        matrices = {
            "A": A, "S": S, "F": F, "Q": Q, "Y": np.array([y for y, _, _ in rows]), "W": np.zeros((len(rows), 4)),
            "U": np.stack([u for _, u, _ in rows], axis=1), "P": np.stack([p for _, _, p in rows], axis=1),
        }  # fmt: skip
        in_kelvin(matrices, self.columns, device.sink.room_temperature)
        room, sink = device.sink.room_temperature, device.sink
        kelvin = [row for n, at in outputs.items() if OUTPUTS[n] == "K" for row in at]
        matrices["Y"][kelvin, 0] += room
        entries = [
            {"name": n, "unit": unit, "kind": kind, "of": n.partition(".")[0], **inputs[n],
             "port": {"row": row, "unit": "A" if kind == "voltage" else "W", "size": 1.0}}
            for (n, (unit, kind)), row in zip(INPUTS.items(), ports, strict=True)
        ]  # fmt: skip
        read = [
            {"name": n, "unit": OUTPUTS[n], "rows": at, "reduce": "mean" if len(at) == 1 else "measured"}
            for n, at in outputs.items()
        ]
        span = device.control.sample_time, device.end_time
        materials = sink.silicon, sink.oxide, device.gold, device.pdms
        controllers = settings(device, modal.resistance, modal.coefficient)
        return described(name, room, entries, read, matrices, span, materials) | {"controllers": controllers}

    def _row(self, y: Any = 0.0, u: Any = 0.0, p: Any = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coefficients of a row: of z, per current field (2, z), and per pair of fields (3, z)."""
        return np.zeros(self.size) + y, np.zeros((2, self.size)) + u, np.zeros((3, self.size)) + p

    def _rows(self, ground: float) -> tuple[list[tuple[np.ndarray, np.ndarray, np.ndarray]], dict[str, list[int]]]:
        """The rows of the outputs, and which are whose: a measured resistance with a common lead is made of four."""
        constant, rows = np.eye(self.size)[0], list[tuple[np.ndarray, np.ndarray, np.ndarray]]()
        outputs = dict[str, list[int]]()

        def current(film: int, factor: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            return self._row(u=factor * np.outer(np.eye(2)[film], constant))

        for e, film in enumerate(FILMS):
            parts = {"K": [self._row(self.rises[e])], "A": [current(e)],
                     "power_W": [self._row(p=np.outer(np.eye(3)[2 * e], self.heats[e]))],
                     "ohm": [self._row(self.heats[e] + ground * constant)]}  # fmt: skip
            if ground:
                parts["ohm"] += [current(1 - e, ground), current(e), self._row(np.eye(self.size)[1 + e])]
            for unit, each in parts.items():
                outputs[f"{film}_{unit}"] = list(range(len(rows), len(rows) + len(each)))
                rows += each
        return rows, {name: outputs[name] for name in OUTPUTS}

    def _entering(self, inlet: Inlet) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The heat (W) that enters where a temperature is given."""
        modal, pairs = self.modal, np.zeros((3, self.size))
        y = np.zeros(self.size)
        y[GIVEN:] = -modal.rates * inlet.jump
        below = self.modal.substrate
        for column, other in zip(self.columns, self.inlets, strict=True):
            # The heat that a kelvin of one draws at the other is the same both ways.
            conducted = inlet.taken if other is inlet else -float(below.flux[0])
            y[column] = inlet.jump @ (modal.rates * other.jump) + conducted
        for response, film in enumerate(modal.film):
            weight = float(modal.shape[response] @ inlet.jump - inlet.external[response])
            pairs[2 * film] += weight * self.heats[response]
        return self._row(y, p=pairs)
