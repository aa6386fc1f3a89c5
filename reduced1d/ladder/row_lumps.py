"""A row of spans after the paper: each span a sink of its own, all in one circuit.

A span has eq 14's anchor at a pad, and at an island half of the island's block alone, t_o/(k_o A_o) with half the
area; eqs 13 to 19 are those of unequal ends (`reduced1d.equations.unequal_ends`). So there are two kinds of span, the
two outer ones and those between, each one lump after eq 20 at the current that the voltage drives through the spans in
series; what the beam is above an island is left out, as the pads are.
"""

from __future__ import annotations

import numpy as np

from reduced1d.equations import resistance, room_resistivity, unequal_ends, unequal_peak
from reduced1d.ladder.few_states import FewStates, Matrices, in_modes
from reduced1d.sink import air_conductance
from scenes.sink import Sink, different


def half_island(sink: Sink) -> float:
    """The resistance (K/W) of half of an island's block, between a span's end and the substrate."""
    area = sink.island_width * sink.island / 2
    return sink.oxide_thickness / (sink.oxide.thermal_conductivity * area)


def lumps(sink: Sink, anchor_resistance: float, circuit: bool = False) -> FewStates:
    """The spans of a row as lumps between an anchor of some resistance (K/W) and the islands' blocks; ``circuit`` adds
    the cold resistance of the beam over the islands.

    Raises ValueError where the silicon does not conduct.
    """
    k, A_c, L = sink.silicon.thermal_conductivity, sink.cross_section, sink.length
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    island, count = half_island(sink), 1 if sink.spans == 2 else 2
    number = np.array([2.0, sink.spans - 2.0])[:count]
    # Of each kind: dT0, the rise of the outer end and that of the inner one, per equivalent rise.
    shapes = [unequal_ends(1.0, R, island, k, A_c, L) for R in (anchor_resistance, island)]
    ends = zip(shapes, (anchor_resistance, island), strict=True)
    flows = np.array([outer / R + inner / island for (_, outer, inner), R in ends])
    over = resistance(0.0, resistivity, a, (sink.spans - 1) * sink.island, A_c)
    kinds, cold = np.eye(count), number * resistance(0.0, resistivity, a, L, A_c)
    air = number * air_conductance(sink)
    outputs = {"end": kinds[0] * shapes[0][1], "mean": number / sink.spans, "air": air}
    for span in range(1, different(sink.spans) + 1):
        own = min(span, 2) - 1
        dT0, outer, inner = shapes[own]
        outputs |= {
            f"span{span}_peak": kinds[own] * float(unequal_peak(dT0, outer, inner)),
            f"span{span}_middle": kinds[own] * (dT0 + (outer + inner) / 2),
            f"span{span}_mean": kinds[own],
        }
    outputs["anchor_heat"] = outputs["end"] / anchor_resistance
    for number_of in range(1, sink.spans // 2 + 1):
        # What the span before it brings, and the one after it, which has it for an outer end.
        before, after = min(number_of, 2) - 1, min(number_of + 1, sink.spans - number_of, 2) - 1
        second = shapes[after][2] if after == 0 else shapes[after][1]
        outputs[f"island{number_of}_heat"] = (kinds[before] * shapes[before][2] + kinds[after] * second) / island
    matrices = Matrices(
        np.diag(number * sink.silicon.heat_capacity * L * A_c), np.diag(number * flows[:count] + air), cold,
        np.diag(cold), float(cold.sum()) + circuit * over, cold, float(cold.sum()), outputs,
    )  # fmt: skip
    return in_modes(matrices, a, sink.spans * sink.voltage)
