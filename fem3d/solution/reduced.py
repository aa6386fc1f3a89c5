"""The coupled problem projected on a few temperature fields and a few current fields.

Temperature: rise = sum_k a_k T_k + sum_c g_c L_c, the L_c being the rises that the given temperatures keep up. Current
density: J = sum_i c_i J_i, each J_i the exact (discrete) current field of some temperature. With the resistivity linear
in T everything is polynomial in (a, c) and linear in the inputs g:

    current:  sum_j A_ij(a, g) c_j = s_i(g),    A_ij = integral rho J_i . J_j,   s_i the power that the electrodes would
                                                supply to J_i at their voltages
    heat:     M da/dt + K a = f(g) - M_L dg/dt + sum_ij c_i c_j integral rho J_i . J_j T_l

The first line is the principle of least dissipation (Thomson's) among the J_i; it is exact at every temperature whose
current field is among them, and second-order accurate between them.

`JouleHeat` holds the integrals of rho J_i . J_j tested with the temperature fields, body by body.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np

from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import Pattern

Split = tuple[np.ndarray, np.ndarray]
"""Cold (channels, m, m) and warm (m, m, r): a sum over boxes or nodes of the Joule heat of pairs of current fields."""


@dataclass(frozen=True, eq=False)
class JouleHeat:
    """For m current fields and r temperature fields: ``cold`` (channels, m, m) and ``warm`` (m, m, r), the heat of
    each pair at the initial temperature, with resistances before electrodes, and its change by each field;
    ``cold_load`` (channels, m, m, r) and ``warm_load`` (m, m, r, r), the same of solids, tested with each field.

    ``in_box``: cold and warm of each conducting box alone; ``at_held``: the parts at the nodes of a boundary of
    given temperature. ``potentials`` of probes: their shares (channels,) of the voltages, and the drop by each current
    field, cold (channels, m) and warm (m, r).
    """

    cold: np.ndarray
    warm: np.ndarray
    cold_load: np.ndarray
    warm_load: np.ndarray
    in_box: dict[str, Split]
    at_held: dict[str, Split]
    potentials: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]


def nothing(channels: int, m: int, r: int, held: Iterable[str] = ()) -> JouleHeat:
    """Zeros, to add to."""
    zeros = np.zeros
    at_held = {name: (zeros((channels, m, m)), zeros((m, m, r))) for name in held}
    loads = zeros((channels, m, m, r)), zeros((m, m, r, r))
    return JouleHeat(zeros((channels, m, m)), zeros((m, m, r)), *loads, {}, at_held, {})


def of_pairs(conductor: Conductor, basis: np.ndarray, patterns: Sequence[Pattern]) -> JouleHeat:
    """The sums of `JouleHeat` for temperature fields (free nodes, r) and some current fields.

    With J_i the current densities, v_k the temperature fields, l_c the lift of channel c and rho = cold + warm times
    the rise, the heat of the pair i, j at the point x of a body is J_i . J_j (cold + warm (sum_c g_c l_c + a . v)).
    """
    heat, on = conductor.heat, conductor.on
    densities, m, r = np.array([p.density for p in patterns]), len(patterns), basis.shape[1]
    weights = on.weights
    warm_weights = weights * conductor.warm
    channels = np.zeros((heat.inputs.count, *on.weights.shape))
    channels[0] = weights * conductor.cold
    for c, lift in enumerate(heat.lifts):
        if lift.any():
            channels[c] += warm_weights * on.value(heat.field(lift))
    heats = nothing(len(channels), m, r, heat.held)
    fields = np.array([on.value(u) for u in heat.field(basis.T)]).reshape(r, *on.weights.shape)
    held = {name: v for name, u in heat.held_fields.items() if (v := on.value(heat.field(u))).any()}
    names = conductor.names
    for name in dict.fromkeys(names.tolist()):
        cells = slice(None) if (names == name).all() else names == name
        points = on.weights[cells].size
        body = _Body(*(x[..., cells, :].reshape(*x.shape[:-2], points) for x in (fields, channels, warm_weights)))
        currents = densities[:, :, cells].reshape(m, densities.shape[1], points)
        products = np.einsum("idx,jdx->ijx", currents, currents)
        cold, warm = heats.in_box[name] = body.heat(products)
        for total, part in zip((heats.cold, heats.warm), (cold, warm), strict=True):
            total += part
        for total, part in zip((heats.cold_load, heats.warm_load), body.load(products), strict=True):
            total += part
        for boundary, v in held.items():
            for total, part in zip(heats.at_held[boundary], body.heat(products * v[cells].ravel()), strict=True):
                total += part
        for probe, (shares, density, _) in conductor.influences.items():
            cold, warm = body.heat(np.einsum("idx,dx->ix", currents, density[:, cells].reshape(len(density), -1)))
            none = shares, np.zeros((len(channels), m)), np.zeros((m, r))
            _, drop, warm_drop = heats.potentials.setdefault(probe, none)
            drop += cold
            warm_drop += warm
    for t in conductor.terminals:
        if t.conductance:
            through = np.array([p.currents[t.name] for p in patterns])
            heats.cold[0] += t.resistance * np.outer(through, through)
            for probe, (_, _, of_terminals) in conductor.influences.items():
                heats.potentials[probe][1][0] += of_terminals[t.name] * through
    return heats


class _Body(NamedTuple):
    """The cells of one conducting body, their points in a row: temperature fields (r, points), and the weights of the
    quadrature times the resistivity of each channel (channels, points) and times its change per kelvin (points,)."""

    fields: np.ndarray
    cold: np.ndarray
    warm: np.ndarray

    def heat(self, products: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(channels, ...) and (..., r): the heat of products of current densities (..., points), per channel and per
        temperature field."""
        return np.moveaxis(products @ self.cold.T, -1, 0), (products * self.warm) @ self.fields.T

    def load(self, products: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(channels, m, m, r) and (m, m, r, r): the same of products (m, m, points), tested with each field."""
        m, r = len(products), len(self.fields)
        cold, warm = np.zeros((len(self.cold), m, m, r)), np.zeros((m, m, r, r))
        for i, j in zip(*np.tril_indices(m), strict=True):
            if not products[i, j].any():
                continue  # the currents of different bodies
            weighted = self.fields * products[i, j]
            cold[:, i, j] = cold[:, j, i] = self.cold @ weighted.T
            if self.warm.any():
                warm[i, j] = warm[j, i] = (weighted * self.warm) @ self.fields.T
        return cold, warm


DEPENDENT = 1e-6  # a field is dropped where the part of it that is independent of earlier ones is smaller than this


@dataclass(frozen=True, eq=False)
class Reduced(JouleHeat):
    """Reduced matrices, and the Joule heat of the current fields, which form A; ``basis`` (free nodes, r) is
    orthonormal in the mass matrix, so M is the identity.

    The inputs' channels come first: ``source`` (channels, r), ``supply`` (channels, m). ``inertia`` (channels, r): M of
    the lifts, tested with each field. Where currents are given, the coefficients c satisfy ``drawn`` (k, m) @ c =
    inputs @ ``given`` (channels, k), with the least dissipation.
    """

    basis: np.ndarray
    stiffness: np.ndarray
    source: np.ndarray
    inertia: np.ndarray
    supply: np.ndarray
    drawn: np.ndarray
    given: np.ndarray

    @property
    def states(self) -> int:
        """How many temperature fields."""
        return self.basis.shape[1]

    def changed(self, to: np.ndarray) -> Reduced:
        """The same problem, or a part, in other temperature fields, orthonormal sums of these: ``to`` (r, new)."""
        return replace(
            self, basis=self.basis @ to, stiffness=to.T @ self.stiffness @ to, source=self.source @ to,
            inertia=self.inertia @ to, warm=self.warm @ to, cold_load=self.cold_load @ to,
            warm_load=np.einsum("ijlk,la,kb->ijab", self.warm_load, to, to, optimize=True),
            in_box={name: (cold, warm @ to) for name, (cold, warm) in self.in_box.items()},
            at_held={name: (cold, warm @ to) for name, (cold, warm) in self.at_held.items()},
            potentials={name: (shares, cold, warm @ to) for name, (shares, cold, warm) in self.potentials.items()},
        )  # fmt: skip

    def dissipation(self, a: np.ndarray, g: np.ndarray | None = None) -> np.ndarray:
        """(..., m, m): the matrix A of the resistances at states a (..., r) and inputs g (..., channels)."""
        m = self.supply.shape[1]
        return _at(self.cold, g) + (a @ self.warm.reshape(m * m, -1).T).reshape(*a.shape[:-1], m, m)

    def currents(self, a: np.ndarray, g: np.ndarray | None = None) -> np.ndarray:
        """(..., m): the coefficients c of the current fields at states a (..., r) and inputs g; NaN where the
        resistances are not positive, as no current answers a voltage there."""
        matrix, supply = self.dissipation(a, g), _at(self.supply, g)
        if matrix.shape[-1] == 1 and not len(self.drawn):
            return supply / np.where(matrix > 0, matrix, np.nan)[..., 0]
        try:
            np.linalg.cholesky(matrix)
        except np.linalg.LinAlgError:
            return np.full(matrix.shape[:-1], np.nan)
        return self.carried(matrix, g)

    def carried(self, matrix: np.ndarray, g: np.ndarray | None = None) -> np.ndarray:
        """(..., m): the coefficients for a matrix A (..., m, m) of the resistances, whatever its sign: A c - drawn^T u
        = supply with drawn c = given, u being the unknown potentials of electrodes."""
        (k, m), supply, given = self.drawn.shape, _at(self.supply, g), _at(self.given, g)
        if not k:
            return np.linalg.solve(matrix, np.broadcast_to(supply, matrix.shape[:-1])[..., None])[..., 0]
        whole = np.zeros((*matrix.shape[:-2], m + k, m + k))
        whole[..., :m, :m], whole[..., :m, m:], whole[..., m:, :m] = matrix, self.drawn.T, self.drawn
        right = [np.broadcast_to(v, (*matrix.shape[:-2], v.shape[-1])) for v in (supply, given)]
        coefficients: np.ndarray = np.linalg.solve(whole, np.concatenate(right, axis=-1)[..., None])[..., :m, 0]
        return coefficients

    def joule(self, a: np.ndarray, c: np.ndarray, g: np.ndarray | None = None) -> np.ndarray:
        """(..., r): the Joule heat tested with each temperature field."""
        m2, r = self.supply.shape[1] ** 2, self.states
        pairs = (c[..., :, None] * c[..., None, :]).reshape(*c.shape[:-1], m2)
        warm = (a @ self.warm_load.reshape(m2 * r, r).T).reshape(*a.shape[:-1], m2, r)
        cold = _at(self.cold_load, g).reshape(*(() if g is None else g.shape[:-1]), m2, r)
        return (pairs[..., None, :] @ (cold + warm))[..., 0, :]


def _at(channels: np.ndarray, g: np.ndarray | None) -> np.ndarray:
    """(..., *rest): values per channel (channels, *rest) at inputs g (..., channels); without inputs the only
    channel."""
    if g is None:
        return channels[0]
    flat = channels.reshape(len(channels), -1)  # faster than tensordot, and a transient asks thousands of times
    return (g @ flat).reshape(*g.shape[:-1], *channels.shape[1:])


def project(
    heat: HeatProblem, conductor: Conductor | None, temperatures: np.ndarray, patterns: Sequence[Pattern] = ()
) -> Reduced:
    """The reduced problem on temperature fields (free nodes, r) and current fields."""
    basis = orthonormal(heat, temperatures)
    n, channels, lifts = heat.free, heat.inputs.count, heat.lifts
    source, inertia = heat.loads[:, :n] @ basis, np.zeros((channels, basis.shape[1]))
    for c, lift in enumerate(lifts):
        if lift.any():
            inertia[c] = (heat.mass @ lift)[:n] @ basis
            if not heat.anchored:
                source[c] -= (heat.stiffness @ lift)[:n] @ basis
    unheated = nothing(channels, 0, basis.shape[1])
    tested = unheated if conductor is None else of_pairs(conductor, basis, patterns)
    parts = {each.name: getattr(tested, each.name) for each in fields(JouleHeat)}
    stiffness = basis.T @ (heat.inner_stiffness @ basis)
    supply = np.array([p.supply for p in patterns]).reshape(-1, channels).T
    drawn, given = _given_currents(conductor, patterns, channels)
    return Reduced(
        **parts, basis=basis, stiffness=stiffness, source=source, inertia=inertia, supply=supply, drawn=drawn,
        given=given,
    )  # fmt: skip


def _given_currents(
    conductor: Conductor | None, patterns: Sequence[Pattern], channels: int
) -> tuple[np.ndarray, np.ndarray]:
    """`Reduced.drawn` and `Reduced.given`: sums of the given currents that the fields draw independently. The fields
    have all their channels' currents, so that dependent currents are given alike."""
    ends = [t for t in (conductor.terminals if conductor else ()) if not t.conductance]
    if conductor is None or not ends or not patterns:
        return np.empty((0, len(patterns))), np.empty((channels, 0))
    drawn = np.array([[p.currents[t.name] for p in patterns] for t in ends])
    given = np.array([conductor.voltages[:, t.at] for t in ends]).T
    u, sizes, v = np.linalg.svd(drawn, full_matrices=False)
    # A current far below the others, as in a wire that only senses, is their rounding error.
    kept = sizes > DEPENDENT * max(abs(current) for p in patterns for current in p.currents.values())
    return sizes[kept, None] * v[kept], given @ u[:, kept]


def orthonormal(heat: HeatProblem, fields: np.ndarray) -> np.ndarray:
    """Make fields (free nodes, r) orthonormal in the mass matrix, without dependent fields.

    Gram-Schmidt, twice for each field (Giraud et al., Numer. Math. 101, 2005), and a last pass by Cholesky, which is
    enough for fields that are nearly orthonormal.
    """
    weighted = heat.inner_mass @ fields
    products = fields.T @ weighted
    if np.linalg.eigvalsh(products).min(initial=1.0) < 0.5:
        fields = _independent(fields, weighted)
        products = fields.T @ (heat.inner_mass @ fields)
    return np.linalg.solve(np.linalg.cholesky(products), fields.T).T


def _independent(fields: np.ndarray, weighted: np.ndarray) -> np.ndarray:
    """The fields made orthonormal in their order, without dependent ones, given their products with the mass matrix."""
    kept, dual = (np.empty(fields.shape, order="F") for _ in range(2))
    r = 0
    for u, v in zip(fields.T, weighted.T, strict=True):
        size = float(u @ v)
        for _ in range(2):
            along = dual[:, :r].T @ u
            u, v = u - kept[:, :r] @ along, v - dual[:, :r] @ along
        remaining = float(u @ v)
        if remaining > DEPENDENT**2 * size:
            kept[:, r], dual[:, r] = u / np.sqrt(remaining), v / np.sqrt(remaining)
            r += 1
    return kept[:, :r]
