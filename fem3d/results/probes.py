"""Evaluate each probe on a solution: means and heat flows are linear functionals, extremes are searched for.

The flow of a whole boundary of given temperature is its reaction, which converges twice as fast as the integrated
gradient used elsewhere.

For an extreme a lattice in every cell selects the halves, quarters or eighths of cells that may hold the extreme.
Lattices of half the size around each best point then converge. The gain of the last lattice estimates the remainder:
the error near an extreme is quadratic in the spacing, so that all further lattices together would gain a third of the
last gain.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from fem3d.problems.assembly import Surface, film
from fem3d.problems.following import Conduction, at_faces
from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import across
from fem3d.solution.transient import Base
from fem3d.spaces.domain import Domain, Patch
from fem3d.spaces.integrals import AT_ONCE, Faces, Space
from scenes.model import Schedule, bends
from statespace import channels

FINE, TURNS = 5, 6  # points along each side of a finer lattice, and how many there are: to 1/128 of a side
# The top of a cell may lie above its best lattice point by this fraction of the span of the function on the lattice.
MISSED = 0.1
CANDIDATES = 24  # parts of cells for each time, at most: as many cells may share a vertex


class Place(NamedTuple):
    """The cell of an extreme, and its reference point (3,)."""

    cell: int
    point: np.ndarray

    def row(self, space: Space) -> np.ndarray:
        """(functions,): the row that reads a function there."""
        row = np.zeros(space.size)
        row[space.dofs[:, self.cell]] = space.at(self.point[:, None])[0]
        return row


class Extreme:
    """The largest value (``sign`` 1) or the smallest one (-1) over some parts of cells."""

    def __init__(self, space: Space, patches: Sequence[Patch], sign: float) -> None:
        self._space, self._sign = space, sign
        self._simplex = len(space.mesh.t) == 4
        self._patches = [p for p in patches if len(p[0])]
        self.parts = space, patches, sign

    def __call__(self, fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(times,) twice: extremes of the sums of functions (r, functions) with weights (times, r), and the estimated
        remainder of the search for each."""
        values, doubts, _ = self._search(fields, weights)
        return self._sign * values, doubts

    def where(self, function: np.ndarray) -> Place:
        """Return the place of the extreme of a function (functions,)."""
        return self._search(function[None], np.ones((1, 1)))[2][0]

    def _search(self, fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[Place]]:
        values, doubts = np.full(len(weights), -np.inf), np.zeros(len(weights))
        places = [Place(-1, np.zeros(3))] * len(weights)
        for cells, corner, sides in self._patches:
            points = np.array(list(product(np.linspace(0, 1, self._space.p + 2), repeat=len(sides))))
            points = points[self._inside(points)]
            corners = np.flatnonzero(np.isin(points, (0, 1)).all(axis=1))
            shapes = self._space.at((corner + points @ sides).T)
            local = self._sign * fields[:, self._space.dofs[:, cells]]
            vertices = self._space.unit[self._space.dofs[:, cells[0]]] == 1.0
            step = max(1, AT_ONCE // local[0].size)
            for start in range(0, len(weights), step):
                functions = np.tensordot(weights[start : start + step], local, (1, 0))
                times, cell = self._reaching(functions, shapes, corners, vertices)
                chosen, at, tops = self._candidates(times, functions[times, :, cell], shapes, points)
                times, cell = times[chosen], cell[chosen]
                at, tops, left = self._close(times, functions[times, :, cell], at, tops, corner, sides)
                for n in np.argsort(tops, kind="stable").tolist():
                    if tops[n] > values[when := start + int(times[n])]:
                        values[when], doubts[when] = tops[n], left[n]
                        places[when] = Place(int(cells[cell[n]]), corner + at[n] @ sides)
        return values, doubts, places

    @staticmethod
    def _reaching(
        functions: np.ndarray, shapes: np.ndarray, corners: np.ndarray, vertices: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """Times and cells whose functions (times, functions of a cell, cells) may reach the extreme.

        With ``shapes`` (points, functions of a cell) at a lattice, a function is at most its largest coefficient of a
        vertex plus the sum of its other coefficients times the largest sizes of their shapes; the extreme is at least
        the largest value at the ``corners``.
        """
        sizes = np.abs(shapes).max(axis=0)
        highest = functions[:, vertices & (sizes > 0)].max(axis=1)
        bounds = highest + np.tensordot(np.abs(functions[:, ~vertices]), sizes[~vertices], (1, 0))
        attained = np.tensordot(functions, shapes[corners], (1, 1)).max(axis=(1, 2))
        return np.nonzero(bounds >= attained[:, None])

    @staticmethod
    def _candidates(
        times: np.ndarray, functions: np.ndarray, shapes: np.ndarray, points: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which functions (n, functions of a cell) may hold the extreme of their time, their best points of a lattice
        (k, sides) and the values there (k,); each part of a cell has its best point: parts are halves of a line,
        quarters of a side, eighths of a cell."""
        part = (points > 0.5) @ 2 ** np.arange(points.shape[1])
        members = [np.flatnonzero(part == k) for k in np.unique(part)]
        best, tops = np.empty((len(functions), len(members)), int), np.empty((len(functions), len(members)))
        bounds, step = np.empty_like(tops), max(1, AT_ONCE // len(points))
        for some in (slice(i, i + step) for i in range(0, len(functions), step)):
            values = functions[some] @ shapes.T
            best[some] = np.stack([at[values[:, at].argmax(axis=1)] for at in members], axis=1)
            tops[some] = np.take_along_axis(values, best[some], axis=1)
            bounds[some] = tops[some] + MISSED * np.ptp(values, axis=1)[:, None]
        whose = np.repeat(np.arange(len(functions)), len(members))
        order = np.lexsort((-tops.ravel(), times[whose]))
        whose, best, tops, bounds = whose[order], best.flat[order], tops.flat[order], bounds.flat[order]
        # The parts of each time are in a row, the highest one first.
        firsts = np.searchsorted(times[whose], times[whose])
        found = (np.arange(len(order)) - firsts < CANDIDATES) & (bounds >= tops[firsts])
        return whose[found], points[best[found]], tops[found]

    def _close(
        self,
        times: np.ndarray,
        functions: np.ndarray,
        places: np.ndarray,
        values: np.ndarray,
        corner: np.ndarray,
        sides: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(n, sides) and (n,) twice: the tops of functions (n, functions of a cell) near some places (n, sides) with
        ``values`` (n,), the values there, and the gains of the last lattice. Functions that cannot reach the top of
        their time any more are left out of finer lattices."""
        around = np.array(list(product(np.linspace(-1, 1, FINE), repeat=len(sides))))
        going, highest = np.arange(len(functions)), np.full(times.max() + 1, -np.inf)
        gains, bounds = np.zeros((2, len(functions)))
        step = max(1, AT_ONCE // (len(around) * functions.shape[1]))
        for turn in range(1, TURNS + 1):
            for some in (going[i : i + step] for i in range(0, len(going), step)):
                # Most tops stay where they are over time.
                middles, same = np.unique(places[some], axis=0, return_inverse=True)
                near = np.clip(middles[:, None] + 0.5**turn * around, 0.0, 1.0)
                shapes = self._space.at((corner + near @ sides).reshape(-1, 3).T).reshape(*near.shape[:2], -1)
                each = np.einsum("nf,nmf->nm", functions[some], shapes[same], optimize=True)
                outside = ~self._inside(near)[same]
                lowest = np.where(outside, np.inf, each).min(axis=1)
                each[outside] = -np.inf
                best = each.argmax(axis=1)
                tops = each[np.arange(len(each)), best]
                gains[some], values[some] = np.maximum(tops - values[some], 0.0), tops
                places[some], bounds[some] = near[same, best], tops + MISSED * (tops - lowest)
            np.maximum.at(highest, times, values)
            going = going[bounds[going] >= highest[times[going]]]
        return places, values, gains

    def _inside(self, points: np.ndarray) -> np.ndarray:
        """(...,): whether points (..., sides) lie in their part, a triangle or a tetrahedron on tetrahedra."""
        return points.sum(axis=-1) <= (1 + 1e-12 if self._simplex else np.inf)


class KnownPlaces(Extreme):
    """An extreme that is searched for once, and is then read at the same places of the cells.

    Beside a solution the change of the place changes an extreme to the second order alone (envelope theorem).
    """

    _places: Sequence[Place] = ()

    def __call__(self, fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self._places = self._places or self._search(fields, weights)[2]
        values = np.empty(len(weights))
        for k, (cell, point) in enumerate(self._places):
            values[k] = weights[k] @ (fields[:, self._space.dofs[:, cell]] @ self._space.at(point[:, None])[0])
        return values, np.zeros(len(weights))


Conductivity = Callable[[Faces, np.ndarray], np.ndarray]
"""The conductivity at facets seen from some cells: (facets, 1 or points), or with axes in front."""
Row = Callable[[np.ndarray], np.ndarray]
"""(all nodes,) at a field (functions,)."""


@dataclass(frozen=True, eq=False)
class Reading:
    """value = row @ rise + entering @ g + the flows or currents of ``boundaries``, currents times ``sign``; or the
    value is its ``extreme``. Rows are over all nodes. ``gradient``: whether the row integrates a gradient. ``by_law``:
    the contribution of a term of a nonlinear problem to the row at a field (functions,), or None. The problem is an
    argument: it stores its readings, and a reference back would keep both in memory."""

    row: np.ndarray
    entering: np.ndarray
    boundaries: tuple[str, ...] = ()
    sign: float = 1.0
    extreme: Extreme | None = None
    gradient: bool = False
    by_law: Callable[[HeatProblem, Any], Row | None] = lambda heat, term: None

    def whole_row(self, heat: HeatProblem) -> np.ndarray:
        """(all nodes,): the derivative of the value by the rise, reactions included."""
        return sum((heat.held_rows[name][0] for name in self.boundaries), self.row)


def reading(heat: HeatProblem, probe: Any) -> Reading:
    """Return the `Reading` of a probe of a temperature, a heat flow or a current, from a cache."""
    known: Reading = heat.kept.get(f"reading {probe.name}", lambda: _reading(heat, probe))
    return known


def keep_places(heat: HeatProblem) -> dict[str, Any]:
    """Return the readings of extremes at `KnownPlaces`, to be told to problems on the same cells beside this one."""
    extremes = {p.name: reading(heat, p) for p in heat.domain.scene.probes if p.quantity == "temperature"}
    return {
        f"reading {name}": replace(how, extreme=KnownPlaces(*how.extreme.parts))
        for name, how in extremes.items()
        if how.extreme is not None
    }


def _reading(heat: HeatProblem, probe: Any) -> Reading:
    domain, still = heat.domain, np.zeros(heat.inputs.count)
    nothing = np.zeros(heat.size)
    if probe.quantity == "temperature":
        if probe.reduce == "mean":
            return Reading(heat.take(domain.mean(probe)), still)
        return Reading(nothing, still, extreme=extreme(domain, probe))
    if probe.quantity == "current":
        names, sign = _electrodes(domain, probe)
        return Reading(nothing, still, names, sign)
    facets = domain.facets(probe)
    within = [
        (b, on, shared)
        for b in domain.scene.boundaries
        if b.kind != "voltage" and len(shared := np.intersect1d(on := domain.on(b), facets))
    ]
    cut = any(b.kind == "temperature" and len(shared) < len(on) for b, on, shared in within)
    conditions = domain.conditions_first and within
    if not conditions and (cut or not domain.exposed(facets).any()):
        row = gradient(domain, probe, _conductivity(heat))
        return Reading(heat.take(row), still, gradient=True, by_law=_by_law(probe))
    row, entering = nothing, still
    for b, on, shared in within:
        if bends(b) and heat.about is not None:
            into, per_kelvin = _bent(heat, heat.about, b, domain.seen(shared))
            row, entering = row + heat.take(per_kelvin), entering + into
        elif b.kind != "temperature":
            area = domain.seen(shared).load()
            entering = (
                entering + float(area @ domain.space.unit / domain.seen(on).areas.sum()) * heat.films[b.name].entering
            )
            if b.kind in ("convection", "radiation") and not isinstance(b.value, Schedule):
                row = row - (film(domain, b)[0] if bends(b) else b.value) * heat.take(area)
    held = tuple(b.name for b, _, _ in within if b.kind == "temperature")
    if heat.about is not None:
        return Reading(row, entering, held)

    def by_law(heat: HeatProblem, term: Any) -> Row | None:
        faces = [] if not isinstance(term, Surface) else [on for b, _, on in within if b in term.boundaries]
        return (lambda u: -heat.take(sum(term.through(term.on_one(on), u) for on in faces))) if faces else None

    return Reading(row, entering, held, by_law=by_law)


def _bent(heat: HeatProblem, about: np.ndarray, boundary: Any, on: Faces) -> tuple[np.ndarray, np.ndarray]:
    """The heat that enters through some faces of a boundary with a flux nonlinear in temperature, by the tangent at
    the state (functions,) of a problem's linearization: at zero rise (channels,) in W, and per kelvin
    (functions,)."""
    terms = (t for t in (heat.exact or heat).terms if isinstance(t, Surface) and boundary in t.boundaries)
    still, per_kelvin = next(terms).entering(about, on)
    entering = np.zeros(heat.inputs.count)
    entering[0] = still
    return entering, per_kelvin


def extreme(domain: Domain, probe: Any, inside: np.ndarray | None = None) -> Extreme:
    """The largest or smallest value over a probe, in some cells."""
    return Extreme(domain.space, domain.patches(probe, inside), 1.0 if probe.reduce == "max" else -1.0)


def gradient(domain: Domain, probe: Any, conductivity: Conductivity) -> np.ndarray:
    """(functions,): the heat (W) that passes a flat probe, per rise, for a conductivity of facets seen from some cells:
    on the surface into the solid, inside the mean of the flows of both sides, at contacts by the jump."""
    facets = domain.facets(probe)
    outer = facets[domain.exposed(facets)]
    row = np.zeros(domain.space.size)
    if len(outer):
        seen = domain.seen(outer)
        row -= seen.flux(conductivity(seen, domain.space.mesh.f2t[0, outer]))
    jumping = [(joint.facets, r) for joint in domain.contacts if (r := joint.contact.thermal_resistance)]
    every = np.ones(len(domain.body), bool)
    for faces, sign, cells in domain.sides(probe, every, [torn for torn, _ in jumping]):
        row += sign * faces.flux(conductivity(faces, cells))
    return row + across(domain, probe, jumping)


def cell_by_cell(conductivity: np.ndarray) -> Conductivity:
    """Return the `Conductivity` for values by cell: (cells,), or (3, cells) along the axes."""
    return lambda faces, cells: conductivity[..., cells, None]


def _conductivity(heat: HeatProblem) -> Conductivity:
    """The `Conductivity` of a heat problem, at the state of its linearization."""
    about, domain = heat.about, heat.domain
    if about is None:
        return cell_by_cell(domain.per_cell("thermal_conductivity"))
    return lambda faces, cells: at_faces(domain, about, faces, cells)


def _by_law(probe: Any) -> Callable[[HeatProblem, Any], Row | None]:
    """`Reading.by_law` of a section."""

    def by_law(heat: HeatProblem, term: Any) -> Row | None:
        if heat.about is not None or not isinstance(term, Conduction):
            return None
        domain = heat.domain
        cold = cell_by_cell(domain.per_cell("thermal_conductivity"))

        def changed(u: np.ndarray) -> np.ndarray:
            return heat.take(gradient(domain, probe, lambda f, cells: at_faces(domain, u, f, cells) - cold(f, cells)))

        return changed

    return by_law


def _electrodes(domain: Domain, probe: Any) -> tuple[tuple[str, ...], float]:
    """The electrodes that a flat probe covers, and the sign of their entering currents; none where current only passes
    the probe."""
    facets = domain.facets(probe)
    names = [
        b.name
        for b in domain.scene.boundaries
        if b.kind == "voltage" and len(on := domain.on(b)) and np.isin(on, facets).all()
    ]
    if names and domain.conditions_first:
        return tuple(names), 1.0
    pairs = domain.space.mesh.f2t[:, facets]
    alive = (pairs >= 0) & domain.live[pairs]
    if not names or alive.all(axis=0).any():
        return (), 1.0
    touching = alive.any(axis=0)
    facets, alive = facets[touching], alive[:, touching]
    if domain.exposed(facets).all():
        return tuple(names), 1.0
    # Inside the solid: along the direction that counts, out of the electrode into the cell that conducts.
    out_of_first = domain.directions(probe)[touching]
    into = np.where(alive[0], -out_of_first, out_of_first)
    return (tuple(names), float(into[0])) if (into == into[0]).all() else ((), 1.0)


def starts_free(domain: Domain, probe: Any) -> bool:
    """Return whether a mean temperature equals the initial temperature at t = 0: no part of the probe, of the same
    dimension, lies on a boundary of given temperature."""
    held = [b for b in domain.scene.boundaries if b.kind == "temperature"]
    if domain.locate(probe).dimension == 2:
        return not any(len(np.intersect1d(domain.on(b), domain.facets(probe))) for b in held)
    fixed = np.any([np.zeros(domain.space.size, bool), *(domain.faces(b).functions for b in held)], axis=0)
    return not fixed[np.flatnonzero(domain.mean(probe))].all()


class Voltmeter:
    """A potential probe on a mesh, restricted to the cells ``inside``; ``still`` lists functions at given voltages."""

    def __init__(self, domain: Domain, probe: Any) -> None:
        self._domain = domain = domain.electric
        self.inside = inside = np.any([domain.live, *(part for part, _ in domain.still)], axis=0)
        self.still = []
        for cells, voltage in domain.still:
            if isinstance(voltage, str):  # the potential that is solved for knows it
                continue
            self.still.append((np.where(domain.space.of(cells), domain.space.unit, 0.0), voltage))
        self._row = domain.mean(probe, inside) if probe.reduce == "mean" else None
        self._extreme = None if probe.reduce == "mean" else extreme(domain, probe, inside)

    def read(self, potential: np.ndarray | None, time: float) -> float:
        """The probe's value (V) for a potential (functions,) at a time (s)."""
        field = self.field(potential, time)
        if self._row is not None:
            return self.mean(field)
        assert self._extreme is not None
        return float(self._extreme(field[None], np.ones((1, 1)))[0][0])

    def mean(self, field: np.ndarray) -> float:
        """The mean (V) over a probe of a mean of a potential (functions,)."""
        assert self._row is not None
        return float(self._row @ field)

    def field(self, potential: np.ndarray | None, time: float) -> np.ndarray:
        """(functions,): the potential in parts with and without current."""
        field = np.zeros(self._domain.space.size) if potential is None else potential.copy()
        for functions, voltage in self.still:
            field = np.where(functions > 0, functions * channels.value(voltage, np.array([time]))[0], field)
        return field


def potential_over_time(base: Base, rises: Callable[[], np.ndarray], probe: Any, times: np.ndarray) -> np.ndarray:
    """(times,): the potential (V) of a probe outside of the reduced problem: an extreme, or in parts without current.
    Where resistivity varies, the electric problem is solved at each time for the ``rises`` (times, all nodes)."""
    conductor, heat, g = base.conductor, base.heat, base.heat.inputs.at(times)
    meter = Voltmeter(heat.domain, probe)
    if conductor is None:
        return np.array([meter.read(None, float(t)) for t in times])
    if not conductor.warms:
        cold = np.zeros(heat.size)
        fields = np.stack([conductor.solve(cold, v).potential for v in conductor.voltages])
        return np.array([meter.read(x @ fields, float(t)) for x, t in zip(g, times, strict=True)])
    readings, guess = [], None
    for rise, voltage, time in zip(rises(), g @ conductor.voltages, times, strict=True):
        guess = conductor.solve(rise, voltage, guess).potential
        readings.append(meter.read(guess, float(time)))
    return np.array(readings)
