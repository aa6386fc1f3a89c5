"""A compact thermal model at work: a few states driven by its inputs, with nothing but numpy.

With z = (1, inputs g, states b) the model is

    (A z) c = S z,    db/dt = F z + sum_p c_i c_j Q_p z,    y = Y z + W dg/dt + sum_i c_i U_i z + sum_p c_i c_j P_p z

for current fields c, whose pairs p = (i, j) have i <= j. F holds -rates on the diagonal of the states, which start at
zero. A model of a steady state alone has db/dt = 0.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import factorial
from typing import Any, Literal

import numpy as np

Given = float | tuple[Sequence[float], Sequence[float]]
"""A number, or (times, values): linear between the times (s), constant outside; two equal times make a jump."""


class CompactModel:
    """The model of a document (of model.json); inputs and outputs by their names, in SI units, temperatures in K."""

    def __init__(self, document: Mapping[str, Any]) -> None:
        self.document = document
        self.inputs: dict[str, dict[str, Any]] = {entry["name"]: entry for entry in document["inputs"]}
        self.outputs: dict[str, dict[str, Any]] = {entry["name"]: entry for entry in document["outputs"]}
        self.A, self.S, self.F, self.Q, self.Y, self.W, self.U, self.P = (
            np.array(document["matrices"][key]["values"]).reshape(document["matrices"][key]["shape"])
            for key in "ASFQYWUP"
        )
        self.states = len(self.F)
        self.first, self.second = np.triu_indices(len(self.S))
        self.decay = -np.diagonal(self.F[:, 1 + len(self.inputs) :]).copy()
        self._known: dict[float, tuple[np.ndarray, ...]] = {}

    def simulate(
        self, times: Sequence[float] | np.ndarray, inputs: Mapping[str, Given] | None = None, tolerance: float = 1e-6
    ) -> dict[str, np.ndarray]:
        """(times,) of each output at ascending times (s) from rest at t = 0; inputs not given are the scene's own.

        Steps of exponential Runge-Kutta of order 3 (Cox and Matthews, J. Comput. Phys. 176, 2002), whose error is
        below ``tolerance`` of the largest state each. Raises ValueError for a model without capacities, KeyError for
        an input that there isn't, ArithmeticError where the heating runs away.
        """
        tables = self._tables(inputs)
        wanted = np.asarray(times, dtype=float)
        drives = [_drive(tables, t) for t in wanted.tolist()]
        states = self.march(wanted, inputs, tolerance)
        rows = np.array([self.read(*drive, b) for drive, b in zip(drives, states, strict=True)])
        return self._named(rows, np.array([g for g, _ in drives]))

    def march(
        self, times: Sequence[float] | np.ndarray, inputs: Mapping[str, Given] | None = None, tolerance: float = 1e-6
    ) -> np.ndarray:
        """(times, n): the states; arguments as of `simulate`."""
        if self.document["steady_only"]:
            raise ValueError("this is a model of the steady state: use steady()")
        tables, wanted = self._tables(inputs), np.asarray(times, dtype=float)
        t, b, largest = 0.0, np.zeros(self.states), 1e-30
        stops = sorted({*wanted[wanted > 0].tolist(), *(x for k, _ in tables for x in k if 0 < x < wanted[-1])})
        h, states = stops[0] if stops else 0.0, {0.0: b}
        for stop in stops:
            g, slope = _drive(tables, t)
            b, h, largest = self._advance(b, g, slope, stop - t, h, largest, tolerance)
            states[stop], t = b, stop
        return np.array([states[x] for x in wanted.tolist()])

    def steady(self, inputs: Mapping[str, Given] | None = None) -> dict[str, float]:
        """Each output in the steady state that the model reaches from rest, by Newton's method; inputs not given are
        the scene's own at the end. Raises ArithmeticError where there is none."""
        g = _drive(self._tables(inputs), np.inf)[0]
        outputs = self._named(self.read(g, np.zeros_like(g), self.rest(g))[None], g[None])
        return {name: float(values[0]) for name, values in outputs.items()}

    def rest(self, g: np.ndarray) -> np.ndarray:
        """(n,): the states of the steady state at inputs g. Raises ArithmeticError where there is none."""
        b, size = np.zeros(self.states), np.inf
        for _ in range(60):
            change = -np.linalg.solve(derivative(partial(self._rate, g), b), self._rate(g, b))
            b, before, size = b + change, size, float(np.abs(change).max(initial=0.0))
            largest = float(np.abs(b).max(initial=1e-300))
            # Where all inputs cancel out, as at one temperature, the states are rounding errors.
            terms = np.abs(self.F) @ np.abs(np.concatenate([[1.0], g, b]))
            noise = 1e-15 * float((terms / np.where(self.decay > 0, self.decay, np.inf)).max(initial=0.0))
            if size <= max(1e-12 * largest, noise) or (size < 1e-6 * largest and size >= before):
                if np.linalg.eigvals(derivative(partial(self._rate, g), b)).real.max(initial=0.0) > 0:
                    break
                return b
        raise ArithmeticError("the model has no steady state at these inputs")

    def step(self, b: np.ndarray, g: np.ndarray, time: float, tolerance: float = 1e-6) -> np.ndarray:
        """The states (n,) after a time (s) with constant inputs g."""
        return self._advance(b, g, np.zeros_like(g), time, time, 1e-30, tolerance)[0]

    def _advance(
        self, b: np.ndarray, g: np.ndarray, slope: np.ndarray, time: float, longest: float, largest: float,
        tolerance: float,
    ) -> tuple[np.ndarray, float, float]:  # fmt: skip
        """Integrate over a time (s) with inputs g + slope t: the states, the next step, and the largest state."""
        t = 0.0
        while t < time:
            h = min(time - t, longest)
            last = h >= (time - t) * (1 - 1e-12)
            new, off = self._step(b, g + slope * t, slope, h)
            largest = max(largest, float(np.abs(new).max(initial=0.0)))
            error = off / (tolerance * largest)
            if error <= 1:
                b, t = new, time if last else t + h
            elif h < 1e-13 * time:
                raise ArithmeticError(f"the heating runs away within {time:.3g} s")
            grown = h * min(max(0.8 * (error + 1e-30) ** (-1 / 3), 0.2), 5.0)
            longest = max(grown, longest) if last and error <= 1 else grown
        return b, longest, largest

    def read(self, g: np.ndarray, slope: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(rows,): all that is read off the states, at inputs g, of these rates."""
        z = np.concatenate([[1.0], g, b])
        readings: np.ndarray = self.Y @ z + self.W @ slope
        if len(self.S):
            c = self._currents(z)
            readings = readings + np.tensordot(c, self.U @ z, 1) + np.tensordot(self._pairs(c), self.P @ z, 1)
        return readings

    def named(self, row: np.ndarray) -> dict[str, float]:
        """The outputs of a row of readings, by name."""
        reduce: dict[str, Any] = {"max": np.max, "min": np.min, "mean": np.mean, "measured": _measured}
        return {name: float(reduce[o["reduce"]](row[o["rows"]])) for name, o in self.outputs.items()}

    def _named(self, rows: np.ndarray, inputs: np.ndarray) -> dict[str, np.ndarray]:
        each = [self.named(row) for row in rows]
        outputs = {name: np.array([step[name] for step in each]) for name in self.outputs}
        for values, entry in zip(inputs.T, self.inputs.values(), strict=True):
            low, high = entry["range"]
            small = 1e-9 * max(abs(low), abs(high))
            for value in values[(values < low - small) | (values > high + small)][:1]:
                warning = f"{entry['name']} = {value:.6g} {entry['unit']} is past the model's range"
                warnings.warn(f"{warning}, {low:.6g} to {high:.6g} {entry['unit']}", stacklevel=3)
        limit = self.document["range"]["highest_temperature_K"]
        hottest = max((float(outputs[n].max()) for n, o in self.outputs.items() if o["unit"] == "K"), default=0.0)
        if limit is not None and hottest > limit:
            warnings.warn(f"{hottest:.6g} K is past the model's range, up to {limit:.6g} K", stacklevel=3)
        return outputs

    def inputs_at(self, inputs: Mapping[str, Given] | None, time: float) -> np.ndarray:
        """(inputs,): their values at a time (s), after a jump there."""
        return _drive(self._tables(inputs), time)[0]

    def _tables(self, inputs: Mapping[str, Given] | None) -> list[tuple[np.ndarray, np.ndarray]]:
        given = dict(inputs or {})
        for name in given:
            if name not in self.inputs:
                raise KeyError(f"there is no input {name!r}: there are {', '.join(map(repr, self.inputs))}")
        tables = []
        for name, entry in self.inputs.items():
            value = given.get(name, entry["value"])
            if isinstance(value, Mapping):
                value = value["times"], value["values"]
            times, values = ([0.0], [value]) if np.ndim(value) == 0 else value
            tables.append((np.array(times, dtype=float), np.array(values, dtype=float)))
        return tables

    def _currents(self, z: np.ndarray) -> np.ndarray:
        return np.linalg.solve(self.A @ z, self.S @ z)

    def _pairs(self, c: np.ndarray) -> np.ndarray:
        return np.where(self.first == self.second, 1.0, 2.0) * c[self.first] * c[self.second]

    def _source(self, g: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(n,): db/dt without the decay of the states."""
        return self._rate(g, b) + self.decay * b

    def _rate(self, g: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(n,): db/dt."""
        z = np.concatenate([[1.0], g, b])
        rate: np.ndarray = self.F @ z
        if len(self.S):
            rate = rate + np.tensordot(self._pairs(self._currents(z)), self.Q @ z, 1)
        return rate

    def _step(self, b: np.ndarray, g: np.ndarray, slope: np.ndarray, h: float) -> tuple[np.ndarray, float]:
        """The states after a step (s), and the distance of a step of order 2."""
        p1, p2, p3, whole, first, to_half = self._propagators(h)
        end = whole * b
        n0 = self._source(g, b)
        half = to_half * b + h / 2 * first * n0
        n1 = self._source(g + slope * (h / 2), half)
        n2 = self._source(g + slope * h, end + h * p1 * (2 * n1 - n0))
        new = end + h * ((p1 - 3 * p2 + 4 * p3) * n0 + (4 * p2 - 8 * p3) * n1 + (4 * p3 - p2) * n2)
        lower = end + h * (p1 * n0 + 2 * p2 * (n1 - n0))
        return new, float(np.abs(new - lower).max(initial=0.0))

    def _propagators(self, h: float) -> tuple[np.ndarray, ...]:
        """phi_1 to phi_3 and the decay over a step (s), phi_1 and the decay over half a step; cached."""
        if h not in self._known:
            if len(self._known) >= 64:
                self._known.clear()
            x = self.decay * h
            self._known[h] = (*phi(x, 3), np.exp(-x), phi(x / 2, 1)[0], np.exp(-x / 2))
        return self._known[h]


def derivative(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    """(n, n): the derivative, as columns, of a real function of x (n,) with n values. A step of 1e-100 i leaves the
    derivative in its imaginary part, exact to rounding."""
    slopes = [function(x + step).imag for step in 1e-100j * np.eye(len(x))]
    return np.reshape(slopes, (len(x), len(x))).T * 1e100


def interpolate(
    x: np.ndarray, y: np.ndarray, t: np.ndarray | float, side: Literal["left", "right"] = "right"
) -> tuple[np.ndarray, np.ndarray]:
    """The values at a time or times t (s) and their rates (1/s): linear between the values y at times x, constant
    outside; at an x the limits from the right or left ``side``."""
    after = np.searchsorted(x, t, side=side)
    inside = (after > 0) & (after < len(x))
    low, high = np.maximum(after - 1, 0), np.minimum(after, len(x) - 1)
    rate = np.where(inside, (y[high] - y[low]) / np.where(inside, x[high] - x[low], 1.0), 0.0)
    return y[low] + rate * np.where(inside, t - x[low], 0.0), rate


def _drive(tables: list[tuple[np.ndarray, np.ndarray]], t: float) -> tuple[np.ndarray, np.ndarray]:
    """(inputs,) twice: the inputs and their rates (1/s) at a time (s), after a jump or bend there."""
    given = np.array([interpolate(x, y, t) for x, y in tables]).reshape(-1, 2)
    return given[:, 0], given[:, 1]


def _measured(rows: np.ndarray) -> float:
    """A resistance behind a shared lead (ohm): the resistances in series, plus the other current's drop in the lead (V)
    over the current (A) where that has the sign of the voltage."""
    series, drop, current, voltage = rows.tolist()
    return float(series + (drop / current if current * voltage > 0 else 0.0))


def phi(x: np.ndarray, count: int) -> np.ndarray:
    """(count, *x): the functions phi_1 to phi_count of exponential integrators, at -x.

    phi_(k-1) = 1/(k-1)! - x phi_k leads down from the power series of the last one where x is small, and up from
    phi_1 = (1 - exp(-x))/x where it is large.
    """
    small, large = np.minimum(x, count), np.maximum(x, count)
    terms = np.cumprod(-small[..., None] / np.arange(count + 1, count + 40), axis=-1)
    down = [(1 + terms.sum(axis=-1)) / factorial(count)]
    up = [-np.expm1(-large) / large]
    for k in range(1, count):
        down.insert(0, 1 / factorial(count - k) - small * down[0])
        up.append((1 / factorial(k) - up[-1]) / large)
    return np.where(x < count, down, up)
