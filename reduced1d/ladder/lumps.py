"""The paper's model on any anchors: each span of a row a sink of its own, all in one circuit; one span is eq 20.

A span has an anchor at a pad, and at an island half of the island's block alone, t_o/(k_o A_o) with half the area (and
contacts at its faces); eqs 13 to 19 hold for unequal ends (`reduced1d.equations.unequal_ends`). So there are two
kinds of span in a row, the two outer spans and the inner spans, each one lump after eq 20 at the current that the
voltage drives through the spans in series; the beam above an island is left out, as the pads are: no capacity, no air
on them, no part of the circuit.
"""

from __future__ import annotations

import numpy as np

from reduced1d.equations import resistance, room_resistivity, unequal_ends, unequal_peak
from reduced1d.ladder.few_states import FewStates
from reduced1d.sink import air_conductance, gap_conductance
from scenes.sink import Sink, different


def half_island(sink: Sink) -> float:
    """The resistance (K/W) of half of an island's block with its contacts, between a span's end and the substrate."""
    area = sink.island_width * sink.island / 2
    return (sink.oxide_thickness / sink.oxide.thermal_conductivity + sink.contacts) / area


def lumps(sink: Sink, anchor_resistance: float, circuit: bool = False) -> FewStates:
    """The spans as lumps between an anchor of some resistance (K/W) and the islands' blocks, each state an equivalent
    rise; ``circuit`` adds the cold resistance of the beam over the islands.

    Raises ValueError where the silicon does not conduct.
    """
    k, A_c, L = sink.silicon.thermal_conductivity, sink.cross_section, sink.length
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    island = half_island(sink)
    # The outer and the inner resistance of each kind of span, and how many there are of it.
    kinds = [
        ((anchor_resistance, anchor_resistance if sink.spans == 1 else island), min(sink.spans, 2)),
        ((island, island), sink.spans - 2),
    ][: 1 + (sink.spans > 2)]
    # Of each kind: dT0, the rises of the outer and the inner end, per equivalent rise.
    shapes = [unequal_ends(1.0, *ends, k, A_c, L) for ends, _ in kinds]
    number = np.array([float(count) for _, count in kinds])
    flows = np.array([rises[1] / ends[0] + rises[2] / ends[1] for rises, (ends, _) in zip(shapes, kinds, strict=True)])
    over = resistance(0.0, resistivity, a, (sink.spans - 1) * sink.island, A_c)
    states, cold = np.eye(len(kinds)), number * resistance(0.0, resistivity, a, L, A_c)
    air, gas = number * air_conductance(sink), number * gap_conductance(sink)
    outputs = {"peak": states[0] * unequal_peak(*shapes[0])} if sink.spans == 1 else {}
    outputs |= {"end": states[0] * shapes[0][1], "mean": number / sink.spans, "air": air}
    if sink.spans == 1:
        outputs |= {"air_beam": air, "gas_beam": gas}
    else:
        outputs["anchor_heat"] = outputs["end"] / anchor_resistance
        for span in range(1, different(sink.spans) + 1):
            kind = min(span, 2) - 1
            dT0, outer, inner = shapes[kind]
            outputs[f"span{span}_peak"] = states[kind] * unequal_peak(dT0, outer, inner)
            outputs[f"span{span}_middle"] = states[kind] * (dT0 + (outer + inner) / 2)
            outputs[f"span{span}_mean"] = states[kind]
        for isle in range(1, sink.spans // 2 + 1):
            # From the span before the island, and from the span after, whose outer end it is.
            before, after = min(isle, 2) - 1, min(isle + 1, sink.spans - isle, 2) - 1
            rises = states[before] * shapes[before][2] + states[after] * shapes[after][1 if after else 2]
            outputs[f"island{isle}_heat"] = rises / island
    return FewStates(
        np.diag(number * sink.silicon.heat_capacity * L * A_c), np.diag(number * flows + air + gas), cold,
        np.diag(cold), float(cold.sum()) + circuit * over, cold, float(cold.sum()), outputs,
        a, sink.drive,
    ).in_modes()  # fmt: skip
