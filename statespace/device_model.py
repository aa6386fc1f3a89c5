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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from scenes.device import Device
from scenes.errors import NumericsError
from statespace.circuit import settings, timetable
from statespace.controllers import Controllers
from statespace.document import described
from statespace.reduction import Reference, Row, StateSpace, not_reached, reduce, relative, worst
from statespace.result import DeviceResult
from statespace.runtime import CompactModel


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


def state_space(modal: Modal, device: Device) -> StateSpace:
    """Write a device's model as a state space with the `INPUTS` and `OUTPUTS`."""
    given, n, ground = 1 + len(INPUTS), modal.count, device.control.ground_resistance
    inlets, columns = (modal.outside, modal.substrate), (given - 2, given - 1)
    constant, pairs = np.eye(given + n)[0], np.eye(3)[[0, 2]]
    # Both temperatures as rises above room.
    warm = np.array([np.eye(given)[at] - device.sink.room_temperature * np.eye(given)[0] for at in columns])
    F, Q = np.hstack([np.zeros((n, given)), -np.diag(modal.rates)]), np.zeros((3, n, given + n))
    rises = np.hstack([np.column_stack([inlet.external for inlet in inlets]) @ warm, modal.shape])
    jump = np.column_stack([inlet.jump for inlet in inlets]) @ warm
    # A film's resistance, and the heat of each response per current squared, which is affine like it.
    cold, change = modal.resistance[modal.film][:, None], modal.coefficient[modal.film][:, None]
    heats = cold * change * rises
    heats[:2] += cold[:2] * constant
    for response, film in enumerate(modal.film):
        Q[2 * film] += modal.shape[response][:, None] * heats[response]
    A, S = np.zeros((2, 2, given + n)), np.zeros((2, given + n))
    A[..., 0] = ground
    for e in (0, 1):
        A[e, e] += heats[e]
        S[e, 1 + e] = 1.0

    def entering(inlet: Inlet) -> Row:
        """The heat (W) that enters where a temperature is given."""
        y, w = np.zeros(given + n), np.zeros(given)
        for rise, other in zip(warm, inlets, strict=True):
            # The heat that a kelvin of one draws at the other is the same both ways.
            y[:given] += rise * (inlet.taken if other is inlet else -float(modal.substrate.flux[0]))
            w += rise * (inlet.jump @ other.jump)
        of_films = zip(modal.film, inlet.external[:, None] * heats, strict=True)
        return Row(y, w[1:], inlet.jump, p=-sum(np.outer(pairs[film], heat) for film, heat in of_films))

    current = [Row(u=np.outer(np.eye(2)[e], constant)) for e in (0, 1)]
    rows: dict[str, list[Row]] = {}
    for e, film in enumerate(FILMS):
        rows[f"{film}_K"], rows[f"{film}_A"] = [Row(rises[e])], [current[e]]
        rows[f"{film}_power_W"] = [Row(p=np.outer(pairs[e], heats[e]))]
        rows[f"{film}_ohm"] = seen = [Row(heats[e] + ground * constant)]
        if ground:
            seen += [ground * current[1 - e], current[e], Row(np.eye(given + n)[1 + e])]
    outputs = {name: (rows[name], "mean" if len(rows[name]) == 1 else "measured", u) for name, u in OUTPUTS.items()}
    ports = [*((row, "A", 1.0) for row in current), *((entering(inlet), "W", 1.0) for inlet in inlets)]
    system, kelvin = {"A": A, "S": S, "F": F, "Q": Q, "I": jump}, float(np.abs(modal.shape[:2, 0]).max())
    return StateSpace.of_rows(system, outputs, ports, kelvin)


DEVICE = "the device's model"
LOOP = "closed loop"
VOLTAGES = tuple(f"{film}_V" for film in FILMS)


@dataclass(frozen=True, eq=False)
class Whole:
    """The model that is exported, with its ``name`` in the files and the ``result`` of its closed loop.

    steady_errors : errors of the steady state after the outer step, by quantity
    others : models whose distance, times a factor, bounds the model's own error
    """

    name: str
    device: Device
    modal: Modal
    result: DeviceResult
    steady_errors: Mapping[str, float]
    others: Sequence[tuple[Modal, float]]


