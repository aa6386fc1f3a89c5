"""The beam as a fin from pad to pad, over the islands of a row of spans too.

It is the heat equation along the beam, with the heat that the current makes at each place,

    (rho c A + c_i) dT/dt = k A T'' - (h_air w + h_gas w + g_i) T + I^2 rho_e(T) / A,

where over an island g_i is the conductance of its block in series with contacts and the silicon's thickness, times its
width, and c_i a third of the block's capacity, as for the plate (`reduced1d.ladder.plate`); elsewhere both are zero.
At its ends are anchors of a resistance R and a capacity C, k A T' = T / R + C dT/dt, where electrodes at the pads'
outer faces also make heat. Half of the row is cut into polynomials; theirs is Galerkin's method, as is the anchor's
one shape, so that the fin of one span is the plate projected on rises that are uniform across the beam. A row's fin
also leaves out that heat converges to an island narrower than the beam.

Spans further in than some few are all alike, each symmetric about its middle: the polynomials of one half of a span and
of one half of an island serve for all of these, which is Galerkin's method too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from reduced1d.equations import room_resistivity
from reduced1d.ladder.anchor import Anchor
from reduced1d.ladder.few_states import FewStates
from reduced1d.ladder.plate import film, gap_film, stored
from reduced1d.line import Line
from scenes.sink import Sink, decay, different

_SPAN = np.array([0.0, 0.02, 0.08, 0.3, 1.0])
"""Element boundaries of half a span: fine near its end, from which heat has spread a little at 10 us."""
_DEGREES = (5, 6, 7, 8)  # Polynomial degrees of these elements.
_ALIKE = 1e-6
"""Spans where the effect of the row's end has fallen below this part are taken as alike."""


def fin(
    sink: Sink, anchor: Anchor, *, pad_capacity: bool = True, oxide_capacity: bool = True, finer: int = 0
) -> FewStates:  # fmt: skip
    """The fin on an anchor, with the chosen capacities (of the islands with the oxide's); ``finer`` is added to the
    polynomials' degrees, and half as much to the number of spans that differ.

    Raises ValueError where the silicon does not conduct.
    """
    row = _halved(sink, finer)
    k, A_c = sink.silicon.thermal_conductivity, sink.cross_section
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    per_length, air = resistivity / A_c, sink.convection_coefficient * sink.width
    gas = gap_film(sink) * sink.width
    block = oxide_capacity * sink.oxide.heat_capacity * sink.oxide_thickness * stored(sink) * sink.island_width
    down = film(sink) * sink.island_width
    both, over = 2 * row.weights, row.islands  # the row has two halves
    integral = row.line.integral(both)
    end = np.eye(len(integral))[0]
    node = np.outer(end, end)
    capacity = pad_capacity * anchor.pad + oxide_capacity * anchor.oxide
    outputs = {
        "end": end, "mean": row.line.integral(both * ~over) / sink.spans / sink.length,
        "air": air * integral + 2 * anchor.air * end,
    }  # fmt: skip
    if sink.spans == 1:
        outputs |= {"peak": row.along(1, [0.5])[0], "air_beam": air * integral, "gas_beam": gas * integral}
    else:
        outputs["anchor_heat"] = end / anchor.resistance
        for number in range(1, different(sink.spans) + 1):
            span = min(number, row.solved)
            outputs[f"span{number}_middle"] = row.along(span, [0.5])[0]
            outputs[f"span{number}_mean"] = row.mean(span)
            outputs[f"span{number}_peak"] = row.along(span, np.linspace(0.0, 1.0, 41))
        for number in range(1, sink.spans // 2 + 1):
            # A block keeps a third of its capacity: the heat into the substrate over time is the film's alone.
            outputs[f"island{number}_heat"] = down * sink.island * row.mean(min(number, row.solved), island=True)
    return FewStates(
        row.line.products(both * (sink.silicon.heat_capacity * A_c + block * over)) + 2 * capacity * node,
        row.line.products(both * (air + gas + down * over), both * k * A_c) + 2 / anchor.resistance * node,
        per_length * integral + anchor.source * end,
        row.line.products(both * per_length) + anchor.feedback * node,
        per_length * sink.row_length + anchor.circuit, per_length * integral, per_length * sink.row_length, outputs,
        a, sink.drive,
    ).in_modes()  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Row:
    """Elements of half a row: how many each is in ``weights``, whether it is over one of the ``islands``, and the
    ``numbers`` of spans and islands from the pad inwards, of which ``solved`` differ."""

    line: Line
    weights: np.ndarray
    islands: np.ndarray
    numbers: np.ndarray
    solved: int

    def mean(self, number: int, island: bool = False) -> np.ndarray:
        """(n,): the mean over a span or an island."""
        elements = (self.numbers == number) & (self.islands == island)
        return self.line.integral(1.0 * elements) / np.array(self.line.lengths)[elements].sum()

    def along(self, number: int, places: np.ndarray | list[float]) -> np.ndarray:
        """(places, n): values at some places of a span (from 0 to 1), whose second half may mirror the first."""
        elements = np.flatnonzero((self.numbers == number) & ~self.islands).tolist()
        edges = np.cumsum([0.0, *(self.line.lengths[i] for i in elements)])
        whole = edges[-1] if len(elements) > len(_DEGREES) else 2 * edges[-1]
        rows = []
        for place in places:
            y = whole * (1 - place if place * whole > edges[-1] else place)
            i = min(max(int(np.searchsorted(edges, y, side="right")) - 1, 0), len(elements) - 1)
            rows.append(self.line.at(elements[i], 2 * (y - edges[i]) / (edges[i + 1] - edges[i]) - 1)[0])
        return np.array(rows)


def _halved(sink: Sink, finer: int) -> _Row:
    """The elements of half a row, with degrees so much higher."""
    inner, apart = different(sink.spans), math.ceil(math.log(_ALIKE) / math.log(decay(sink))) + finer // 2
    alike, solved = apart < inner, min(apart, inner)
    half, island = np.diff(_SPAN) * sink.length / 2, np.array([sink.island / 2])
    degrees, over = [p + finer for p in _DEGREES], [4 + finer]
    # Halves of spans and islands deeper than the middle of the first span that stands for others.
    deeper = (sink.spans - 2 * solved + 1) * alike
    elements: list[tuple[float, int, tuple[int, int], int, bool, int]] = []

    def add(number: int, parts: np.ndarray, degrees: list[int], first: int, weight: int = 1, isle: bool = False) -> int:
        """Appends elements from a node on; the node where they end."""
        for length, degree in zip(parts.tolist(), degrees, strict=True):
            last = len(elements) + 1  # every element brings one node, its end
            elements.append((length, degree, (first, last), weight, isle, number))
            first = last
        return first

    node = 0
    for number in range(1, solved + 1):
        first, last = node, number == solved
        node = add(number, half, degrees, node, 1 + deeper * last)
        if last and (alike or sink.spans % 2):
            break
        node = add(number, half[::-1], degrees[::-1], node)
        node = add(number, island, over, node, isle=True)
        node = node if last else add(number, island, over, node, isle=True)
    if alike:
        add(solved, island, over, first, deeper, isle=True)
    lengths, orders, nodes, weights, isles, numbers = zip(*elements, strict=True)
    return _Row(Line(lengths, orders, nodes), np.array(weights), np.array(isles), np.array(numbers), solved)
