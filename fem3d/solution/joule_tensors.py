"""The Joule heat of pairs of current fields, body by body, tested with temperature fields: what the reduced problem is
made of."""

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
    """For m current fields and r temperature fields: ``cold`` (channels, m, m) and ``warm`` (m, m, r), the heat of each
    pair at the initial temperature and what each field adds to it; ``cold_load`` (channels, m, m, r) and ``warm_load``
    (m, m, r, r), the same tested with each field.

    ``in_box``: cold and warm of each conducting box alone; ``at_held``: those that fall to the nodes of a boundary of
    given temperature. ``potentials`` of probes: their shares (channels,) of the voltages, and what each current field
    takes off, cold (channels, m) and warm (m, r).
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
    """The sums of `JouleHeat` for temperature fields (free nodes, r) and some current fields."""
    heat, on = conductor.heat, conductor.on
    densities, m, r, channels = [p.density for p in patterns], len(patterns), basis.shape[1], heat.inputs.count
    found = nothing(channels, m, r, heat.held)
    # (r, cells, points), and by name or channel (cells, points): all that heat is tested with, where current flows.
    fields = np.array([on.value(u) for u in heat.field(basis.T)]).reshape(r, *on.weights.shape)
    lifts = {c: on.value(heat.field(lift)) for c, lift in enumerate(heat.lifts) if lift.any()}
    falls = {name: v for name, u in heat.held_fields.items() if (v := on.value(heat.field(u))).any()}
    names = np.array(heat.domain.names)[heat.domain.body[conductor.cells]]
    for name in dict.fromkeys(names.tolist()):
        own = slice(None) if (names == name).all() else names == name
        body = _Body(
            fields[:, own].reshape(r, on.weights[own].size),
            {c: lift[own].ravel() for c, lift in lifts.items()}, channels,
            (on.weights * conductor.cold / conductor.stands_for)[own].ravel(),
            (on.weights * conductor.warm / conductor.stands_for)[own].ravel(),
        )  # fmt: skip
        box_cold, box_warm = found.in_box.setdefault(name, (np.zeros((channels, m, m)), np.zeros((m, m, r))))
        held = {at: v[own].ravel() for at, v in falls.items()}
        copies = float(conductor.stands_for[own].flat[0])
        for i in range(m):
            for j in range(i + 1):
                both = (densities[i] * densities[j]).sum(axis=0)[own].ravel()
                if not both.any():
                    continue  # of currents in different bodies
                cold, warm = body.split(both)
                cold_load, warm_load = body.load(both)
                parts = {at: body.split(both * v) for at, v in held.items()}
                for p, q in {(i, j), (j, i)}:
                    for into, by in ((found.cold, copies * cold), (box_cold, cold), (found.cold_load, cold_load)):
                        into[:, p, q] += by
                    for into, by in ((found.warm, copies * warm), (box_warm, warm), (found.warm_load, warm_load)):
                        into[p, q] += by
                    for at, (falling, per_kelvin) in parts.items():
                        found.at_held[at][0][:, p, q] += falling
                        found.at_held[at][1][p, q] += per_kelvin
        for probe, (shares, density) in conductor.influences.items():
            none = shares, np.zeros((channels, m)), np.zeros((m, r))
            _, drop, warm_drop = found.potentials.setdefault(probe, none)
            for i in range(m):
                cold, warm = body.split((densities[i] * density).sum(axis=0)[own].ravel())
                drop[:, i] += copies * cold
                warm_drop[i] += copies * warm
    return found


class _Body(NamedTuple):
    """The cells of one conducting body, their points in a row: temperature fields (r, points), lifts (points,) by
    channel, and the weights of the quadrature times the resistivity and its change per kelvin."""

    fields: np.ndarray
    lifts: dict[int, np.ndarray]
    channels: int
    cold: np.ndarray
    warm: np.ndarray

    def split(self, both: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(channels,) and (r,): the heat of a product of current densities (points,) per channel and per field."""
        start = np.zeros(self.channels)
        start[0] = both @ self.cold
        warming = both * self.warm
        for c, lift in self.lifts.items():
            start[c] += warming @ lift
        return start, self.fields @ warming

    def load(self, both: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(channels, r) and (r, r): the same, tested with each field."""
        start = np.zeros((self.channels, len(self.fields)))
        start[0] = self.fields @ (both * self.cold)
        if not self.warm.any():
            return start, np.zeros((len(self.fields),) * 2)
        weighted = self.fields * (both * self.warm)
        for c, lift in self.lifts.items():
            start[c] += weighted @ lift
        return start, weighted @ self.fields.T