def compact(
    whole: Whole, states: int | None, accuracy: float, say: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """Make the document of a device's compact model.

    Parameters
    ----------
    whole : Whole
        The model that is exported.
    states : int or None
        Number of states; None for as many as the accuracy takes.
    accuracy : float
        Largest relative error.

    Raises
    ------
    NumericsError
        Where the closed loop cannot be followed to its end.
    """
    judge = _Judge(whole, max(1e-2 * accuracy, 1e-8))
    if whole.result.details.get("stopped"):
        raise NumericsError("the closed loop runs away, and no model of few states is held against that: no --export")
    most, count = whole.modal.count, states
    while True:
        say("compact model: states")
        made, _ = reduce(judge.document, most, judge.references, accuracy, count, DEVICE)
        say(f"compact model: the closed loop with {made['states']} states")
        made["error"] = {LOOP: judge.closed(CompactModel(made))} | made["error"]
        reached = worst(made["error"])
        if states is not None or reached <= accuracy or made["warnings"] or made["states"] == most:
            missed = states is None and reached > accuracy
            warnings = [not_reached(accuracy, DEVICE, reached)] if missed else []
            return made | {"estimated": judge.estimated(len(made["error"])), "warnings": warnings}
        count = min(int(np.ceil(1.25 * made["states"])), most)


class _Judge:
    def __init__(self, whole: Whole, tolerance: float) -> None:
        self.whole, self.device, self.modal, self.tolerance = whole, whole.device, whole.modal, tolerance
        self.room = self.device.sink.room_temperature
        self.times = np.geomspace(self.device.control.sample_time, self.device.end_time, 20)

    def document(self, count: int) -> dict[str, Any]:
        """The model of some states, without its errors."""
        return self._described(self._space.within(self._order[:, :count]), self.modal)

    def _described(self, space: StateSpace, modal: Modal) -> dict[str, Any]:
        device = self.device
        entries = [
            {"name": n, "unit": unit, "kind": kind, "of": n.partition(".")[0], **self.inputs[n]}
            for n, (unit, kind) in INPUTS.items()
        ]
        span = device.control.sample_time, device.end_time
        materials = device.sink.silicon, device.sink.oxide, device.gold, device.pdms
        document = described(self.whole.name, self.room, entries, space, span, materials)
        return document | {"controllers": settings(device, modal.resistance, modal.coefficient)}

    @cached_property
    def _space(self) -> StateSpace:
        return state_space(self.modal, self.device)

    @cached_property
    def _order(self) -> np.ndarray:
        """(n, n): sums of modes, ordered by their effect on the outputs."""
        h, inputs = self.device.control.sample_time, self.inputs.values()
        steps, rest = (np.array([entry[key] for entry in inputs]) for key in ("step", "rest"))
        return self._space.leading(steps, rest, (h, max(1 / self.modal.rates[0], h)))

    def estimated(self, runs: int) -> dict[str, Any]:
        text = [
            "Rise: the set temperature's, and what that changes a resistance by; else the largest of the closed loop.",
            "Estimated: the distance from the closed loop as the whole model runs it, and from the whole model for a "
            "step of each input alone from rest, with that model's own error.",
        ]
        if self.device.control.ground_resistance:
            text.append("A measured resistance is that behind the common lead to ground.")
        return {"runs": runs, "more_states": self.modal.count, "text": text}

    @cached_property
    def inputs(self) -> dict[str, dict[str, Any]]:
        """Value, rest, step and range of each input.

        A voltage has its value in the steady state after the outer step, and a step that alone brings its film to the
        set rise; a temperature steps by the largest change outside.
        """
        modal, result, device = self.modal, self.whole.result, self.device
        external, room = device.external, self.room
        alone = np.einsum("en,n,en->e", modal.shape[:2], 1 / modal.rates, modal.shape[:2])
        hot = modal.resistance * (1 + modal.coefficient * device.set_rise)
        volts = np.sqrt(device.set_rise / alone * (hot + device.control.ground_resistance))
        inputs = dict[str, dict[str, Any]]()

        def add(name: str, value: Any, rest: float, step: float, *tried: float) -> None:
            tried = (rest, rest + step, *tried)
            inputs[name] = {"value": value, "rest": rest, "step": step, "range": [min(tried), max(tried)]}

        for e, film in enumerate(FILMS):
            trace, value = result.trace(f"{film}_V"), float(getattr(result.after, f"{film}_V"))
            add(f"{film}.voltage", value, 0.0, float(volts[e]), value, float(trace.min()), float(trace.max()))
        outer = [external.initial_temperature, external.final_temperature]
        step = max((t - room for t in outer), key=abs) or 1.0
        add("outside.temperature", {"times": [external.step_time] * 2, "values": outer}, room, step, *outer)
        add("substrate.temperature", room, room, abs(step))
        return inputs

    @cached_property
    def _scales(self) -> dict[str, float]:
        """The size that errors of each output are relative to."""
        result, modal, device = self.whole.result, self.modal, self.device
        scales = dict[str, float]()
        for e, film in enumerate(FILMS):
            power, change = result.trace(f"{film}_power_W"), modal.coefficient[e] * device.set_rise
            cold = float(modal.resistance[e])
            warm = cold * (1 + modal.coefficient[e] * (result.trace(f"{film}_K") - self.room))
            scales |= {
                f"{film}_K": device.set_rise, f"{film}_ohm": cold * abs(float(change)),
                f"{film}_A": float(np.sqrt(power / warm).max()), f"{film}_power_W": float(power.max()),
                f"{film}_V": float(np.abs(result.trace(f"{film}_V")).max()),
            }  # fmt: skip
        # A film that never has any power takes the scales of the other one.
        for quantity in ("A", "power_W", "V"):
            most = max(scales[f"{film}_{quantity}"] for film in FILMS) or 1.0
            scales |= {f"{film}_{quantity}": scales[f"{film}_{quantity}"] or most for film in FILMS}
        return scales

    def closed(self, model: CompactModel) -> dict[str, Any]:
        """Bound the errors of a model in the closed loop, which it and the controllers run as their FMUs do."""
        result, scales = self.whole.result, self._scales
        rows, at_rest = closed_loop(model, self.device, len(result.time_s)), model.steady()
        over_time = {
            name: relative(float(np.abs(rows[name] - result.trace(name)).max()) + result.errors[name], scales[name])
            for name in (f"{film}_{quantity}" for film in FILMS for quantity in ("K", "power_W", "V"))
        }
        steady = {
            name: relative(abs(at_rest[name] - getattr(result.after, name)) + self.whole.steady_errors.get(name, 0.0),
                           scales[name])
            for name in (f"{film}_{quantity}" for film in FILMS for quantity in ("K", "power_W"))
        }  # fmt: skip
        return {"steady": steady, "over time": over_time}

    @cached_property
    def references(self) -> dict[str, list[Reference]]:
        """A step of each input alone from rest by the whole model, in the steady state and over time."""
        modals = self.modal, *(modal for modal, _ in self.whole.others)
        models = [CompactModel(self._described(state_space(m, self.device), m)) for m in modals]
        references = {}
        for name in INPUTS:
            drive = {n: entry["rest"] + entry["step"] * (n == name) for n, entry in self.inputs.items()}
            steady: list[Any] = [model.steady(drive) for model in models]
            over_time: list[Any] = [model.simulate(self.times, drive, self.tolerance) for model in models]
            references[f"step of {name}"] = [
                Reference(drive, times, exact, self._apart(exact, others), self._scales)
                for times, (exact, *others) in ((None, steady), (self.times, over_time))
            ]
        return references

    def _apart(self, exact: Mapping[str, Any], others: Sequence[Mapping[str, Any]]) -> dict[str, float]:
        """The error of the whole model by its distance from others."""
        pairs = list(zip(others, (factor for _, factor in self.whole.others), strict=True))
        return {n: sum(f * float(np.abs(other[n] - exact[n]).max()) for other, f in pairs) for n in OUTPUTS}


def closed_loop(model: CompactModel, device: Device, samples: int) -> dict[str, np.ndarray]:
    """(samples,) of each output and voltage: a compact model under its controllers, by the device's outer steps.

    At each sample temperatures and resistances are read, the voltages follow, and then currents and powers are read.
    """
    control = Controllers(model.document["controllers"])
    g = model.inputs_at({"outside.temperature": device.sink.room_temperature}, 0.0)
    g[:2] = 0.0
    b, still, room = np.zeros(model.states), np.zeros(len(g)), device.sink.room_temperature
    rows = {name: np.zeros(samples) for name in (*OUTPUTS, *VOLTAGES)}
    for k, measure, outer, length in timetable(device).stretches():
        if k >= samples:
            break
        if measure:
            before = model.named(model.read(g, still, b))
            g[:2] = control.sample([before[f"{film}_ohm"] for film in FILMS])
            after = model.named(model.read(g, still, b))
            for name in OUTPUTS:
                rows[name][k] = (before if name.endswith(("_K", "_ohm")) else after)[name]
            for e, name in enumerate(VOLTAGES):
                rows[name][k] = g[e]
        if outer is not None:
            g[2] = room + outer
        if length:
            b = model.step(b, g, length)
    return rows
