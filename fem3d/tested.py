"""The Joule heat of pairs of current fields, tested with temperature fields."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fem3d.conduction import Pattern
from fem3d.joule import Split, Tested

if TYPE_CHECKING:
    from fem3d.conductor import Conductor


def tested(conductor: Conductor, basis: np.ndarray, patterns: Sequence[Pattern]) -> Tested:
    """The sums of `Tested` for temperature fields (free nodes, r) and some current fields."""
    heat, on = conductor.heat, conductor.on
    densities, m, r = [p.density[0] for p in patterns], len(patterns), basis.shape[1]
    found = Tested.nothing(heat.inputs.count, m, r, heat.held)
    # (r or channels, cells, points): the temperature fields and the lifts where the current flows.
    fields = np.array([on.value(u) for u in heat.field(basis.T)]).reshape(r, *on.weights.shape)
    lifts = {c: on.value(heat.field(lift)) for c, lift in enumerate(heat.lifts) if lift.any()}
    falls = {name: v for name, u in heat.held_fields.items() if (v := on.value(heat.field(u))).any()}
    warm = conductor.warm * on.weights if conductor.warms else None
    for i in range(m):
        for j in range(i + 1):
            both = (densities[i] * densities[j]).sum(axis=0)
            start = _Source(both * conductor.cold * on.weights, None if warm is None else both * warm)
            per_box = {name: start.split(conductor, fields, lifts, name) for name in _names(conductor)}
            for p, q in {(i, j), (j, i)}:
                for name, (cold, per_kelvin) in per_box.items():
                    into = found.in_box.setdefault(name, _empty(heat.inputs.count, m, r))
                    into[0][:, p, q], into[1][p, q] = cold, per_kelvin
                found.cold[:, p, q] = sum(cold for cold, _ in per_box.values())
                found.warm[p, q] = sum(per_kelvin for _, per_kelvin in per_box.values())
                found.cold_load[0, p, q] = np.tensordot(fields, start.cold, 2)
                if start.warm is not None:
                    weighted = fields * start.warm
                    found.warm_load[p, q] = np.tensordot(weighted, fields, ((1, 2), (1, 2)))
                    for c, lift in lifts.items():
                        found.cold_load[c, p, q] += np.tensordot(weighted, lift, 2)
                for name, v in falls.items():
                    falling = _Source(start.cold * v, None if start.warm is None else start.warm * v)
                    cold, per_kelvin = falling.split(conductor, fields, lifts)
                    found.at_held[name][0][:, p, q], found.at_held[name][1][p, q] = cold, per_kelvin
    for name, (shares, field) in conductor.influences.items():
        drops = []
        for density in densities:
            both = (density * field[0]).sum(axis=0) * on.weights
            taken = _Source(both * conductor.cold, both * conductor.warm if conductor.warms else None)
            drops.append(taken.split(conductor, fields, lifts))
        drop = np.array([cold for cold, _ in drops]).T.reshape(heat.inputs.count, m)
        found.potentials[name] = shares, drop, np.array([per_kelvin for _, per_kelvin in drops]).reshape(m, r)
    return found


def _empty(channels: int, m: int, r: int) -> Split:
    return np.zeros((channels, m, m)), np.zeros((m, m, r))


def _names(conductor: Conductor) -> list[str]:
    domain = conductor.heat.domain
    return list(dict.fromkeys(domain.names[n] for n in np.unique(domain.body[conductor.cells])))


class _Source:
    """Heat (cells, points) in W at the initial temperature, and per kelvin where the resistivity warms."""

    def __init__(self, cold: np.ndarray, warm: np.ndarray | None) -> None:
        self.cold, self.warm = cold, warm

    def split(
        self, conductor: Conductor, fields: np.ndarray, lifts: dict[int, np.ndarray], name: str | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """(channels,) and (r,): its sum, over a body's cells or all, per channel and per temperature field."""
        domain = conductor.heat.domain
        names = np.array(domain.names)[domain.body[conductor.cells]]
        own = slice(None) if name is None or (names == name).all() else names == name
        cold = np.zeros(conductor.heat.inputs.count)
        cold[0] = self.cold[own].sum()
        if self.warm is None:
            return cold, np.zeros(len(fields))
        for c, lift in lifts.items():
            cold[c] += float((self.warm[own] * lift[own]).sum())
        return cold, np.tensordot(fields[:, own], self.warm[own], 2)
