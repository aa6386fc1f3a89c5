"""Few states, or those of a whole plate, of a sink whose properties follow the temperature: sums over the quadrature
points of its layer (`reduced1d.ladder.layer`) in the place of matrices, and the steady state by Newton's method.

    C(a) da/dt = -F(a) + I^2 S(a),   R(a) = the sum of the heat of 1 A,   I by what drives it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg

from reduced1d.ladder.layer import Both, Layer
from reduced1d.radau import radau
from scenes.drive import Drive
from scenes.errors import RunawayError
from scenes.laws import Law

HOTTEST = 1e5
"""K, beyond any solid: hotter states are no solution."""
MOST_STEPS, HALVINGS = 40, 4  # The most Newton steps, and the most halvings of one.
SETTLED = 1e-11  # Newton's method ends with a change below this part of the rise.
SETTLED_STEP = 1e-9  # The same within a time step, far below the error of the step itself.
SLOW = 0.2  # Newton's method makes a new tangent where a change exceeds this part of the one before.
SHORTEST = 1e-4  # The largest drive is found to this relative step.


@dataclass(frozen=True, eq=False)
class Points:
    """Quadrature points of a part of the layer: what some functions are there, ``values`` (points, functions), and
    their ``slopes`` along each axis (1/m). The functions' amplitudes are ``by_state`` (functions, states) times the
    states, the states themselves for ``None``.

    Each stands for an ``area`` (m2), of which so much is ``above`` oxide, which conducts ``along`` the layer where that
    is 1 and not where it is 0, and so much over the ``gap``; for so much ``bare`` that radiates; for so much of the
    heat capacity of ``silicon`` and ``oxide`` (m2); and for the ``heat`` (W) of 1 A in the cold sink. ``beam`` says
    whether they are in the beam."""

    values: Any
    slopes: tuple[Any, ...]
    area: np.ndarray
    above: np.ndarray
    along: np.ndarray
    gap: np.ndarray
    bare: np.ndarray
    silicon: np.ndarray
    oxide: np.ndarray
    heat: np.ndarray
    beam: np.ndarray
    by_state: np.ndarray | None = None

    def on(self, shapes: np.ndarray) -> Points:
        """Of states that are the amplitudes of shapes (n, states)."""
        if self.by_state is not None:
            return replace(self, by_state=self.by_state @ shapes)
        return replace(self, values=self.values @ shapes, slopes=tuple(s @ shapes for s in self.slopes))

    def where(self, chosen: np.ndarray) -> Points:
        """Some of the points (points,)."""
        arrays = {f.name: getattr(self, f.name)[chosen] for f in fields(self) if f.name not in ("slopes", "by_state")}
        return replace(self, **arrays, slopes=tuple(s[chosen] for s in self.slopes))

    def rise(self, states: np.ndarray) -> np.ndarray:
        """(..., points) in K, at states (..., n)."""
        return (self.values @ self.amplitudes(states).T).T

    def amplitudes(self, states: np.ndarray) -> np.ndarray:
        """(..., functions), at states (..., n)."""
        return states if self.by_state is None else states @ self.by_state.T

    def seen(self, by_function: np.ndarray) -> np.ndarray:
        """(..., states): what belongs to each function (..., functions), summed to what belongs to each state."""
        return by_function if self.by_state is None else by_function @ self.by_state

    def both(self, by_pair: Any) -> Any:
        """(states, states): the matrix of a bilinear form over functions (functions, functions), over states."""
        return by_pair if self.by_state is None else self.by_state.T @ by_pair @ self.by_state


class Terms(NamedTuple):
    """At a state: the outflow F and the source S of 1 A (n,) in W, the resistance of all (ohm); and the derivatives by
    the states, of the first two (n, n), of the resistance (n,)."""

    outflow: np.ndarray
    source: np.ndarray
    resistance: float
    outflow_slope: Any
    source_slope: Any
    resistance_slope: np.ndarray


@dataclass(frozen=True, eq=False)
class Following:
    """The laws of a ``layer`` at the points of its ``parts``, of so many ``states``; and by name those whose ``heats``
    are read off, and the ``open`` points that air and surroundings see."""

    layer: Layer
    parts: tuple[Points, ...]
    states: int
    heats: dict[str, Points] = field(default_factory=dict)
    open: tuple[Points, ...] = ()

    def on(self, shapes: np.ndarray) -> Following:
        parts, seen = (tuple(part.on(shapes) for part in points) for points in (self.parts, self.open))
        heats = {name: part.on(shapes) for name, part in self.heats.items()}
        return Following(self.layer, parts, shapes.shape[1], heats, seen)

    def given_off(self, state: np.ndarray, beam: bool = False) -> float:
        """The heat (W) to the air and by radiation, of all or of the beam alone."""
        heat = 0.0
        for part in self.open:
            rise, weight = part.rise(state), part.beam if beam else 1.0
            heat += float(
                ((part.area * self.layer.up(rise)[0] + part.bare * self.layer.radiates(rise)[0]) * weight).sum()
            )
        return heat

    def outflow(self, name: str, states: np.ndarray) -> np.ndarray:
        """(...,): the heat (W) that leaves by the points of a name, at states (..., n); of those of one function what
        it gives off by Galerkin's method."""
        part = self.heats[name]
        if part.by_state is not None:
            alone = Following(self.layer, (replace(part, by_state=None),), 1)
            return alone.flows(part.amplitudes(states))[0][..., 0]
        rise = part.rise(states)
        return (self._down(part, rise)[0] + self._up(part, rise)[0]).sum(axis=-1)

    def allowed(self, states: np.ndarray) -> bool:
        """Whether the laws say something of states (..., n)."""
        if not np.isfinite(states).all():
            return False
        coldest = -self.layer.sink.room_temperature
        for rise in (part.rise(states) for part in self.parts):
            if rise.max() > HOTTEST or rise.min() <= coldest or self.layer.resistivity(rise)[0].min() <= 0:
                return False
        return True

    def flows(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """F and S at states (..., n), and the resistance (...,)."""
        by_part = []
        for part in self.parts:
            rise, amplitudes = part.rise(states), part.amplitudes(states)
            k = part.area * self.layer.conducts(rise, part.along)
            outflow = (self._down(part, rise)[0] + self._up(part, rise)[0]) @ part.values
            for slopes in part.slopes:
                outflow = outflow + (k * (slopes @ amplitudes.T).T) @ slopes
            heat = part.heat * self.layer.resistivity(rise)[0]
            by_part.append((part.seen(outflow), part.seen(heat @ part.values), heat.sum(axis=-1)))
        outflow, source, resistance = (sum(each[1:], start=each[0]) for each in zip(*by_part, strict=True))
        return outflow, source, resistance

    def terms(self, state: np.ndarray) -> Terms:
        by_part = [self._slopes(part, state) for part in self.parts]
        outflow, source, resistance = self.flows(state)
        slopes = (sum(each[1:], start=each[0]) for each in zip(*by_part, strict=True))
        return Terms(outflow, source, float(resistance), *slopes)

    def _slopes(self, part: Points, state: np.ndarray) -> tuple[Any, Any, np.ndarray]:
        """What a part has of the derivatives."""
        layer, rise, values = self.layer, part.rise(state), part.values
        k, k_slope = (part.area * each for each in layer.along(rise, part.along))
        outflow = _product(values, self._down(part, rise)[1] + self._up(part, rise)[1], values)
        for slopes in part.slopes:
            outflow = outflow + _product(slopes, k, slopes)
            outflow = outflow + _product(slopes, k_slope * (slopes @ part.amplitudes(state)), values)
        heat = part.heat * layer.resistivity(rise)[1]
        return part.both(outflow), part.both(_product(values, heat, values)), part.seen(heat @ values)

    def _down(self, part: Points, rise: np.ndarray) -> Both:
        """What goes through the oxide, in W."""
        flow = np.zeros_like(rise), np.zeros_like(rise)
        on = part.above > 0
        for whole, each in zip(flow, self.layer.down(rise[..., on]), strict=True):
            whole[..., on] = part.above[on] * each
        return flow

    def _up(self, part: Points, rise: np.ndarray) -> Both:
        """What goes to air and gas, and is radiated, in W."""
        sink = self.layer.sink
        if not (sink.convection_coefficient or sink.emissivity or self.layer.gas):
            return np.zeros_like(rise), np.zeros_like(rise)
        (up, slope), (off, off_slope), gas = self.layer.up(rise), self.layer.radiates(rise), part.gap * self.layer.gas
        return part.area * up + part.bare * off + gas * rise, part.area * slope + part.bare * off_slope + gas

    def held(self, states: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """C at states (..., n) times some rates (..., n)."""
        if self._fixed_capacity is not None:
            return rates @ self._fixed_capacity
        stored = np.zeros_like(states)
        for part in self.parts:
            holds = self.layer.holds(part.rise(states), part.silicon, part.oxide)[0]
            stored += part.seen((holds * part.rise(rates)) @ part.values)
        return stored

    def capacity(self, state: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """C (n, n) in J/K at a state, and the derivative by the states of C applied to some ``rates`` (n,)."""
        if self._fixed_capacity is not None:
            return self._fixed_capacity, np.zeros_like(self._fixed_capacity)
        return self._capacity(state, rates)

    @cached_property
    def _fixed_capacity(self) -> np.ndarray | None:
        """C where no specific heat has a law."""
        sink, cold = self.layer.sink, np.zeros(self.states)
        has = any(isinstance(m.specific_heat, Law) for m in (sink.silicon, sink.oxide))
        return None if has else self._capacity(cold, cold)[0]

    def _capacity(self, state: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        whole, slope = np.zeros((self.states, self.states)), np.zeros((self.states, self.states))
        for part in self.parts:
            holds, change = self.layer.holds(part.rise(state), part.silicon, part.oxide)
            whole += part.both(_product(part.values, holds, part.values))
            if change.any():
                slope += part.both(_product(part.values, change * part.rise(rates), part.values))
        return whole, slope

    def resistance(self, states: np.ndarray, beam: bool = False) -> np.ndarray:
        """(...,): the resistance (ohm) of all, or of the beam alone, at states (..., n)."""
        total = np.zeros(states.shape[:-1])
        for part in self.parts:
            total = total + self.layer.resistivity(part.rise(states))[0] @ (part.heat * (part.beam if beam else 1.0))
        return total


def steady_state(model: Following, drive: Drive, start: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """The state (n,) and the current (A), from rest on; ``start`` may be near it.

    Raises RunawayError where no state is found beyond a part of the drive.
    """
    steady = None if start is None else _newton(model, drive, start)
    if steady is not None:
        return steady
    reached, step, state, before = 0.0, 1.0, np.zeros(model.states), None
    while True:
        ahead = min(1.0, reached + step)
        guess = state if before is None else state + (ahead - reached) / (reached - before[0]) * (state - before[1])
        steady = _newton(model, drive._replace(value=ahead * drive.value), guess)
        if steady is not None and ahead == 1.0:
            return steady
        if steady is None:
            step = (ahead - reached) / 2
        else:
            before, reached, state = (reached, state), ahead, steady[0]
        if step < SHORTEST * max(reached, SHORTEST):
            raise runaway(drive, reached * abs(drive.value))


def runaway(drive: Drive, limit: float) -> RunawayError:
    what = "current" if drive.unit == "A" else "voltage"
    return RunawayError(
        f"thermal runaway: the sink has no steady state at {drive.value:g} {drive.unit}, because the conductivity "
        f"falls or the resistance changes as it heats; the largest {what} that has one is {limit:.3g} {drive.unit}",
        limit,
    )  # fmt: skip


@np.errstate(all="ignore")  # what is no number ends the search
def _newton(model: Following, drive: Drive, state: np.ndarray) -> tuple[np.ndarray, float] | None:
    """The steady state near one, and the current; ``None`` where the iteration leads nowhere."""
    if not model.allowed(state):
        return None
    for _ in range(MOST_STEPS):
        terms = model.terms(state)
        try:
            solve, step = _direction(terms, drive)
        except RuntimeError:  # of SuperLU, for a singular matrix
            return None
        size = np.abs(step).max()
        if not np.isfinite(size):
            return None
        for halving in range(HALVINGS + 1):
            new = state + 0.5**halving * step
            if not model.allowed(new):
                continue
            if size <= SETTLED * np.abs(new).max(initial=1.0):
                return new, float(drive.through(model.resistance(new)))
            correction = np.abs(solve(_residual(model.terms(new), drive))).max()
            if correction < (1 - 0.5**halving / 4) * size or correction < SETTLED * np.abs(new).max():
                break
        else:
            return None
        state = new
    return None


def _residual(terms: Terms, drive: Drive) -> np.ndarray:
    return drive.through(terms.resistance) ** 2 * terms.source - terms.outflow


def _direction(terms: Terms, drive: Drive) -> tuple[Callable[[np.ndarray], np.ndarray], np.ndarray]:
    """The tangent's inverse, and Newton's step. What the resistance does to the current is of rank one."""
    squared, change = _squared(terms, drive)
    solve = inverse(terms.outflow_slope - squared * terms.source_slope)
    source = solve(terms.source)

    def whole(residual: np.ndarray) -> np.ndarray:
        solution = solve(residual)
        return solution + source * (change @ solution) / (1 - change @ source)

    return whole, whole(_residual(terms, drive))


def _squared(terms: Terms, drive: Drive) -> tuple[float, np.ndarray]:
    """The squared current (A2), and its derivative by the states (n,)."""
    current = float(drive.through(terms.resistance))
    if drive.unit == "A":
        return current**2, np.zeros_like(terms.resistance_slope)
    return current**2, -2 * current**2 / (terms.resistance + drive.series) * terms.resistance_slope


def inverse(matrix: Any) -> Callable[[np.ndarray], np.ndarray]:
    """What solves for a matrix, dense or sparse."""
    if isinstance(matrix, np.ndarray):
        factors = scipy.linalg.lu_factor(matrix, check_finite=False)
        return lambda vector: scipy.linalg.lu_solve(factors, vector, check_finite=False)
    from scipy.sparse.linalg import splu

    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A").solve


def _product(test: Any, weights: np.ndarray, trial: Any) -> Any:
    """The sum over points of left times weight times right."""
    if isinstance(trial, np.ndarray):
        return test.T @ (weights[:, None] * trial)
    return test.T @ trial.multiply(weights[:, None]).tocsr()


@np.errstate(all="ignore")
def step(model: Following, drive: Drive, state: np.ndarray, length: float, points: int) -> np.ndarray | None:
    """States (n, points + 1) at the start and at Radau's points of a step (s), by Newton's method with one tangent for
    all of them, which is made anew where it converges slowly; ``None`` where that does not settle."""
    matrix, n = length * radau(points)[0], model.states
    rates, before, factors = np.zeros((points, n)), math.inf, None
    for _ in range(MOST_STEPS):
        values = state + matrix @ rates
        if not model.allowed(values):
            return None
        if factors is None:
            middle = values[points // 2]
            terms, (capacity, slope) = model.terms(middle), model.capacity(middle, rates[points // 2])
            squared, change = _squared(terms, drive)
            slope = slope + terms.outflow_slope - squared * terms.source_slope - np.outer(terms.source, change)
            factors = scipy.linalg.lu_factor(
                np.kron(np.eye(points), capacity) + np.kron(matrix, slope), check_finite=False
            )
        outflow, source, resistance = model.flows(values)
        residual = drive.through(resistance)[:, None] ** 2 * source - outflow - model.held(values, rates)
        step = scipy.linalg.lu_solve(factors, residual.ravel(), check_finite=False).reshape(points, n)
        rates, moved = rates + step, float(np.abs(matrix @ step).max())
        values = state + matrix @ rates
        if moved <= SETTLED_STEP * np.abs(values).max():
            return np.column_stack([state, values.T])
        if not moved < SLOW * before:
            factors = None
        before = moved
    return None
