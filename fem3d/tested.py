"""The Joule heat of pairs of current fields on bricks, tested with temperature fields, box by box."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fem3d import tensor
from fem3d.conduction import Pattern
from fem3d.joule import Split, Tested

if TYPE_CHECKING:
    from fem3d.conductor import Conductor


def tested(conductor: Conductor, basis: np.ndarray, patterns: Sequence[Pattern]) -> Tested:
    """The sums of `Tested` for temperature fields (free nodes, r) and some current fields."""
    heat, lifts = conductor.heat, conductor.heat.lifts
    densities = [p.density for p in patterns]
    m, r, channels = len(densities), basis.shape[1], heat.inputs.count
    lifted = [c for c in range(channels) if lifts[c].any()]
    found = Tested.nothing(channels, m, r)
    for number, (block, parts) in enumerate(zip(conductor.blocks, conductor.parts, strict=True)):
        at_room, per_kelvin = conductor.law(block)
        fields_here = np.stack([tensor.values(parts, heat.on_block(block, u)).ravel() for u in basis.T], axis=1)
        lifts_here = {c: tensor.values(parts, heat.on_block(block, lifts[c])).ravel() for c in lifted}
        weight = tensor.weights(parts).ravel()
        falls = {
            name: v
            for name, u in heat.held_fields.items()
            if (v := tensor.values(parts, heat.on_block(block, u)).ravel()).any()
        }
        for name in falls:
            found.at_held.setdefault(name, (np.zeros((channels, m, m)), np.zeros((m, m, r))))
        cold_here, warm_here = np.zeros((channels, m, m)), np.zeros((m, m, r))
        for i in range(m):
            for j in range(i + 1):
                heating = weight * (densities[i][number] * densities[j][number]).sum(axis=0).ravel()
                first = heating @ fields_here
                cold_here[0, i, j] = at_room * heating.sum()
                warm_here[i, j] = warm_here[j, i] = per_kelvin * first
                found.cold_load[0, i, j] += at_room * first
                if per_kelvin:
                    found.warm_load[i, j] += per_kelvin * (fields_here.T * heating) @ fields_here
                    for c, lift in lifts_here.items():
                        cold_here[c, i, j] += per_kelvin * float(heating @ lift)
                        found.cold_load[c, i, j] += per_kelvin * (heating * lift) @ fields_here
                for name, v in falls.items():
                    resistivity = at_room, per_kelvin
                    _add_falling(found.at_held[name], (i, j), heating * v, resistivity, fields_here, lifts_here)
                if i != j:
                    cold_here[:, j, i] = cold_here[:, i, j]
                    found.cold_load[:, j, i], found.warm_load[j, i] = found.cold_load[:, i, j], found.warm_load[i, j]
        for name, (shares, field) in conductor.influences.items():
            nothing = shares, np.zeros((channels, m)), np.zeros((m, r))
            _, drop, warm_drop = found.potentials.setdefault(name, nothing)
            for i in range(m):
                taken = weight * (densities[i][number] * field[number]).sum(axis=0).ravel()
                drop[0, i] += at_room * taken.sum()
                warm_drop[i] += per_kelvin * taken @ fields_here
                for c, lift in lifts_here.items():
                    drop[c, i] += per_kelvin * float(taken @ lift)
        found.cold[...] += cold_here
        found.warm[...] += warm_here
        name = heat.mesh.boxes[block.box].name
        old = found.in_box.get(name, (np.zeros_like(cold_here), np.zeros((m, m, r))))
        found.in_box[name] = (old[0] + cold_here, old[1] + warm_here)
    return found


def _add_falling(
    into: Split,
    pair: tuple[int, int],
    heating: np.ndarray,
    resistivity: tuple[float, float],
    fields: np.ndarray,
    lifts: dict[int, np.ndarray],
) -> None:
    """Add the Joule heat of a pair of current fields that falls to held nodes, symmetric in the pair."""
    cold, warm = into
    (at_room, per_kelvin), (i, j) = resistivity, pair
    first = per_kelvin * heating @ fields
    for p, q in {(i, j), (j, i)}:
        cold[0, p, q] += at_room * heating.sum()
        warm[p, q] += first
        for c, lift in lifts.items():
            cold[c, p, q] += per_kelvin * float(heating @ lift)
