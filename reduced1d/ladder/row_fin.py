"""A row of spans as one fin: the heat equation along the beam from pad to pad, over the islands too.

    (rho c A + c_i) dT/dt = k A T'' - (h_air w + g_i) T + I^2 rho_e(T) / A,

where over an island g_i is that of its block in series with the silicon's thickness, times its width, and c_i a third
of the block's capacity, as for the plate (`reduced1d.ladder.plate`); elsewhere both are zero. At the ends there are
anchors as those of one span's fin. What it leaves out is that the rise is not uniform across the beam where heat
converges to an island narrower than it.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from reduced1d.equations import room_resistivity
from reduced1d.ladder.anchor import Anchor
from reduced1d.ladder.few_states import FewStates, Matrices, in_modes
from reduced1d.ladder.fin import line
from reduced1d.ladder.quads import film
from scenes.sink import Sink, different, start

_SPAN = (0.0, 0.04, 0.2, 0.5, 0.8, 0.96, 1.0)  # of a span: heat spreads from its ends at 10 us, and long after
_DEGREE = 4
_PLACES = 41  # along a span, between which its top is looked for


def row_fin(sink: Sink, anchor: Anchor, *, pad_capacity: bool, oxide_capacity: bool, finer: int = 0) -> FewStates:
    """The fin of half a row on its anchor, with the capacities that are asked for (of the islands with the oxide's);
    ``finer`` is added to the polynomials' degrees.

    Raises ValueError where the silicon does not conduct.
    """
    breaks, spans, islands = _breaks(sink)
    degrees = np.full(len(breaks) - 1, _DEGREE + finer)
    integral, mass, stiffness = line(breaks, degrees)
    over = line(breaks, degrees, islands)[1]
    k, A_c = sink.silicon.thermal_conductivity, sink.cross_section
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    per_length, air = resistivity / A_c, sink.convection_coefficient * sink.width
    end = np.eye(len(integral))[0]
    node = np.outer(end, end)
    own = pad_capacity * anchor.pad + oxide_capacity * anchor.oxide
    block = oxide_capacity * sink.oxide.heat_capacity * sink.oxide_thickness * sink.island_width / 3
    down = film(sink) * sink.island_width
    outputs = {
        "end": end, "anchor_heat": end / anchor.resistance,
        "mean": 2 / sink.spans / sink.length * sum(line(breaks, degrees, of)[0] for of in spans),
        "air": 2 * air * integral + 2 * anchor.air * end,
    }  # fmt: skip
    for number, of in enumerate(spans, start=1):
        middle = start(sink, number) + sink.length / 2
        at = int(np.abs(breaks - middle).argmin())
        whole = line(breaks, degrees, of)[0]
        outputs[f"span{number}_middle"] = np.eye(len(integral))[at]
        outputs[f"span{number}_mean"] = whole / (whole @ _unit(breaks, integral))
        places = start(sink, number) + sink.length * np.linspace(0, 1, _PLACES)
        # Of the innermost of an odd number the other half is the mirror image of what there is.
        outputs[f"span{number}_peak"] = _at(breaks, degrees, np.minimum(places, sink.row_length - places))
    firsts = [start(sink, n) + sink.length for n in range(1, sink.spans // 2 + 1)]
    for number, first in enumerate(firsts, start=1):
        of = islands & (breaks[:-1] > first - sink.island / 9) & (breaks[1:] < first + sink.island * 1.1)
        inside = float(np.diff(breaks)[of].sum()) / sink.island
        # A block above which time passes keeps a third of its capacity: what enters the substrate is the film's alone.
        outputs[f"island{number}_heat"] = down * line(breaks, degrees, of)[0] / inside
    matrices = Matrices(
        2 * (sink.silicon.heat_capacity * A_c * mass + block * over + own * node),
        2 * (k * A_c * stiffness + air * mass + down * over + node / anchor.resistance),
        2 * per_length * integral + anchor.source * end, 2 * per_length * mass + anchor.feedback * node,
        2 * per_length * float(breaks[-1]) + anchor.circuit, 2 * per_length * integral,
        2 * per_length * float(breaks[-1]), outputs,
    )  # fmt: skip
    return in_modes(matrices, a, sink.spans * sink.voltage)


def _at(breaks: np.ndarray, degrees: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(places, n): the functions of `line` at some places (m)."""
    found = np.zeros((len(places), len(breaks) + int(np.sum(degrees - 1))))
    first = len(breaks) + np.concatenate([[0], np.cumsum(degrees - 1)])
    interval = np.clip(np.searchsorted(breaks, places, side="right") - 1, 0, len(degrees) - 1)
    for place, (i, y) in enumerate(zip(interval.tolist(), places.tolist(), strict=True)):
        p, x = int(degrees[i]), 2 * (y - breaks[i]) / (breaks[i + 1] - breaks[i]) - 1
        v = legendre.legvander(np.array([x]), p)[0]
        found[place, [i, i + 1]] = (1 - x) / 2, (1 + x) / 2
        found[place, first[i] : first[i + 1]] = [(v[k] - v[k - 2]) / (2 * k - 1) for k in range(2, p + 1)]
    return found


def _unit(breaks: np.ndarray, integral: np.ndarray) -> np.ndarray:
    """(n,): the coefficients of the constant 1."""
    found = np.zeros(len(integral))
    found[: len(breaks)] = 1.0
    return found


def _breaks(sink: Sink) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Breakpoints (m) from the pad to the row's middle; which intervals are each span's, and which are on islands."""
    middle = sink.row_length / 2
    found: list[float] = []
    for number in range(1, different(sink.spans) + 1):
        first = start(sink, number)
        found += [first + part * sink.length for part in _SPAN]
        found += [first + sink.length + sink.island / 2]
    breaks = np.array([c for c in found if c < middle * (1 + 1e-9)])
    at = (breaks[1:] + breaks[:-1]) / 2
    period = sink.length + sink.island
    islands = at % period > sink.length
    spans = [~islands & (at // period == n) for n in range(different(sink.spans))]
    return breaks, spans, islands
