"""Derivatives of the traces of any response by the keys of its scene, in its reduced space widened by dual fields.

The states a of the reduced problem solve M da/dt = r(a, da/dt, t), and their derivative b by a key

    M db/dt = dr/da b + (explicit derivative of the residual by the key),

projected on the Krylov fields of the response and on those of its readings, which is as good as solving backwards for
each reading (Grimme, Krylov projection methods for model reduction, 1997, section 3). For each key the problem on the
mesh that is there, moved, is assembled anew, currents and all: what its residual is at the states of the response is
the explicit derivative, over a step, and what its readings are at a + step b are those of the traces. b is stepped for
all keys at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fem3d.adaptivity import goal_parts
from fem3d.problems.current import Conductor, Pattern
from fem3d.problems.current_fields import independent
from fem3d.problems.heat import HeatProblem
from fem3d.results import outputs
from fem3d.results.study import Study
from fem3d.sensitivity.motion import STEP, moved
from fem3d.sensitivity.neighbour import Beside, Projected
from fem3d.solution import transient
from fem3d.solution.reduced import orthonormal
from fem3d.solution.transient import Base, Krylov, Transient
from fem3d.spaces.channels import Inputs
from fem3d.spaces.domain import Domain
from scenes.errors import SceneError

# Relative error of a one-sided difference: for a trace in proportion to key^s it is |s - 1| / 2 steps, and s is -2 to
# 2.
ONE_SIDED = 1.5 * STEP
GENERATIONS, FEWER = 6, 4  # of dual Krylov fields, and how many the error is told from
PER_DECADE, FIRST = 20, 1e-3  # rows of a course, and how long after an input jumps they start, of the earliest time
BENDS = 1e-2  # after a bend of an input rows start at this fraction of the time to the next bend
SMALL = 1e-4  # exponents of a decay over a step below this are summed as a series
JUST = 1e-12  # relative distance of the row just before a jump from its time

Traces = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Course:
    """``traces`` (times,) at ``times`` (s), of temperatures above the start, with d trace / d ln key (times,) by
    key and name in ``values``, and how far off they are by ``less`` fields and steps, and a difference to one side."""

    times: np.ndarray
    traces: Traces
    values: dict[str, Traces]
    less: dict[str, Traces]


@dataclass(frozen=True, eq=False)
class _Problem:
    """The reduced problem of a scene."""

    study: Study
    projected: Projected

    @property
    def _inputs(self) -> Inputs:
        return self.projected.heat.inputs

    def residual(self, times: np.ndarray, a: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """(times, r): what states (times, r) of some rate (1/s) leave of the equation of heat."""
        g, reduced = self._inputs.at(times), self.projected.reduced
        residual = (
            g @ reduced.source
            - self._inputs.rates(times) @ reduced.inertia
            - a @ reduced.stiffness.T
            - rate @ self.projected.mass.T
        )
        return residual + reduced.joule(a, reduced.currents(a, g), g) if reduced.supply.shape[1] else residual

    def feedback(self, times: np.ndarray, a: np.ndarray) -> np.ndarray:
        """(times, r, r): how the Joule heat follows the states."""
        reduced = self.projected.reduced
        if not reduced.supply.shape[1]:
            return np.zeros((len(times), reduced.states, reduced.states))
        g = self._inputs.at(times)
        c = reduced.currents(a, g)
        slopes = np.einsum("ti,tj,ijlk->tlk", c, c, reduced.warm_load, optimize=True)
        turned = -np.linalg.solve(reduced.dissipation(a, g), np.einsum("ijk,tj->tik", reduced.warm, c))
        per_current = np.tensordot(g, reduced.cold_load, 1) + np.einsum(
            "ijlk,tk->tijl", reduced.warm_load, a, optimize=True
        )
        return slopes + 2 * np.einsum("tj,tijl,tik->tlk", c, per_current, turned, optimize=True)

    def jump(self, time: float, a: np.ndarray) -> np.ndarray:
        """(r,): what a jump of the inputs, at 0 from nothing, leaves of that of the states (r,), of heat stored."""
        g = self._inputs.jump(time) if time else self._inputs.at(np.zeros(1))[0]
        jump: np.ndarray = -g @ self.projected.reduced.inertia - self.projected.mass @ a
        return jump

    def traces(self, times: np.ndarray, a: np.ndarray, rate: np.ndarray) -> Traces:
        """The traces (times,) at states (times, r) of some rate, of temperatures above the start."""
        projected, part = self.projected, self.study.part
        base = Base(projected.heat, projected.conductor, list(projected.patterns), projected.reduced.basis, [])
        traces = self.study.traces(outputs.of_states(base, projected.reduced, part, times, a, rate))
        start = self.study.traces(_Rest())
        return {n: v - start[n] for n, v in traces.items()}


class _Rest(dict[str, np.ndarray]):
    """The outputs of a scene at its start."""

    def __missing__(self, name: str) -> np.ndarray:
        return np.zeros(())


class _Widened:
    """The fields of a response and dual ones, in which it is solved beside other scenes on its mesh."""

    def __init__(self, study: Study, answer: Transient) -> None:
        self._study, self._answer, self._base = study, answer, answer.base
        heat, conductor = self._base.heat, self._base.conductor
        self.domain: Domain = heat.domain
        self._hottest = self._as_hot_as_it_gets()
        probes = {p.name: p for p in self.domain.scene.probes}
        rows = [
            goal_parts.goal_row(heat, probes[name], self._hottest) for name in dict.fromkeys(study.trace_goals.values())
        ]
        loads = [row for row in rows if row is not None and row[: heat.free].any()]
        if conductor is not None and conductor.warms:
            heating = (self._base.patterns[0].density ** 2).sum(axis=0)
            loads.append(heat.take(conductor.on.load(heating * conductor.warm)))
        slowest = min(float(1 / max(answer.trajectory.rates.min(), 1e-300)), answer.end)
        reduced_basis = answer.reduced.basis
        krylov = Krylov(Base(heat, None, [], reduced_basis, loads), transient.shift(slowest, study.earliest))
        basis = orthonormal(heat, krylov.fields(GENERATIONS))
        self._held, self._states = reduced_basis.shape[1], basis.shape[1]
        self.fewer = self._held + (self._states - self._held) * FEWER // GENERATIONS
        self.beside = Beside(heat, conductor, basis, self._patterns)

    def _as_hot_as_it_gets(self) -> np.ndarray:
        """(all nodes,): where what heating does to the pattern of the current shows most."""
        times = np.geomspace(self._study.earliest, self._answer.end, 40)
        rises = self._answer.rises(times)
        hottest: np.ndarray = rises[int(np.abs(rises).max(axis=1).argmax())]
        return hottest

    def _patterns(self, heat: HeatProblem, conductor: Conductor) -> list[Pattern]:
        """The current fields that the response has, too."""
        if not self._base.patterns:
            return []
        lift = heat.inputs.at(np.zeros(1))[0] @ heat.lifts
        driven = [v for v in conductor.voltages if v.any()]
        potentials = [conductor.solve(lift, v) for v in driven]
        if len(self._base.patterns) > len(driven):
            potentials += [conductor.solve(self._hottest, v) for v in driven]
        return independent(conductor, potentials)

    def states(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(times, r) twice: the states of the response and their rates."""
        a, rate = self._answer.states(times)
        more = ((0, 0), (0, self._states - self._held))
        return np.pad(a, more), np.pad(rate, more)


