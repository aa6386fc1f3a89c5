"""The Joule heat of pairs of current fields, body by body, tested with temperature fields: the tensors of the
reduced problem."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fem3d.problems.current import Conductor, Pattern

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
