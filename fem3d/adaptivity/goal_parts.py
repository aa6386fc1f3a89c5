"""Contributions of the last two degrees to each goal of a level: dual-weighted residuals of the heat and the current.

With the dual solution z of a goal and the residual r of the solution in the next lower space, a degree changes the goal
by the sum of z_i r_i over the functions i that it adds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from fem3d.adaptivity import cellwise
from fem3d.adaptivity.estimator import Contributions, Estimator, Spread, degree_products
from fem3d.adaptivity.nested import Problems, Solution, free_functions, parts_of
from fem3d.problems.heat import HeatProblem
from fem3d.results.probes import extreme, reading
from fem3d.results.study import Study
from fem3d.solution.steady import SteadyState
from scenes import physics

Duals = dict[str, list[np.ndarray]]
"""For each thermal goal the dual solutions (functions,) in the two upper spaces, zero at fixed nodes."""


def steady_parts(
    study: Study, given: Problems, fine: Solution, low: Solution, scales: dict[str, float], duals: Duals
) -> dict[str, Contributions]:
    """Return the contributions of degrees p - 1 and p to each goal, over its scale; ``duals`` are of the fine rise."""
    heat, state = given.heat, low.state
    if not physics.heat(given.domain.scene):
        return _potentials(study, given, scales)
    source = heat.loads[0].copy()
    if state.conductor is not None:
        source += heat.take(state.conductor.on.load(state.conductor.heating(state.density, state.density, state.rise)))
    nonlinear = heat.about is not None
    balanced = source + (heat.stiffness @ fine.state.rise - heat.outflow(fine.state.rise) if nonlinear else 0.0)
    residuals = [source - heat.outflow(given.lifted(state.rise, -2))]
    if len(given.heats) > 2:
        # Two degrees lower only the rate matters: it takes the heat of the low solution and the conductivity of the
        # fine one.
        lowest = given.heats[0]
        to_lowest = lowest.take(heat.field(balanced))
        rise = lowest.lifts[0] + lowest.whole(lowest.solve_steady(to_lowest[: lowest.free]))
        residuals.insert(0, balanced - heat.stiffness @ given.lifted(rise, 0))
    thermal = thermal_parts(given, fine.state.rise, residuals, scales, None, duals)
    return thermal | _potentials(study, given, scales)


def thermal_parts(
    given: Problems,
    rise: np.ndarray,
    residuals: Sequence[np.ndarray],
    scales: Mapping[str, float],
    time: float | None,
    duals: Duals,
) -> dict[str, Contributions]:
    """Return the contributions to each thermal goal, over its scale, from the residuals (all nodes) of the two lower
    spaces; ``rise``, ``time`` and ``duals`` as for `duals_of`."""
    heat, space, parts = given.heat, given.domain.space, dict[str, Contributions]()
    depth, residual_fields = space.depth[heat.order], heat.field(np.array(residuals))
    sizes = degree_products(heat.stiffness, rise, depth)
    if time is not None:
        sizes += degree_products(heat.mass, rise, depth) / time
    free = [h.order[: h.free] for h in given.heats]
    tested = []
    # The linearization about a law has its heat by function only, not by cell.
    if space.by_cells and heat.about is None and duals:
        for upper, residual in zip(given.heats[1:], residual_fields, strict=True):
            solve = upper.solve_steady if time is None else upper.solve_shifted(time)
            change = solve((time or 1.0) * upper.take(residual)[: upper.free])
            tested.append(cellwise.heat(heat, upper.field(change), time))
    for name, dual in duals.items():
        scaled = [z / scales[name] for z in dual]
        parts[name] = parts_of(space, free, scaled, [*residual_fields], dual[-1] * heat.field(sizes), tested)
    return parts


def duals_of(goals: Mapping[str, str], given: Problems, rise: np.ndarray, time: float | None) -> Duals:
    """Solve the dual problems of the steady problem, or of a step of ``time`` (s) from rest; extremes are located in
    the fine solution ``rise``."""
    rows = {name: goal_row(given.heat, given.domain.probes[probe], rise) for name, probe in goals.items()}
    thermal = {name: row * (time or 1.0) for name, row in rows.items() if row is not None}
    if not thermal:
        return {}
    loads, fields = np.array(list(thermal.values())), []
    for heat in given.heats[1:]:
        fields.append(heat.field(heat.solve_dual(loads[:, : heat.free], time)))
    return {name: [each[i] for each in fields] for i, name in enumerate(thermal)}


def joule_parts(
    goals: Mapping[str, str],
    given: Problems,
    potentials: Sequence[np.ndarray],
    scales: Mapping[str, float],
    duals: Duals,
) -> dict[str, Contributions]:
    """Return the contributions of degrees p - 1 and p to each thermal goal, over its scale, by way of the Joule heat.

    ``potentials`` (functions,), one in each space, are of the cold conductor. With (f) for the integral of f, the goal
    with dual solution z contains (z sigma |grad phi|^2). From phi to psi in the next higher space the goal changes by
    (z sigma grad(phi + psi) . grad(psi - phi)). This is the residual of phi tested with w, where w solves
    (sigma grad w . grad v) = (z sigma grad(phi + psi) . grad v) for all v of the higher space. The power, z = 1,
    changes by the square of the change of the potential (`electric_parts`). If z is sensitive to heat away from the
    error of the potential, the goal changes in proportion to the change of the current.
    """
    conductor = given.conductor
    if conductor is None or not duals or not any(phi.any() for phi in potentials):
        return {}
    heat, space = given.heat, given.domain.electric.space
    densities = [conductor.on.gradient(a + b) / conductor.cold for a, b in pairwise(potentials)]
    residuals = [-(conductor.matrix @ phi) for phi in potentials[:-1]]
    weights = degree_products(conductor.matrix, potentials[-1], space.depth)
    stills = []
    for name in duals:
        held = reading(heat, given.domain.probes[goals[name]]).boundaries
        stills.append(sum((heat.field(heat.held_fields[b]) for b in held), np.zeros(given.domain.space.size)))
    seen = []
    for k, (upper, density) in enumerate(zip(given.conductors[1:], densities, strict=True)):
        assert upper is not None
        pairs = zip(duals.values(), stills, strict=True)
        flows = np.array([conductor.on.flow(conductor.on.value(dual[k] - still) * density) for dual, still in pairs])
        seen.append(upper.respond(flows))
    tested = [cellwise.current(conductor, b - a) for a, b in pairwise(potentials)] if space.by_cells else []
    parts = {}
    for i, name in enumerate(duals):
        ws = [w[i] / scales[name] for w in seen]
        parts[name] = parts_of(space, free_functions(given), ws, residuals, seen[-1][i] * weights, tested)
    return parts


def warmed(given: Problems, state: SteadyState) -> list[np.ndarray]:
    """Scale the potential (functions,) of the cold conductor in each space to the power of a state; empty without a
    heat problem."""
    conductor = state.conductor
    if conductor is None or not physics.heat(given.domain.scene):
        return []
    potentials = [phi[0] for phi in given.cold_potentials]
    power = float(potentials[-1] @ (conductor.matrix @ potentials[-1]))
    hot = float((conductor.on.weights * conductor.resistivity(state.rise) * (state.density**2).sum(axis=0)).sum())
    return [phi * np.sqrt(hot / max(power, 1e-300)) for phi in potentials]


def at_contradictions(
    goals: Mapping[str, str],
    given: Problems,
    rise: np.ndarray,
    scales: Mapping[str, float],
    time: float | None,
    duals: Duals,
    judge: Estimator,
) -> dict[str, Spread]:
    """Return indicators of each thermal goal, over its scale, at edges where given temperatures contradict each other.

    Empty without such edges; ``rise``, ``time`` and ``duals`` as for `duals_of`. At any degree the jump is spread over
    the first interval or cell beside the edge. The error is the jump times the residual of the dual problem at its
    node, whose functions carry the dual heat of both sides: in equal parts to the intervals that end there, or to the
    cells around it.
    """
    heat, space = given.heat, given.domain.space
    nodes = np.flatnonzero(heat.torn)
    if not len(nodes):
        return {}
    spreads = {}
    for name, of_spaces in duals.items():
        row = goal_row(heat, given.domain.probes[goals[name]], rise)
        assert row is not None
        dual = heat.take(of_spaces[-1])
        residual = row - heat.turned(dual) - (0.0 if time is None else heat.mass @ dual / time)
        spreads[name] = judge.at_vertices(space, heat.order[nodes], (heat.torn * residual)[nodes] / scales[name])
    return spreads


def summed(a: Mapping[str, Spread], b: Mapping[str, Spread]) -> dict[str, Spread]:
    """Add the spreads of ``b`` to the spreads of ``a`` with the same names."""
    return {n: [x + y for x, y in zip(spread, b[n], strict=True)] if n in b else spread for n, spread in a.items()}


def goal_row(heat: HeatProblem, probe: Any, rise: np.ndarray) -> np.ndarray | None:
    """Return the load vector (all nodes,) of a thermal probe, at an extreme's point; None for an electric probe."""
    if probe.quantity not in ("temperature", "heat_flow"):
        return None
    how = reading(heat, probe)
    if how.extreme is None:
        # Tested with the dual solution minus its values at fixed nodes, whose heat is the reaction itself.
        return how.whole_row(heat)
    return heat.take(how.extreme.where(heat.field(rise)).row(heat.domain.space))


