"""The response over time of a problem whose properties follow the temperature: rounds of reduced problems.

Each round marches a reduced problem whose laws are interpolated between the states of the round before
(`fem3d.solution.interpolated`), and holds the result against the full equations: at some instants t the residual

    source(u) - outflow(u) - M du/dt,   with the current solved for and the laws by their quadrature,

and what a step of the full problem makes of it, t (M + t K)^-1 times it. These corrections are fields of the next
round. It ends where they are small; what the last round has changed of the traces is the error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fem3d.adaptivity import transient_base
from fem3d.adaptivity.transient_base import Hot
from fem3d.problems.current import Conductor
from fem3d.problems.current_fields import combined
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import at_films, linearized
from fem3d.results.study import Study
from fem3d.solution import transient
from fem3d.solution.between_states import MOST, with_laws
from fem3d.solution.reduced import Reduced
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base, Krylov, Transient
from fem3d.spaces.bricks import BrickSpace
from scenes import laws
from scenes.errors import BeyondLawError, RunawayInTimeError
from scenes.laws import Table
from scenes.model import bends

GENERATIONS, MORE = 6, 4  # of Krylov fields to start with, and at a time where they don't do
INSTANTS = 12  # at which the full equations are looked at
STATES = 24  # between which laws are interpolated, to start with: tables bend, and take as many as there may be
ROUNDS, LOWER = 8, 2  # at most; of a lower space, which begins with what the fine one's have found
LOOSE, TIGHT = 0.02, 0.005  # of the accuracy: the steps of the rounds, and of the last
ENOUGH = 0.1  # of the accuracy, relative to the largest rise: corrections with which the rounds end
KEPT = 0.01  # of the accuracy: corrections, relative to the largest state, that become fields
# Of the accuracy: what is left between states, relative to the property; and as long as the states are guessed.
INTERPOLATED, GUESSED = 0.03, 0.1
PATIENCE = 2  # rounds that may leave no less than the best before
SAME_TIME = 0.05  # relative change of the time of a runaway from round to round, which counts as none
FALLS, STALLED = 0.25, 0.9  # factors from round to round by which what is left should fall, and has to
SURE = 0.05  # of the accuracy: what a finer quadrature of a law may change of the rise
COARSE = 8.0  # factor between the steps that corrections are made with
ALIKE = 0.1  # relative change of what a state's outflow dissipates, up to which the cold problem stands for the hot one


class Pair(NamedTuple):
    """The response of the last round, and that of the one before, in fewer fields and longer steps."""

    last: Transient
    before: Transient


def of(base: Base, shift: float, study: Study, generations: int = 0, accuracy: float | None = None) -> Rounds:
    """The rounds of a base for a study, whose first fields are ``generations``, or more, of a ``shift`` (s); to an
    ``accuracy`` that may be larger than that of the study."""
    count = GENERATIONS + int(max(0.0, -np.log10(study.accuracy) - 3) * 2)
    count = count if base.before is not None else max(count, generations)
    given = base.heat, base.conductor, base.steady, shift, study.end, study.earliest, accuracy or study.accuracy, count
    return Rounds(*given, before=base.before)


@dataclass
class Rounds:
    """The rounds of one space: the exact problem, its ``base`` with the potentials of its patterns, ``generations`` of
    Krylov fields, and the corrections, states and problem linearized about a ``hot`` state that are known so far, the
    states from the response on other bricks ``before``."""

    heat: HeatProblem
    conductor: Conductor | None
    steady: SteadyState | None
    shift: float
    end: float
    earliest: float
    accuracy: float
    generations: int = GENERATIONS
    before: Transient | None = None

    def __post_init__(self) -> None:
        heat = self.heat
        self.joined, self.finer = list[Hot](), list[np.ndarray]()
        self.base, self.potentials = transient_base.cold(heat, self.conductor)
        self.hot = None if self.steady is None else self.steady.heat
        if self.hot is not None and self.hot.about is None and self.steady is not None:
            self.hot = self._linearized(self.steady.rise, heat.inputs.at(np.zeros(1))[0])
        if self.steady is not None:
            rise = (self.steady.rise - heat.lifts[0])[: heat.free]
            self._join(Hot(self.steady.rise, heat.inputs.at(np.zeros(1))[0], True))
            assert self.hot is not None
            fields = rise[:, None]
            if self._warm is not heat:
                warm = Base(self.hot, None, [], fields, [heat.mass @ heat.whole(rise)])
                fields = Krylov(warm, self.shift).fields(GENERATIONS - 2)
            self.base = replace(self.base, fields=np.column_stack([self.base.fields, fields]), size=heat.norm(rise))
        self.time, self.kept = np.inf, KEPT * self.accuracy
        self.states = self._known()
        if len(self.states):
            fields = _leading(heat, self.states[:, : heat.free], self.kept * heat.norm(self.states[-1, : heat.free]))
            self.base = replace(self.base, fields=np.column_stack([self.base.fields, fields]))
        self.krylov, self.corrections = Krylov(self.base, self.shift), np.empty((heat.free, 0))
        self.left, self.unsure = np.inf, np.inf if heat.terms else 0.0

    def run(self) -> Pair:
        """The response up to the end. Raises RunawayInTimeError where it runs away."""
        domain = self.heat.domain
        given = [each for m in domain.materials for _, each in m.given()]
        given += [b.value for b in domain.scene.boundaries if bends(b)]
        count = MOST if any(isinstance(law, Table) for each in given for law in laws.of(each)) else STATES
        if not len(self.states):
            self.states = self._guessed(self.march(self.base.project(self.fields), LOOSE)[0], count)
        best, since = np.inf, 0
        for _ in range(ROUNDS):
            before, again = self.march(self.reduced(), LOOSE)
            known, self.left = self.left, self.correct(before)
            # What finer quadratures change hides whether the fields get better.
            sure, most = self.unsure <= SURE * self.accuracy, count == MOST
            best, since = min(best, self.left), 0 if self.left < STALLED * best or not sure else since + 1
            count = min(2 * count, MOST) if sure and self.left > FALLS * known else count
            self.states = before.rises(self.instants(count, before.end))
            changed = abs(again - self.time) > SAME_TIME * again if again < np.inf else self.time < np.inf
            self.time = again
            if not changed and (self.left <= ENOUGH * self.accuracy or (since == PATIENCE and most)):
                break
        last = self._marched(self.reduced(), self.end, TIGHT)
        return Pair(last, before)

    def beside(self, base: Base, corrected: bool = False) -> Transient:
        """The response of the ``base`` of a lower space, by what these rounds have found: what of their corrections,
        states and currents that space holds; ``corrected`` by rounds of its own."""
        rounds = replace(self, heat=base.heat, conductor=base.conductor, steady=base.steady)
        for field in self.finer:
            rounds._take(rounds.heat.with_terms(self.heat.terms), field)

        def lower(rises: np.ndarray) -> np.ndarray:
            held: np.ndarray = rounds.heat.take(self.heat.field(rises))
            return held

        for state in self.joined[len(rounds.joined) :]:
            rounds._join(state._replace(rise=lower(state.rise)))
        rounds.corrections = lower(self.corrections.T)[:, : rounds.heat.free].T
        rounds.states, rounds.left = lower(self.states), self.left
        answer = rounds._marched(rounds.reduced(), self.end, TIGHT)
        # Its quadratures are those of the fine one.
        rounds.unsure = 0.0
        for _ in range(LOWER if corrected else 0):
            if rounds.correct(answer) <= ENOUGH * self.accuracy:
                break
            rounds.states = answer.rises(rounds.instants(max(len(rounds.states), STATES), self.end))
            answer = rounds._marched(rounds.reduced(), self.end, TIGHT)
        return answer

    def tighter(self, accuracy: float) -> None:
        """Goes on to a smaller accuracy with the next `run`."""
        self.accuracy, self.kept = accuracy, KEPT * accuracy

    def _known(self) -> np.ndarray:
        """(k, all nodes): states of the response before; none without, or where either isn't on bricks."""
        heat, before = self.heat, self.before
        space, other = heat.domain.space, None if before is None else before.base.heat.domain.space
        if before is None or not (isinstance(space, BrickSpace) and isinstance(other, BrickSpace)):
            return np.empty((0, heat.size))
        fields = before.base.heat.field(before.rises(self.instants(STATES, before.end)))
        return np.array([heat.take(space.interpolated(other, u)) for u in fields])

    def more(self) -> None:
        """More fields for the next `run`: generations, and corrections that were left out."""
        self.generations += MORE
        self.kept /= COARSE

    @property
    def fields(self) -> np.ndarray:
        """(free nodes, any number)."""
        return np.column_stack([self.krylov.fields(self.generations), self.corrections])

    def reduced(self) -> Reduced:
        """The reduced problem in the fields that there are, its laws interpolated between the states that are known."""
        states = self.states
        if self.steady is not None:
            states = np.vstack([states, self.steady.rise])
        linear = self.base.project(self.fields)
        enough = (INTERPOLATED if self.left < np.inf else GUESSED) * self.accuracy
        return with_laws(linear, self.heat, self.conductor, self.base.patterns, states, enough)

    def march(self, reduced: Reduced, share: float) -> tuple[Transient, float]:
        """The response up to the end, or to where it is about to run away, and when it does (s)."""
        try:
            return self._marched(reduced, self.end, share), np.inf
        except (BeyondLawError, RunawayInTimeError) as stop:
            return self._marched(reduced, transient_base.BEFORE * stop.time, share), stop.time

    def _marched(self, reduced: Reduced, end: float, share: float) -> Transient:
        """The response up to an end (s). Where the conductivity follows the temperature, heat that enters after a jump
        needs steps as short as what diffuses then."""
        return transient.march(self.base, reduced, end, share * self.accuracy, graded=self.earliest)

    def _guessed(self, linear: Transient, count: int) -> np.ndarray:
        """States (k, all nodes) between which laws are interpolated first: those of the linear problem, as large as the
        steady state in the end where that is known."""
        states = linear.rises(self.instants(count, linear.end))
        if self.steady is None:
            return states
        ratio = np.abs(self.steady.rise).max() / max(np.abs(states[-1]).max(), 1e-300)
        return np.asarray(states * ratio)

    def instants(self, count: int, end: float) -> np.ndarray:
        """Some times (s) up to an end, close together after the start and after bends and jumps of the inputs."""
        knots = np.append(0.0, self.heat.inputs.knots(end))
        knots = knots[np.unique(np.linspace(0, len(knots) - 1, 8).astype(int))]
        times, each = [], max(4, count // len(knots))
        for knot, following in zip(knots, np.append(knots[1:], end), strict=True):
            gap = following - knot
            times.append(knot + np.geomspace(min(self.earliest, gap / 2), gap * (1 - 1e-9), each))
        return np.concatenate(times)

    def correct(self, answer: Transient) -> float:
        """Adds to the fields what the full equations lack at some instants, and to the currents what they are there;
        how large that is, relative to the largest rise."""
        heat, conductor, inputs = self.heat, self.conductor, self.heat.inputs
        times = self.instants(INSTANTS, answer.end)
        (a, rates), g, changing = answer.states(times), inputs.at(times), inputs.rates(times)
        rises = answer.rises(times)
        speeds = heat.whole(rates @ answer.reduced.basis.T) + changing @ heat.lifts
        largest = float(np.abs(rises[:, heat.unit == 1.0]).max(initial=1e-300))
        loads, moved = g @ heat.loads, np.zeros(len(times))
        most = 1e-300
        finer, better = [np.zeros(heat.size) for _ in times], self._finer(rises)
        for i, rise in enumerate(rises):
            loads[i] -= heat.outflow(rise) + heat.stored(rise, speeds[i])
            if better is not None:
                finer[i] = heat.outflow(rise) - better.outflow(rise)
            if conductor is None or not self.potentials or not conductor.conducts(rise):
                continue
            load = transient_base.heated(conductor, Hot(rise, g[i], False), self.potentials)[1]
            c = answer.reduced.currents(a[i : i + 1], answer.reduced.wide(a[i : i + 1], g[i : i + 1]))[0]
            told = conductor.joule_load(combined(self.base.patterns, c), rise)
            most = max(most, float(np.abs(load).sum()))
            moved[i] = np.abs(load - told).sum()
            loads[i] += load
        if self.hot is None:
            self.hot = self._linearized(rises[int(np.abs(rises).max(axis=1).argmax())], g[-1])
        both = self._stepped(np.tile(times, 2), np.tile(rises, (2, 1)), np.vstack([loads, finer])[:, : heat.free])
        changes, off = both[: len(times)], both[len(times) :]
        vertices = heat.unit[: heat.free] == 1.0
        seen, unsure = (np.abs(x[:, vertices]).max(axis=1, initial=0.0) / largest for x in (changes, off))
        size = max(heat.norm(rise[: heat.free]) for rise in rises) or 1.0
        self.corrections = np.column_stack([self.corrections, _leading(heat, changes, self.kept * size)])
        if moved.max() > transient_base.SAME * self.accuracy * most:
            worst = int(moved.argmax())
            self._join(Hot(rises[worst], g[worst], True))
        if better is not None:
            self.unsure = float(unsure.max())
            if self.unsure > SURE * self.accuracy:
                self._take(better, heat.field(rises[int(unsure.argmax())]))
        return float(seen.max()) + self.unsure

    def _finer(self, rises: np.ndarray) -> HeatProblem | None:
        """The problem by finer quadratures of its laws for some states; None where they are known to do: what bends
        moves from round to round."""
        heat = self.heat
        if not heat.terms or self.unsure <= SURE * self.accuracy:
            return None
        return heat.with_terms(tuple(term.finer(2) for term in heat.terms))

    def _take(self, better: HeatProblem, field: np.ndarray) -> None:
        """Takes a finer quadrature, of the resistivity one that is so for a field (functions,)."""
        self.heat, self.conductor = better, self.conductor and self.conductor.finer(2)
        self.base = replace(self.base, heat=self.heat, conductor=self.conductor)
        self.finer.append(field)

    @property
    def _warm(self) -> HeatProblem:
        """The problem linearized about the hot state, or the cold one where that is much alike."""
        heat, hot = self.heat, self.hot
        assert hot is not None
        assert hot.about is not None
        rise = heat.take(hot.about)
        cold = float(rise @ (heat.stiffness @ rise))
        return heat if abs(float(rise @ (hot.stiffness @ rise)) - cold) < ALIKE * cold else hot

    def _linearized(self, rise: np.ndarray, drive: np.ndarray) -> HeatProblem:
        density = np.empty(0)
        if self.conductor is not None:
            density = self.conductor.solve(rise, drive @ self.conductor.voltages).density
        return at_films(linearized(self.heat, self.conductor, rise, density), self.heat.field(rise))

    def _stepped(self, times: np.ndarray, rises: np.ndarray, residuals: np.ndarray) -> np.ndarray:
        """(times, free nodes): what one step of the full problem, as long as it is since the last knot, makes of
        residuals: of the cold one or the hot, whichever is nearer."""
        problem, knots = self._warm, np.append(0.0, self.heat.inputs.knots(self.end))
        since = times - knots[np.searchsorted(knots, times, side="right") - 1]
        steps = np.round(np.log(since) / np.log(COARSE)).astype(int)
        warm = np.zeros(len(rises), bool)
        if problem.about is not None:
            warm = np.abs(rises).max(axis=1) > 0.5 * np.abs(self.heat.take(problem.about)).max()
        changes = np.empty_like(residuals)
        for hot, step in sorted(set(zip(warm.tolist(), steps.tolist(), strict=True))):
            at, length = (warm == hot) & (steps == step), COARSE**step
            changes[at] = length * (problem if hot else self.heat).solve_shifted(length)(residuals[at])
        for each in (problem, self.heat):
            each.let_go()
        return changes

    def _join(self, state: Hot) -> None:
        """The currents of a state, and their Joule load, with those that are known."""
        if self.conductor is None or not self.potentials:
            return
        hot, load = transient_base.heated(self.conductor, state, self.potentials)
        self.base, self.potentials = transient_base.joined_by(self.base, self.potentials, state, hot, load)
        self.joined.append(state)


def _leading(heat: HeatProblem, fields: np.ndarray, smallest: float) -> np.ndarray:
    """(free nodes, any number): the principal parts of some fields (k, free nodes) that are larger than that."""
    gram = fields @ (heat.inner_mass @ fields.T)
    sizes, turn = np.linalg.eigh((gram + gram.T) / 2)
    leading: np.ndarray = fields.T @ turn[:, np.sqrt(np.maximum(sizes, 0.0)) > smallest]
    return leading