def over_time(
    study: Study, answer: Transient, others: Mapping[str, Callable[[], Study]], instants: Sequence[float] = ()
) -> tuple[Course, dict[str, str]]:
    """The derivatives of the traces of a response by keys, of each of which the scene is solved that is larger by a
    part of `STEP` in it, and why there is none by others; at rows of its own, ``instants`` (s) among them."""
    wide = _Widened(study, answer)
    original, problems, left_out = _Problem(study, wide.beside.original), dict[str, _Problem](), dict[str, str]()
    # Of both only the product is in the equations.
    alike = {key: key.replace(".specific_heat", ".density") for key in others}
    alike = {key: twin for key, twin in alike.items() if twin != key and twin in others}
    for key, other in others.items():
        if key in alike:
            continue
        try:
            beside = other()
            domain = moved(wide.domain, study.part, beside.part, STEP)
            problems[key] = _Problem(beside, wide.beside.projected(domain))
        except SceneError as error:
            left_out[key] = str(error)
    rows, starts = _rows(study, original.projected.heat.inputs, instants)
    times = np.sort(np.concatenate([rows, (rows[1:] + rows[:-1]) / 2]))
    a, rate = wide.states(times)
    still = original.residual(times, a, rate)
    residuals = np.array([problem.residual(times, a, rate) for problem in problems.values()])
    forces = (residuals - still).transpose(1, 0, 2) / STEP
    jumps = {}
    for start in starts:
        after, before = wide.states(np.array([start, start * (1 - JUST)]))[0]
        jump = after - before if start else after
        jumps[start] = (
            np.array([problem.jump(start, jump) - original.jump(start, jump) for problem in problems.values()]) / STEP
        )
    feedback = original.feedback(times, a) - original.projected.reduced.stiffness
    both = []
    for fields, every in ((len(feedback[0]), 1), (wide.fewer, 2)):
        kept = slice(None), slice(None, fields)
        cut = {time: jump[kept] for time, jump in jumps.items()}
        b = _march(times[::every], forces[::every, :, :fields], feedback[::every, :fields, :fields], cut)
        b = b[:: 2 // every]
        change = np.einsum("tlk,tnk->tnl", feedback[::2, :fields, :fields], b) + forces[::2, :, :fields]
        more = ((0, 0), (0, 0), (0, len(feedback[0]) - fields))
        both.append((np.pad(b, more), np.pad(change, more)))
    late = rows >= study.earliest * (1 - 1e-9)
    times, a, rate = times[::2][late], a[::2][late], rate[::2][late]
    traces = original.traces(times, a, rate)
    values, less = dict[str, Traces](), dict[str, Traces]()
    for n, (key, problem) in enumerate(problems.items()):
        for into, (b, change) in zip((values, less), both, strict=True):
            by_key = problem.traces(times, a + STEP * b[late, n], rate + STEP * change[late, n])
            into[key] = {name: (v - traces[name]) / STEP for name, v in by_key.items()}
        sided = {name: ONE_SIDED * np.abs(v) for name, v in values[key].items()}
        less[key] = {name: np.abs(v - values[key][name]) + sided[name] for name, v in less[key].items()}
    for key, twin in alike.items():
        if twin in values:
            values[key], less[key] = values[twin], less[twin]
    return Course(times, traces, values, less), left_out


def _rows(study: Study, inputs: Inputs, instants: Sequence[float]) -> tuple[np.ndarray, list[float]]:
    """Times (s) that follow each bend and jump of the inputs ever less closely, and the starts, 0 and the jumps, of
    which each has a row just before it."""
    end = study.end
    knots = [0.0, *inputs.knots(end).tolist(), end]
    starts = [0.0, *(t for t in knots[1:-1] if inputs.jump(t).any())]
    rows = [np.array([t for t in (*instants, study.earliest, end) if 0 < t <= end])]
    for start, following in pairwise(knots):
        gap = following - start
        first = min(FIRST * study.earliest, BENDS * gap)
        if start not in starts:
            first = max(first, BENDS * gap)
        rows.append(start + np.geomspace(first, gap, int(PER_DECADE * np.log10(gap / first)) + 2))
        if start:
            rows.append(np.array([start * (1 - JUST), start]))
    return np.unique(np.concatenate(rows)), starts


def _march(
    times: np.ndarray, forces: np.ndarray, feedback: np.ndarray, jumps: Mapping[float, np.ndarray]
) -> np.ndarray:
    """(times, keys, r): db/dt = force + feedback b from rest before 0, with jumps (keys, r) at times of these and at 0;
    the decay at first is exact, and all else is taken to go linearly between the times (exponential trapezoidal rule;
    Hochbruck and Ostermann, Acta Numerica 19, 2010), the first force held from 0 on."""
    rates, modes = np.linalg.eigh(-(feedback[0] + feedback[0].T) / 2)
    inner = modes.T @ feedback @ modes + np.diag(rates)
    forces = forces @ modes
    b, since = jumps[0.0] @ modes, 0.0
    before = forces[0] + b @ inner[0].T
    states, eye = np.empty(forces.shape), np.eye(len(rates))
    for i, time in enumerate(times):
        h = time - since
        x = rates * h
        safe = np.where(np.abs(x) < SMALL, SMALL, x)
        # (1 - e^-x) / x and (e^-x - 1 + x) / x^2, by their series where x is small.
        one = np.where(np.abs(x) < SMALL, 1 - x / 2, -np.expm1(-safe) / safe)
        two = np.where(np.abs(x) < SMALL, 0.5 - x / 6, (1 - one) / safe)
        ahead = np.exp(-x) * b + h * ((one - two) * before + two * forces[i])
        b = np.linalg.solve(eye - h * two[:, None] * inner[i], ahead.T).T
        if time and time in jumps:
            b = b + jumps[float(time)] @ modes
        before, since = forces[i] + b @ inner[i].T, time
        states[i] = b
    return states @ modes.T
