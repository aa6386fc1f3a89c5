"""Logarithmic derivatives of a response to a constant drive, in its reduced space widened by dual fields.

The derivative b of the rise by a key solves the linearized equation

    M db/dt + K b = d(Joule heat)/db b + (explicit derivative of the Joule heat) - K' u - M' du/dt

projected on the Krylov fields of the response and on those of its readings, which is as good as solving backwards for
each reading (Grimme, Krylov projection methods for model reduction, 1997, section 3). K', M' and the rest are sums over
the cells as in `fem3d.sensitivity`. The current is taken to keep the pattern of the cold conductor, whose own change
with the key is exact (by its dual solutions); how heating bends that change is left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fem3d.goals import moved_mean
from fem3d.line_extreme import LineExtreme
from fem3d.motion import Motion
from fem3d.probes import reading
from fem3d.reduced import orthonormal
from fem3d.sensitivity import COMPLEX, Table
from fem3d.study import Study
from fem3d.transient import Base, Krylov, Transient, shift

GENERATIONS, FEWER = 6, 4  # of dual Krylov fields, and how many the error is told from
PER_DECADE, FIRST = 20, 1e-3  # steps of the time grid, and its start over the earliest time of interest
SMALL = 1e-4  # of a decay over a step


@dataclass(frozen=True, eq=False)
class Course:
    """d ln quantity / d ln key (times,) at ``times`` (s), by key and quantity; ``errors`` of what the reduced space
    leaves out, the largest over time."""

    times: np.ndarray
    values: dict[str, dict[str, np.ndarray]]
    errors: dict[str, dict[str, float]]


@dataclass(frozen=True, eq=False)
class _Slopes:
    """How the reduced problem follows a key, on r fields of which the first s hold the response: ``heat`` (r, s) and
    ``store`` (r, s), K' and M'; ``cold`` (r,) and ``warm`` (r, s) of the Joule heat at unit current; ``resistance`` and
    ``warming`` (s,) of the circuit, ``voltage`` of the logarithm of the voltage; ``rows`` of means (s,), by probe."""

    heat: np.ndarray
    store: np.ndarray
    cold: np.ndarray
    warm: np.ndarray
    resistance: float
    warming: np.ndarray
    voltage: float
    rows: dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class _Parts:
    """Of the cold conductor, per axis and live cell: ``heat`` (3, r, live), the Joule heat tested with the fields less
    what it loses as the pattern gives way to that; ``warm`` (3, r, s, live) per field; ``power`` (3, live), and
    ``warming`` (3, r, live), what each field adds to it at given current. Summed up: ``source`` (r,), ``feedback``
    (r, r). ``bend`` (r, functions) and ``push`` (functions,): how heat and power follow the given potentials."""

    heat: np.ndarray
    warm: np.ndarray
    power: np.ndarray
    warming: np.ndarray
    source: np.ndarray
    feedback: np.ndarray
    bend: np.ndarray
    push: np.ndarray

    @property
    def power_sum(self) -> float:
        """W."""
        return float(self.power.sum())

    @property
    def warming_sum(self) -> np.ndarray:
        """(r,)."""
        found: np.ndarray = self.warming.sum(axis=(0, 2))
        return found


class Widened:
    """The reduced problem of a response with dual fields added, and its derivatives."""

    def __init__(self, study: Study, answer: Transient, generations: int) -> None:
        self.study, self.answer, self.heat = study, answer, answer.base.heat
        heat, conductor = self.heat, answer.base.conductor
        self.domain = heat.domain
        self.probes = {p.name: p for p in self.domain.scene.probes}
        rise = heat.field(answer.base.fields[:, -1][: heat.free])
        self.rows: dict[str, np.ndarray] = {}
        loads = []
        for probe in study.trace_goals.values():
            how = reading(heat, self.probes[probe])
            top = how.extreme if isinstance(how.extreme, LineExtreme) else None
            self.rows[probe] = heat.take(top.rows()) if top else how.row[None]
            loads.append(heat.take(top.where(rise).row(self.domain.space)) if top else how.row)
        own = answer.reduced.basis
        if conductor is not None and conductor.warms:
            pattern = answer.base.patterns[0].density
            warming = (pattern**2).sum(axis=0) * conductor.warm
            loads.append(heat.take(conductor.on.load(warming)))
        base = Base(heat, conductor, answer.base.patterns, own, loads)
        self.shift = shift(1 / max(float(answer.trajectory.rates.min()), 1e-300), study.earliest)
        self._krylov = Krylov(base, self.shift)
        self.basis = orthonormal(heat, self._krylov.fields(generations))
        self.held = own.shape[1]

    @cached_property
    def fields(self) -> np.ndarray:
        """(r, functions)."""
        return self.heat.field(self.basis.T)

    @cached_property
    def stiffness(self) -> np.ndarray:
        """(r, r)."""
        found: np.ndarray = self.basis.T @ (self.heat.inner_stiffness @ self.basis)
        return found

    @cached_property
    def _cells(self) -> tuple[np.ndarray, np.ndarray]:
        """(3, r, s, cells) and (r, s, cells): conduction and storage between the fields, cell by cell."""
        space, domain, s = self.domain.space, self.domain, self.held
        on = space.on(np.arange(len(domain.body)))
        gradients = np.array([on.gradient(u) for u in self.fields])  # (r, 3, cells, points)
        values = np.array([on.value(u) for u in self.fields])
        k, c = domain.per_cell("thermal_conductivity"), domain.per_cell("heat_capacity")
        conduction = np.empty((3, len(values), s, len(k)))
        for d in range(3):
            left = (gradients[:, d] * on.weights).transpose(1, 0, 2)
            conduction[d] = np.matmul(left, gradients[:s, d].transpose(1, 2, 0)).transpose(1, 2, 0) * k
        left = (values * on.weights).transpose(1, 0, 2)
        storage = np.matmul(left, values[:s].transpose(1, 2, 0)).transpose(1, 2, 0) * c
        return conduction, storage

    @cached_property
    def _films(self) -> dict[str, np.ndarray]:
        """(r, s, facets): the integrals of pairs of fields over each film, per coefficient."""
        found = {}
        for boundary in self.domain.scene.boundaries:
            if boundary.kind == "convection":
                faces = self.domain.faces(boundary)
                values = np.array([faces.value(u) for u in self.fields])
                found[boundary.name] = np.einsum("ifp,jfp,fp->ijf", values, values[: self.held], faces.areas)
        return found

    @cached_property
    def parts(self) -> _Parts:
        """The sums over the conductor that all keys share."""
        conductor = self.answer.base.conductor
        assert conductor is not None
        on, phi = conductor.on, conductor.voltages[0].copy()
        phi[conductor.free] = -conductor.solve_cold((conductor.matrix @ phi)[conductor.free])
        slope = on.gradient(phi) / np.sqrt(conductor.cold)
        values = np.array([on.value(u) for u in self.fields])
        power = slope**2 * on.weights  # (3, live, points), of all that a cell stands for
        each = conductor.stands_for
        heat, bend = np.empty((3, len(values), len(conductor.cells))), np.empty((len(values), len(phi)))
        root = np.sqrt(conductor.cold)
        for i, v in enumerate(values):
            w = np.zeros(len(phi))
            pushed = on.flow(2 * slope * v / each / root)
            w[conductor.free] = conductor.solve_cold(pushed[conductor.free])
            given = on.gradient(w) / root
            heat[:, i] = (power * v / each - slope * given * on.weights).sum(axis=-1)
            bend[i] = pushed - on.flow(given / root)
        share = conductor.warm / conductor.cold
        warming, heated = power * share, power * share / each
        return _Parts(
            heat, np.einsum("dcp,icp,jcp->dijc", heated, values, values[: self.held], optimize=True),
            power.sum(axis=-1), np.einsum("dcp,icp->dic", warming, values),
            np.einsum("dcp,icp->i", power / each, values),
            np.einsum("dcp,icp,jcp->ij", heated, values, values, optimize=True), bend, 2 * on.flow(slope / root),
        )  # fmt: skip

    def slopes(self, by: Motion) -> _Slopes:
        """The derivatives of the reduced problem by one key."""
        conduction, storage = self._cells
        domain, s = self.domain, self.held
        grown = by.volume - 2 * by.stretch
        heat = np.einsum("dijc,dc->ij", conduction, grown + by.conductivity / domain.per_cell("thermal_conductivity"))
        store = storage @ (by.volume + by.capacity / domain.per_cell("heat_capacity"))
        for boundary in domain.scene.boundaries:
            if boundary.name in self._films:
                faces: Any = domain.faces(boundary)
                along = faces.along(by.stretch)
                heat = heat + self._films[boundary.name] @ (by.films[boundary.name][1] + boundary.value * along)
        u = self.fields[:s]
        rows = {
            p: moved_mean(domain, self.probes[p], by, u) if self.probes[p].reduce == "mean" else np.zeros(s)
            for p in self.rows
        }
        conductor = self.answer.base.conductor
        if conductor is None:
            return _Slopes(heat, store, np.zeros(len(heat)), np.zeros_like(heat), 0.0, np.zeros(s), 0.0, rows)
        live, parts = conductor.cells, self.parts
        of_cold = by.cold[live] / conductor.cold[:, 0]
        once = grown[:, live] - of_cold
        total = float(parts.power.sum())
        supply = float((parts.power * once).sum() + parts.push @ by.voltages)
        voltage = float(parts.push @ by.voltages) / (2 * total)
        warm = conductor.warm[:, 0]
        of_warm = np.divide(by.warm[live], warm, out=np.zeros_like(warm), where=warm != 0)
        twice = once - of_cold + of_warm + 2 * voltage
        return _Slopes(
            heat, store, np.einsum("dic,dc->i", parts.heat, once) + parts.bend @ by.voltages,
            np.einsum("dijc,dc->ij", parts.warm, twice), supply,
            np.einsum("dic,dc->i", parts.warming[:, :s], twice), voltage, rows,
        )  # fmt: skip

    def course(
        self, slopes: Mapping[str, _Slopes], times: np.ndarray | None, fields: int
    ) -> dict[str, dict[str, np.ndarray]]:
        """d ln quantity / d ln key (times,) on the first ``fields`` fields; without times, of the steady state (1,)."""
        s, r, keys = self.held, fields, list(slopes)
        if times is None:
            a, rate = self._steady[None, :], np.zeros((1, s))
        else:
            a, sources = self.answer.trajectory(times)
            rate = sources - a * self.answer.trajectory.rates
        rates, modes = np.linalg.eigh(self.stiffness[:r, :r])
        forces = np.stack([-(a @ own.heat[:r].T + rate @ own.store[:r].T) for own in slopes.values()], axis=1)
        feedback = np.zeros((len(a), r, r))
        circuit = None if self.answer.base.conductor is None else _Circuit(self.parts, a, r)
        if circuit is not None:
            forces += np.stack([circuit.force(own) for own in slopes.values()], axis=1)
            feedback = circuit.feedback
        forces, feedback = forces @ modes, modes.T @ feedback @ modes
        if times is None:
            b = np.linalg.solve(np.diag(rates) - feedback[0], forces[0].T).T[None]
        else:
            b = _march(rates, times, forces, feedback)
        b = b @ modes.T  # (times, keys, r)
        rows = {name: row[:, : self.heat.free] @ self.basis[:, :r] for name, row in self.rows.items()}
        room = self.domain.scene.initial_temperature
        found = {}
        for n, key in enumerate(keys):
            read = _Read()
            for name, of_fields in rows.items():
                values = a @ of_fields[:, :s].T
                top = values.argmax(axis=1)[:, None]
                by_key = np.take_along_axis(b[:, n] @ of_fields.T, top, axis=1)[:, 0] + a @ slopes[key].rows[name]
                read[f"probe:{name}"] = np.take_along_axis(values, top, axis=1)[:, 0] + COMPLEX * 1j * by_key
            rises = {n: v - room for n, v in self.study.traces(read).items() if n.endswith("_K")}
            traces = {n: v.imag / COMPLEX / v.real for n, v in rises.items() if np.isfinite(v).all()}
            if circuit is not None:
                power = circuit.power(slopes[key], b[:, n])
                traces |= {"power_W": power, "current_A": power - slopes[key].voltage}
            found[key] = traces
        return found

    @cached_property
    def _steady(self) -> np.ndarray:
        """(s,): the steady rise in the fields of the response, where the traces go to."""
        base, n = self.answer.base, self.heat.free
        found: np.ndarray = self.answer.reduced.basis.T @ (self.heat.inner_mass @ base.fields[:, -1][:n])
        return found


class _Read(dict[str, np.ndarray]):
    """Outputs that are known, with a derivative as a small imaginary part; all others are no numbers."""

    def __missing__(self, name: str) -> np.ndarray:
        return np.array(np.nan)


class _Circuit:
    """The current c = P / (P + A_1 a), over that of the cold conductor of power P, at states a (times, s), and what the
    Joule heat c^2 Q, Q = Q_0 + Q_1 a, makes of it."""

    def __init__(self, parts: _Parts, a: np.ndarray, r: int) -> None:
        s = a.shape[1]
        self._a, self._r, self._total = a, r, parts.power_sum
        self._warming = parts.warming_sum[:r]
        self._resistance = self._total + a @ self._warming[:s]
        self._current = self._total / self._resistance
        self._heated = parts.source[:r] + a @ parts.feedback[:r, :s].T
        self._drop = -self._current / self._resistance  # dc / d(A_1 a)
        turned = (2 * self._current * self._drop)[:, None, None] * self._heated[:, :, None] * self._warming
        self.feedback = self._current[:, None, None] ** 2 * parts.feedback[:r, :r] + turned

    def _own(self, slopes: _Slopes) -> np.ndarray:
        """(times,): dc by the key itself."""
        found: np.ndarray = (slopes.resistance - self._current * (slopes.resistance + self._a @ slopes.warming)) / (
            self._resistance
        )
        return found

    def force(self, slopes: _Slopes) -> np.ndarray:
        """(times, r): the explicit derivative of the Joule heat, tested with the fields."""
        explicit = self._current[:, None] ** 2 * (slopes.cold[: self._r] + self._a @ slopes.warm[: self._r].T)
        found: np.ndarray = explicit + (2 * self._current * self._own(slopes))[:, None] * self._heated
        return found

    def power(self, slopes: _Slopes, b: np.ndarray) -> np.ndarray:
        """(times,): d ln power, for derivatives b (times, r) of the states."""
        change = self._own(slopes) + self._drop * (b @ self._warming)
        found: np.ndarray = change / self._current + slopes.resistance / self._total
        return found


def _march(rates: np.ndarray, times: np.ndarray, forces: np.ndarray, feedback: np.ndarray) -> np.ndarray:
    """(times, keys, r): db/dt = -rates b + force + feedback b from rest at 0, the last two linear between the times and
    their response exact (exponential trapezoidal rule; Hochbruck and Ostermann, Acta Numerica 19, 2010), the first
    force held from 0 on."""
    b, before, since = np.zeros(forces.shape[1:]), forces[0], 0.0
    found, eye = np.empty(forces.shape), np.eye(len(rates))
    for i, time in enumerate(times):
        h = time - since
        x = rates * h
        safe = np.maximum(x, SMALL)
        # (1 - e^-x) / x and (e^-x - 1 + x) / x^2, by their series where x is small.
        one = np.where(x < SMALL, 1 - x / 2, -np.expm1(-safe) / safe)
        two = np.where(x < SMALL, 0.5 - x / 6, (1 - one) / safe)
        ahead = np.exp(-x) * b + h * ((one - two) * before + two * forces[i])
        b = np.linalg.solve(eye - h * two[:, None] * feedback[i], ahead.T).T
        before, since = forces[i] + b @ feedback[i].T, time
        found[i] = b
    return found


def over_time(
    study: Study, answer: Transient, by: Mapping[str, Motion], steady: Table, instants: Sequence[float] = ()
) -> Course:
    """The derivatives of the traces of a response to a constant drive by all keys, from the earliest time of interest
    on and at some instants (s).

    Errors add up what fewer dual fields and every other time change, how far the limit of the reduced problem is from
    the derivatives of the ``steady`` state, and the errors of these.
    """
    wide = Widened(study, answer, GENERATIONS)
    start, end = FIRST * study.earliest, study.end
    count = int(PER_DECADE * np.log10(end / start)) + 2
    grid = np.unique(np.concatenate([np.geomspace(start, end, count), [t for t in instants if start < t <= end]]))
    slopes = {key: wide.slopes(motion) for key, motion in by.items()}
    r = wide.basis.shape[1]
    fewer = wide.held + (r - wide.held) * FEWER // GENERATIONS
    found, limit = wide.course(slopes, grid, r), wide.course(slopes, None, r)
    less = wide.course(slopes, grid[::2], fewer)
    late, late_less = grid >= study.earliest * (1 - 1e-9), grid[::2] >= study.earliest * (1 - 1e-9)
    errors: dict[str, dict[str, float]] = {}
    for key, of in found.items():
        errors[key] = {}
        for name, v in of.items():
            known = steady[key][_steady_name(name)]
            errors[key][name] = (
                float(np.abs(v[::2] - less[key][name])[late_less].max())
                + abs(float(limit[key][name][0]) - known.value) + known.error
            )  # fmt: skip
    return Course(grid[late], {key: {n: v[late] for n, v in of.items()} for key, of in found.items()}, errors)


def _steady_name(trace: str) -> str:
    return trace.replace("_K", "_rise_K")
