"""Reduce a model to the fewest states that hold an accuracy, judged by runs of the full model; and a device's model so.

The states of a rich model are ordered by their effect on the outputs; the compact model is the smallest leading part
that stays within the accuracy of every reference run, the error bound of the run included. A device is judged by its
closed loop and by a step of every input alone, relative to the set temperature's rise, to its change of a resistance,
and to the largest voltage, current and power of the closed loop.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from scenes.device import Device
from scenes.errors import NumericsError
from statespace.circuit import timetable
from statespace.controllers import Controllers
from statespace.device_model import FILMS, INPUTS, OUTPUTS, Modal, document
from statespace.result import DeviceResult
from statespace.runtime import CompactModel, Given

Errors = dict[str, dict[str, dict[str, dict[str, float]]]]
"""By run, kind ("steady" or "over time") and output: the "error" in its unit and the "relative" one."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A run of the full model, with the value of each input by its name.

    times : (n,), instants in s at which the outputs are compared; None in the steady state
    values, errors, scales : by output, values (n,) or a number, their error bound, and the size of relative errors
    """

    inputs: Mapping[str, Given]
    times: np.ndarray | None
    values: Mapping[str, np.ndarray]
    errors: Mapping[str, float]
    scales: Mapping[str, float]

    @property
    def kind(self) -> str:
        return "steady" if self.times is None else "over time"

    def compare(self, model: CompactModel) -> dict[str, dict[str, float]]:
        """Bound the errors of a model: its distance from this run plus the error bound of the run."""
        found: Mapping[str, Any]
        found = model.steady(self.inputs) if self.times is None else model.simulate(self.times, self.inputs)
        return {
            name: relative(float(np.abs(found[name] - value).max()) + self.errors[name], self.scales[name])
            for name, value in self.values.items()
        }


def relative(error: float, scale: float) -> dict[str, float]:
    return {"error": error, "relative": error / scale}


def compare(model: CompactModel, references: Mapping[str, Sequence[Reference]]) -> Errors:
    """Bound the errors of a model by each of several runs."""
    return {name: {run.kind: run.compare(model) for run in runs} for name, runs in references.items()}


def worst(errors: Errors) -> float:
    """Return the largest relative error."""
    return max(e["relative"] for run in errors.values() for kind in run.values() for e in kind.values())


def reduce(
    document: Callable[[int], dict[str, Any]], most: int, references: Mapping[str, Sequence[Reference]],
    accuracy: float, states: int | None, full: str,
) -> dict[str, Any]:  # fmt: skip
    """Find the model of fewest states within an accuracy.

    Parameters
    ----------
    document : callable
        The document of the model of the first n states, without errors.
    most : int
        Number of states of the rich model.
    references : Mapping
        Runs of the full model by name.
    accuracy : float
        Largest relative error.
    states : int or None
        A number of states to take whatever the error, or None.
    full : str
        Name of the full model in messages.

    Returns
    -------
    dict
        The document, with "error". Where even ``most`` states miss the accuracy, the fewest whose error is about as
        small, with a sentence in "warnings".
    """
    known: dict[int, Errors] = {}

    def error(count: int) -> float:
        if count not in known:
            known[count] = compare(CompactModel(document(count)), references)
        return worst(known[count])

    count = fewest(most, error, accuracy) if states is None else min(states, most)
    warnings = []
    if error(count) > accuracy and states is None:
        count = fewest(most, error, 1.1 * error(count))
        warnings = [not_reached(accuracy, full, error(count))]
    return document(count) | {"error": known[count], "warnings": warnings}


def not_reached(accuracy: float, full: str, reached: float, because: str = "") -> str:
    """Write the warning of a model that misses its accuracy."""
    return (
        f"the compact model is known to be within {reached:.3g} of {full}, not within {accuracy:g}{because}: see its "
        "errors before you use it"
    )


def fewest(most: int, error: Callable[[int], float], accuracy: float) -> int:
    """Bisect for the smallest number of states, at most ``most``, whose error holds an accuracy.

    A number of states with which the model cannot be run does not hold it; ``most`` is taken where no other does.
    """

    def exceeds(count: int) -> bool:
        try:
            return error(count) > accuracy
        except (ArithmeticError, np.linalg.LinAlgError):
            return True

    low, high = 0, min(1, most)
    while high < most and exceeds(high):
        low, high = high, min(2 * high, most)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if exceeds(middle) else (low, middle)
    return high


def leading(states: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Order the directions of a state space by their effect on the outputs.

    Parameters
    ----------
    states : (n, any) array
        Responses of the model, as states.
    rows : (outputs, n) array
        How the outputs follow the states.

    Returns
    -------
    (n, n) array
        Orthonormal directions in the order of their effect on the responses, in their norm, and on the outputs, each
        relative to its largest value.
    """
    size = np.abs(rows @ states).max(axis=1, initial=0.0)
    read = rows[size > 0] / size[size > 0, None]
    whole = float(np.linalg.norm(states, axis=0).max(initial=1e-300))
    weighed = np.linalg.cholesky(np.eye(len(states)) / whole**2 + read.T @ read)
    first = np.linalg.svd(weighed.T @ states, full_matrices=True)[0]
    return np.linalg.qr(np.linalg.solve(weighed.T, first))[0]


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
        made = reduce(judge.document, most, judge.references, accuracy, count, DEVICE)
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
        modal = self.modal if count == self.modal.count else self.modal.within(self._sums[:, :count])
        return document(modal, self.device, self.whole.name, self.inputs)

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
    def _sums(self) -> np.ndarray:
        """(n, n): sums of modes, ordered by their effect on both films' temperatures."""
        modal, h = self.modal, self.device.control.sample_time
        heating, decaying = modal.shape.T, np.column_stack([modal.jump, modal.substrate.jump])
        rates = modal.rates[:, None]
        responses = [heating / rates]
        for g in np.geomspace(0.3 * h, max(1 / modal.rates[0], h), 12).tolist():
            responses += [g * heating / (1 + g * rates), decaying / (1 + g * rates)]
        every = np.column_stack(responses)
        # Each alike, whatever its unit.
        return leading(every / np.abs(modal.shape[:2] @ every).max(axis=0), modal.shape)

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
        models = [CompactModel(document(modal, self.device, self.whole.name, self.inputs)) for modal in modals]
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
