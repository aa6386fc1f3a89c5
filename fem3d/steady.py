"""The coupled steady state: fixed-point steps in full, accelerated by the reduced problem that they build.

Each step solves the reduced problem on the fields found so far (which also finds runaway), then the full electric and
the full heat problem at that state. Their answer joins the fields, so the iteration converges like a Krylov method
instead of like Picard's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem3d import operating_point, tensor
from fem3d.conductor import Conductor, Field, Potential, find_conductor, law
from fem3d.errors import NumericsError, RunawayError
from fem3d.operators import HeatProblem
from fem3d.reduced import Reduced, project

CONVERGED = 1e-3  # part of the accuracy that the last step may change the rise by
ROUNDED = 1e-7  # what rounding may do to the rise on the worst meshes, relative
SETTLED = 1e-2  # part of the accuracy below which the iteration also ends where rounding keeps it from getting better
SLOW = 15  # steps after which the reduced problem gets a second current pattern
BACK = 0.8  # of a rise at which the resistivity is not positive
UNIFORM = 5e-2  # part of the accuracy below which a change of the current's pattern isn't followed


@dataclass(frozen=True, eq=False)
class SteadyState:
    """The converged state of one mesh.

    ``rise`` at the free nodes, the ``source`` (W per node, all nodes) that it answers, the Joule heat of each box and
    the current that enters at each electrode; the temperature fields and current patterns of the reduced problem;
    ``pattern_change``: how far heating moves the current's pattern (its relative effect on the rise).
    """

    heat: HeatProblem
    conductor: Conductor | None
    rise: np.ndarray
    source: np.ndarray
    joule: dict[str, float]
    currents: dict[str, float]
    power: float
    potential: np.ndarray | None
    fields: np.ndarray
    patterns: list[Pattern]
    pattern_change: float
    follows_pattern: bool
    steps: int


def solve(heat: HeatProblem, voltage: float, accuracy: float) -> SteadyState:
    """The steady state at the scene's voltages; ``voltage`` (V) names the drive in messages.

    Raises RunawayError where no steady state exists, NumericsError where the iteration does not converge.
    """
    for b in heat.scene.boundaries:
        if b.kind == "temperature" and b.value != heat.scene.initial_temperature:
            raise NumericsError(f"{b.name} has another temperature than the scene starts at: not solved here")
    conductor = find_conductor(heat)
    n = heat.free
    if conductor is None:
        rise = heat.improve(heat.solve_steady(heat.constant_source[:n]), heat.constant_source[:n])
        none = np.empty((n, 0))
        return SteadyState(heat, None, rise, heat.constant_source, {}, {}, 0.0, None, none, [], 0.0, False, 1)
    cold = conductor.solve(np.zeros(n))
    potentials, patterns = [cold], [Pattern.of(conductor, cold)]
    densities, supply = [cold.density], [patterns[0].supply]
    warms = any(conductor.material(b).temperature_coefficient for b in conductor.blocks)
    fields = heat.solve_steady((joule_load(conductor, cold.density, np.zeros(n)) + heat.constant_source)[:n])[:, None]
    follows, change, before = warms, 0.0, np.inf
    for step in range(1, 61):
        reduced = project(heat, conductor, fields, densities, supply)
        point = operating_point.find(reduced)
        rise = reduced.basis @ point.a
        while not conductor.conducts(rise):
            rise = BACK * rise  # few fields may put the state beyond the law's reach; the full step then brings it back
        if follows:
            hot = conductor.solve(rise, potentials[-1].potential)
            load = joule_load(conductor, hot.density, rise)
            expected = point.fraction**-2 * joule_load(conductor, combine(densities, point.c), rise)
            if step == 1:
                change = heat.norm(heat.solve_steady((load - expected)[:n])) / heat.norm(rise)
            if step == 1 and change < UNIFORM * accuracy:
                follows = False
            else:
                potentials = [hot]
                # Away from a fold the latest pattern is the right one in the end; where a fold lies also depends on
                # how the pattern changes along the way, and near it the iteration does.
                patterns = (
                    _independent(conductor, cold, hot) if point.folded or step > SLOW else [Pattern.of(conductor, hot)]
                )
                densities, supply = [p.density for p in patterns], [p.supply for p in patterns]
                load *= point.fraction**2
        if not follows:
            load = joule_load(conductor, combine(densities, point.c), rise)
        source = load + heat.constant_source
        answer = heat.solve_steady(source[:n])
        moved = float(np.abs(answer - rise).max() / np.abs(answer).max())
        stalled = moved < max(SETTLED * accuracy, ROUNDED) and moved > before / 2
        before = moved
        if moved < CONVERGED * accuracy or stalled or (point.folded and moved < 1e-4) or not warms:
            break
        fields = np.column_stack([fields, answer - rise])
    else:
        raise NumericsError(f"the coupled steady state does not converge at {voltage:g} V")
    if point.folded:
        raise RunawayError(voltage, point.fraction * abs(voltage))
    answer = heat.improve(answer, source[:n])
    final = potentials[-1]
    scale = 1.0 if follows else float(point.c[0])
    density = combine([final.density], np.array([scale]))
    joule = box_heat(conductor, density, rise)
    patterns = [Pattern.of(conductor, final)] if not follows else _independent(conductor, cold, final)
    return SteadyState(
        heat, conductor, answer, source, joule,
        {name: scale * final.current(nodes) for name, nodes in conductor.electrodes.items()},
        float(sum(joule.values())), final.potential, np.column_stack([fields, answer]), patterns, change, follows, step,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Pattern:
    """A current field: its density at the Gauss points, the power that the electrodes supply to it at their voltages,
    and the current that enters at each electrode. All three are linear in the field."""

    density: Field
    supply: float
    currents: dict[str, float]

    @staticmethod
    def of(conductor: Conductor, potential: Potential) -> Pattern:
        """The current field of a potential."""
        supply = float(conductor.fixed_voltage @ potential.reaction[conductor.free :])
        currents = {name: potential.current(nodes) for name, nodes in conductor.electrodes.items()}
        return Pattern(potential.density, supply, currents)

    def plus(self, factor: float, other: Pattern, scale: float) -> Pattern:
        """(self + factor * other) * scale."""
        return Pattern(
            [(a + factor * b) * scale for a, b in zip(self.density, other.density, strict=True)],
            (self.supply + factor * other.supply) * scale,
            {name: (i + factor * other.currents[name]) * scale for name, i in self.currents.items()},
        )


def _independent(conductor: Conductor, cold: Potential, hot: Potential) -> list[Pattern]:
    """The cold pattern, and what the hot one adds to it, orthogonal in the cold resistance and of the same size."""
    first, second = Pattern.of(conductor, cold), Pattern.of(conductor, hot)

    def product(a: Field, b: Field) -> float:
        return sum(
            law(conductor.material(block), conductor.heat.scene)[0]
            * float((tensor.weights(parts) * (p * q).sum(axis=0)).sum())
            for block, parts, p, q in zip(conductor.blocks, conductor.parts, a, b, strict=True)
        )

    size = product(first.density, first.density)
    added = second.plus(-product(first.density, second.density) / size, first, 1.0)
    return [first, added.plus(0.0, added, np.sqrt(size / product(added.density, added.density)))]


def combine(densities: list[Field], c: np.ndarray) -> Field:
    """The current field with coefficients c."""
    return [sum(f * d[b] for f, d in zip(c, densities, strict=True)) for b in range(len(densities[0]))]  # type: ignore[misc]


def heating(conductor: Conductor, density: Field, rise: np.ndarray) -> Field:
    """rho |J|^2 at the Gauss points (W/m3)."""
    return [r * (j * j).sum(axis=0) for r, j in zip(conductor.resistivity(rise), density, strict=True)]


def joule_load(conductor: Conductor, density: Field, rise: np.ndarray) -> np.ndarray:
    """(all nodes,): integral of rho |J|^2 v, in W."""
    heat = conductor.heat
    found = np.zeros(heat.size)
    for block, parts, q in zip(conductor.blocks, conductor.parts, heating(conductor, density, rise), strict=True):
        heat.scatter(block, tensor.load(parts, q), found)
    return found


def box_heat(conductor: Conductor, density: Field, rise: np.ndarray) -> dict[str, float]:
    """The Joule heat of each conducting box (W)."""
    found: dict[str, float] = {}
    for block, parts, q in zip(conductor.blocks, conductor.parts, heating(conductor, density, rise), strict=True):
        name = conductor.heat.mesh.boxes[block.box].name
        found[name] = found.get(name, 0.0) + float((tensor.weights(parts) * q).sum())
    return found


def reduced_problem(state: SteadyState, fields: np.ndarray) -> Reduced:
    """The reduced problem on the steady state's current fields and some temperature fields."""
    return project(
        state.heat, state.conductor, fields, [p.density for p in state.patterns], [p.supply for p in state.patterns]
    )