def _potentials(study: Study, given: Problems, scales: Mapping[str, float]) -> dict[str, Contributions]:
    """Return the contributions to potentials inside the conductor and to currents across its contacts, at the initial
    temperature."""
    domain, conductor, space = given.domain.electric, given.conductor, given.domain.electric.space
    if conductor is None:
        return {}
    crossing = {p for p, row in conductor.jumps.items() if row.any()}
    names = [n for n, p in study.goals.items() if p in crossing or domain.probes[p].quantity == "potential"]
    if not names:
        return {}
    *lower, fine = given.cold_potentials
    sizes, parts = degree_products(conductor.matrix, fine.sum(axis=0), space.depth), {}
    residuals = [(conductor.matrix @ phi.T).T.sum(axis=0) for phi in lower]
    pairs = pairwise([*lower, fine]) if space.by_cells else ()
    tested = [cellwise.current(conductor, (b - a).sum(axis=0)) for a, b in pairs]
    for name in names:
        probe = domain.probes[study.goals[name]]
        if probe.name in crossing:
            row = conductor.crossing_row(probe.name)
        elif probe.reduce == "mean":
            row = domain.mean(probe, domain.live)
        else:
            row = extreme(domain, probe, domain.live).where(fine.sum(axis=0)).row(space)
        duals = [upper.respond(row) / scales[name] for upper in given.conductors[1:] if upper is not None]
        parts[name] = parts_of(space, free_functions(given), duals, residuals, duals[-1] * scales[name] * sizes, tested)
    return parts
