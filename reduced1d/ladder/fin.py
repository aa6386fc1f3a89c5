"""The beam as a fin from pad to pad, over the islands of a row of spans too.

It is the heat equation along the beam, with the heat that the current makes at each place,

    (rho c A + c_i) dT/dt = k A T'' - (h_air w + h_gas w + g_i) T + I^2 rho_e(T) / A,

where over an island g_i is the conductance of its block in series with contacts and the silicon's thickness, times its
width, and c_i a third of the block's capacity, as for the plate (`reduced1d.ladder.plate`); elsewhere both are zero.
At its ends are anchors of a resistance R and a capacity C, k A T' = T / R + C dT/dt, where electrodes at the pads'
outer faces also make heat. Half of the row is cut into polynomials; theirs is Galerkin's method, as is the anchor's
one shape, so that the fin of one span is the plate projected on rises that are uniform across the beam. A row's fin
also leaves out that heat converges to an island narrower than the beam.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from reduced1d.elements import Elements
from reduced1d.equations import room_resistivity
from reduced1d.ladder.anchor import Anchor
from reduced1d.ladder.few_states import FewStates
from reduced1d.ladder.plate import film, gap_film, stored
from scenes.sink import Sink, different, start

_HALF_SPAN = np.array([0.0, 0.02, 0.08, 0.3, 1.0])
"""Element boundaries of half a span: fine near its end, from which heat has spread a little at 10 us."""


def fin(
    sink: Sink, anchor: Anchor, *, pad_capacity: bool = True, oxide_capacity: bool = True, finer: int = 0
) -> FewStates:  # fmt: skip
    """Assemble the fin on an anchor, with the chosen capacities (of the islands with the oxide's), by polynomials of
    degree 7 + ``finer``.

    Raises ValueError where the silicon does not conduct.
    """
    lengths, numbers, islands = _elements(sink)
    nodes = np.concatenate([[0.0], np.cumsum(lengths)])
    e = Elements([nodes], 7 + finer)
    k, A_c = sink.silicon.thermal_conductivity, sink.cross_section
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    per_length, air = resistivity / A_c, sink.convection_coefficient * sink.width
    gas = gap_film(sink) * sink.width
    block = oxide_capacity * sink.oxide.heat_capacity * sink.oxide_thickness * stored(sink) * sink.island_width
    down = film(sink) * sink.island_width
    both = np.full(len(lengths), 2.0)  # the row has two halves
    end = np.eye(1, e.size)[0]
    node = sp.csr_matrix(([1.0], ([0], [0])), shape=(e.size, e.size))
    capacity = pad_capacity * anchor.pad + oxide_capacity * anchor.oxide
    integral = e.integral(both)

    def mean(number: int, island: bool = False) -> np.ndarray:
        """(n,): the mean over a span or an island, or over the half of it that is in this half of the row."""
        part = (numbers == number) & (islands == island)
        return e.integral(part.astype(float)) / lengths[part].sum()

    def along(number: int, places: np.ndarray) -> np.ndarray:
        """(places, n): values at some places of a span (from 0 to 1); the other half of the row mirrors this one."""
        y = start(sink, number) + places * sink.length
        return np.asarray(e.at([0] * len(y), np.minimum(y, sink.row_length - y))[0].toarray())

    outputs = {
        "end": end, "mean": e.integral(both * ~islands) / sink.spans / sink.length,
        "air": air * integral + 2 * anchor.air * end,
    }  # fmt: skip
    if sink.spans == 1:
        outputs |= {"peak": along(1, np.array([0.5]))[0], "air_beam": air * integral, "gas_beam": gas * integral}
    else:
        outputs["anchor_heat"] = end / anchor.resistance
        for number in range(1, different(sink.spans) + 1):
            outputs[f"span{number}_middle"] = along(number, np.array([0.5]))[0]
            outputs[f"span{number}_mean"] = mean(number)
            outputs[f"span{number}_peak"] = along(number, np.linspace(0.0, 1.0, 41))
        for number in range(1, sink.spans // 2 + 1):
            # A block keeps a third of its capacity: the heat into the substrate over time is the film's alone.
            outputs[f"island{number}_heat"] = down * sink.island * mean(number, island=True)
    losses = both * (air + gas + down * islands)
    return FewStates(
        (e.mass(both * (sink.silicon.heat_capacity * A_c + block * islands)) + 2 * capacity * node).tocsc(),
        (e.mass(losses) + e.stiffness(both * k * A_c) + 2 / anchor.resistance * node).tocsc(),
        per_length * integral + anchor.source * end,
        (e.mass(both * per_length) + anchor.feedback * node).tocsc(),
        per_length * sink.row_length + anchor.circuit, per_length * integral, per_length * sink.row_length, outputs,
        a, sink.drive,
    )  # fmt: skip


def _elements(sink: Sink) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(elements,) thrice, of half a row from the pad inwards: lengths (m), numbers of spans and islands, and whether
    an element is over an island."""
    half = np.diff(_HALF_SPAN) * sink.length / 2
    pieces: list[tuple[np.ndarray, int, bool]] = []
    for number in range(1, different(sink.spans) + 1):
        pieces.append((half, number, False))
        if 2 * number - 1 == sink.spans:
            break  # the middle of the row
        pieces.append((half[::-1], number, False))
        pieces.append((np.array([sink.island / (2 if 2 * number == sink.spans else 1)]), number, True))
    lengths, numbers, islands = zip(*pieces, strict=True)
    counts = [len(each) for each in lengths]
    return np.concatenate(lengths), np.repeat(numbers, counts), np.repeat(islands, counts)
