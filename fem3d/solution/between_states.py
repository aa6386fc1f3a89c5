"""The laws of a reduced problem (`fem3d.solution.interpolated`), made of states that are known: which of these are
taken, and the integrals of what the laws add there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fem3d.problems.current import Conductor, Pattern
from fem3d.problems.faces import Surface
from fem3d.problems.following import Conduction, Storage
from fem3d.problems.heat import HeatProblem
from fem3d.solution import joule_tensors
from fem3d.solution.interpolated import Conducted, Interpolation, Laws
from fem3d.solution.reduced import Reduced

MOST = 60  # states
LOOKED_AT = 8192  # points: so many of a million take some tenths of a second to choose from
AT_ONCE = 4096  # points whose products of fields are kept: 30 MB of 30 fields
# States times axes up to which the products of fields are made for each anew: with 30 and with 75 fields that takes as
# long as making them once, and with a third of them a quarter to a half as long.
FEW = 45


def with_laws(
    reduced: Reduced,
    heat: HeatProblem,
    conductor: Conductor | None,
    patterns: Sequence[Pattern],
    states: np.ndarray,
    tolerance: float,
) -> Reduced:
    """A reduced problem with the laws of its properties, between ``states`` (k, all nodes), to a relative ``tolerance``
    of the properties there."""
    fields = heat.field(np.concatenate([heat.whole(reduced.basis.T), heat.lifts]))
    rises = heat.field(states)
    leaving = [
        _conducted(term, fields, reduced.states, rises, tolerance)
        for term in heat.terms if isinstance(term, Conduction | Surface)
    ]  # fmt: skip
    conduction = next((law for law in leaving if isinstance(law.term, Conduction)), None)
    faces = tuple(law for law in leaving if law is not conduction)
    resistivity = None
    if conductor is not None and conductor.following is not None:
        resistivity, heats = _resisting(conductor, fields, reduced.basis, patterns, rises, tolerance)
        behind = [(0, len(heats.cold)), (0, 0)]
        reduced = replace(
            reduced, **joule_tensors.beside(reduced, heats), supply=np.pad(reduced.supply, behind),
            given=np.pad(reduced.given, behind),
        )  # fmt: skip
    storage = heat.storage
    capacity = None if storage is None else _conducted(storage, fields, reduced.states, rises, tolerance)
    return replace(reduced, laws=Laws(conduction, resistivity, capacity, faces))


def _conducted(
    term: Conduction | Storage | Surface, fields: np.ndarray, r: int, states: np.ndarray, tolerance: float
) -> Conducted:
    excess, averaged, scales = [], [], []
    for on, law, cold, _ in term.parts:
        each = np.stack([law.value(rise) for rise in on.value(states)]) - cold
        excess.append(each)
        averaged.append(each)
        scales.append(np.broadcast_to(cold, each.shape[1:]).ravel())
    # What is known at points is interpolated, and integrated as what it is in all of a cell.
    flat = np.concatenate([e.reshape(len(states), -1) for e in excess], axis=1)
    chosen, points = choose(flat / np.concatenate(scales), tolerance)
    starts = np.cumsum([0, *(s.size for s in scales)])
    numbers = np.searchsorted(starts, points, side="right") - 1
    rows, groups = np.empty((len(points), len(fields))), []
    for number in np.unique(numbers):
        mine, (on, law, cold, _) = np.flatnonzero(numbers == number), term.parts[number]
        shape = excess[number].shape[1:]
        *axis, cells, places = np.unravel_index(np.array(points)[mine] - starts[number], shape)
        for i, cell, place in zip(mine, cells.tolist(), places.tolist(), strict=True):
            rows[i] = on.value_at(fields, cell, place)
        # Of what differs along the axes one at each point.
        along = (*axis, np.arange(len(mine))) if axis else (slice(None),)
        groups.append((mine, law.of(cells), along, np.broadcast_to(cold, shape)[(*axis, cells, 0)]))

    def at_points(rises: np.ndarray) -> np.ndarray:
        values = np.empty_like(rises)
        for mine, some, along, cold in groups:
            values[mine] = some.value(rises[mine])[along] - cold[:, None]
        return values

    matrices, through = np.zeros((len(chosen), r, len(fields))), dict[str, np.ndarray]()
    for number, ((on, _, _, density), each) in enumerate(zip(term.parts, averaged, strict=True)):
        slopes = isinstance(term, Conduction)
        tested = np.array([on.gradient(u) for u in fields]) if slopes else on.value(fields)[:, None]
        weights = on.weights if slopes else on.weights * density
        along = (weights * each[chosen]).reshape(len(chosen), *(each.shape[1:-2] or (1,)), weights.size)
        matrices += _products(along, tested.reshape(*tested.shape[:2], -1), r)
        for name, facets in term.owners[number] if isinstance(term, Surface) else ():
            leaving = np.einsum("scp,fcp->sf", (weights * each[chosen])[:, facets], tested[:, 0, facets])
            through[name] = through.get(name, 0.0) + leaving
    inverse = np.linalg.inv(flat[np.ix_(chosen, points)]) if chosen else np.empty((0, 0))
    interpolation = Interpolation(rows, at_points, inverse)
    return Conducted(term, interpolation, matrices, states[chosen], through)


def _products(weights: np.ndarray, tested: np.ndarray, r: int) -> np.ndarray:
    """(k, r, fields): sums over the points of weights (k, axes or 1, points) times the products of the first ``r``
    fields with all of them (fields, axes, points), which serve all k where these are many."""
    fields, axes = tested.shape[:2]
    if len(weights) * axes <= FEW * weights.shape[1]:
        flat = tested.reshape(fields, -1)
        return np.array([(tested[:r] * weight).reshape(r, -1) @ flat.T for weight in weights]).reshape(-1, r, fields)
    # The products of two of the first fields are there once.
    upper = np.flatnonzero(np.arange(fields) >= np.arange(r)[:, None])
    sums = np.zeros((len(weights), len(upper)))
    for start in range(0, weights.shape[-1], AT_ONCE):
        piece = slice(start, start + AT_ONCE)
        at = tested[:, :, piece].transpose(2, 1, 0)
        for axis, weight in enumerate(weights[:, :, piece].transpose(1, 0, 2)):
            # Where the weights are those of all axes, so is the sum of the products.
            these = at if weights.shape[1] == 1 else at[:, axis : axis + 1]
            sums += weight @ (these[..., :r].transpose(0, 2, 1) @ these).reshape(len(at), -1)[:, upper]
    every = np.zeros((len(weights), r * fields))
    every[:, upper] = sums
    whole = every.reshape(len(weights), r, fields)
    whole[:, :, :r] += np.triu(whole[:, :, :r], 1).transpose(0, 2, 1)
    return whole


def _resisting(
    conductor: Conductor,
    fields: np.ndarray,
    basis: np.ndarray,
    patterns: Sequence[Pattern],
    states: np.ndarray,
    tolerance: float,
) -> tuple[Interpolation, joule_tensors.JouleHeat]:
    law, on = conductor.following, conductor.on
    assert law is not None

    def beyond(rise: np.ndarray, rows: slice | np.ndarray = slice(None)) -> np.ndarray:
        return np.array(
            conductor.stands_for[rows] * law.value(rise) - conductor.cold[rows] - conductor.warm[rows] * rise
        )

    excess = np.stack([beyond(on.value(state)) for state in states])
    scale = np.broadcast_to(conductor.cold, excess.shape[1:])
    chosen, points = choose((excess / scale).reshape(len(states), -1), tolerance)
    places = [tuple(int(i) for i in np.unravel_index(p, scale.shape)) for p in points]
    rows = [on.value_at(fields, cell, at) for cell, at in places]
    cells = np.array([cell for cell, _ in places], int)
    some, copies, cold, warm = (
        law.of(cells),
        *(x[cells] for x in (conductor.stands_for, conductor.cold, conductor.warm)),
    )

    def at_points(rises: np.ndarray) -> np.ndarray:
        values: np.ndarray = copies * some.value(rises) - cold - warm * rises
        return values

    flat = excess.reshape(len(states), -1)
    inverse = np.linalg.inv(flat[np.ix_(chosen, points)]) if chosen else np.empty((0, 0))
    averaged = [conductor.resistivity_of(u) - conductor.cold - conductor.warm * on.value(u) for u in states[chosen]]
    heats = joule_tensors.of_pairs(conductor, basis, patterns, np.array(averaged).reshape(-1, *on.weights.shape))
    return Interpolation(np.array(rows).reshape(len(points), len(fields)), at_points, inverse), heats


def choose(excess: np.ndarray, tolerance: float) -> tuple[list[int], list[int]]:
    """Which rows (states) and columns (points) of a table interpolate it to a tolerance, at most `MOST` of each: in
    turn where most is left, as in Gaussian elimination with full pivoting. Of very many points some are looked at, by
    chance: what the others miss is seen in the residual of the full equations."""
    columns = np.arange(excess.shape[1])
    if len(columns) > LOOKED_AT:
        columns = np.random.default_rng(0).choice(columns, LOOKED_AT, replace=False)
    remaining, states, points = excess[:, columns], list[int](), list[int]()
    while remaining.size and len(states) < min(MOST, len(excess)):
        state, point = (int(i) for i in np.unravel_index(np.abs(remaining).argmax(), remaining.shape))
        if not abs(remaining[state, point]) > tolerance:
            break
        states.append(state)
        points.append(point)
        remaining -= np.outer(remaining[:, point] / remaining[state, point], remaining[state])
    return states, columns[points].tolist()
