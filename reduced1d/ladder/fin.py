"""The beam as a fin from pad to pad, over the islands of a row of spans too.

It is the heat equation along the beam, with the heat that the current makes at each place,

    (rho c A + c_i) dT/dt = k A T'' - (h_air w + g_i) T + I^2 rho_e(T) / A,

where over an island g_i is that of its block in series with the silicon's thickness, times its width, and c_i a third
of the block's capacity, as for the plate (`reduced1d.ladder.plate`); elsewhere both are zero. At its ends are anchors
of a resistance R and a capacity C,  k A T' = T / R + C dT/dt, where electrodes at the pads' outer faces also make heat.
Half of the row is cut into polynomials; theirs is Galerkin's method, as is the anchor's one shape, so that the fin of
one span is the plate projected on rises that are uniform across the beam. What a row's fin leaves out besides is that
heat converges to an island narrower than the beam.

Spans further in than some few are all alike, each symmetric about its middle: the polynomials of one half of a span and
of one half of an island serve for all of these, which is Galerkin's method too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial import legendre

from reduced1d.equations import room_resistivity
from reduced1d.ladder.anchor import Anchor
from reduced1d.ladder.few_states import FewStates, Matrices, in_modes
from reduced1d.ladder.quads import film
from scenes.sink import Sink, decay, different

_SPAN = (0.0, 0.02, 0.08, 0.3, 1.0)  # of half a span: heat spreads from its end at 10 us, and long after
_DEGREES = (5, 6, 7, 8)
_ISLAND = 4
_PLACES = 41  # along a span, between which its top is looked for
_ALIKE = 1e-6  # of what a row's end does to its first span: what is left of it in those that are taken to be alike


def fin(
    sink: Sink, anchor: Anchor, *, pad_capacity: bool = True, oxide_capacity: bool = True, finer: int = 0
) -> FewStates:
    """The fin on an anchor, with the capacities that are asked for (of the islands with the oxide's); ``finer`` is
    added to the polynomials' degrees, and half of it to the spans that are told apart.

    Raises ValueError where the silicon does not conduct.
    """
    line = _halved(sink, finer)
    integral, (mass, stiffness) = line.integral(), line.products()
    over = line.products("island")[0]
    k, A_c = sink.silicon.thermal_conductivity, sink.cross_section
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    per_length, air = resistivity / A_c, sink.convection_coefficient * sink.width
    end = np.eye(len(integral))[0]
    node = np.outer(end, end)
    own = pad_capacity * anchor.pad + oxide_capacity * anchor.oxide
    block = oxide_capacity * sink.oxide.heat_capacity * sink.oxide_thickness * sink.island_width / 3
    down = film(sink) * sink.island_width
    beam = 2 * per_length * integral
    outputs = {
        "end": end, "mean": 2 / sink.spans / sink.length * line.integral("span"),
        "air": 2 * air * integral + 2 * anchor.air * end,
    }  # fmt: skip
    if sink.spans == 1:
        outputs |= {"peak": line.middle(1), "air_beam": 2 * air * integral}
    else:
        outputs |= {"anchor_heat": end / anchor.resistance, **_of_spans(sink, line, down)}
    matrices = Matrices(
        2 * (sink.silicon.heat_capacity * A_c * mass + block * over + own * node),
        2 * (k * A_c * stiffness + air * mass + down * over + node / anchor.resistance),
        beam + anchor.source * end, 2 * per_length * mass + anchor.feedback * node,
        per_length * sink.row_length + anchor.circuit, beam, per_length * sink.row_length, outputs,
    )  # fmt: skip
    return in_modes(matrices, a, sink.spans * sink.voltage)


def _of_spans(sink: Sink, line: _Line, down: float) -> dict[str, np.ndarray]:
    """The rises of each span, and the heat through each island, which conducts ``down`` (W/(m K))."""
    found: dict[str, np.ndarray] = {}
    for number in range(1, different(sink.spans) + 1):
        own = min(number, line.solved)
        found |= {
            f"span{number}_middle": line.middle(own), f"span{number}_mean": line.mean("span", own),
            f"span{number}_peak": line.along(own, np.linspace(0.0, 1.0, _PLACES)),
        }  # fmt: skip
    for number in range(1, sink.spans // 2 + 1):
        # A block above which time passes keeps a third of its capacity: what enters the substrate is the film's alone.
        found[f"island{number}_heat"] = down * sink.island * line.mean("island", min(number, line.solved))
    return found


@dataclass
class _Line:
    """Intervals of half a row: their ``lengths`` (m), ``degrees``, both ``nodes``, how many each is in ``weights``, and
    whose they are in ``owners``, of spans from the pad inwards, of which ``solved`` are told apart.

    The functions are those of the nodes and, on each interval, the integrals of Legendre's polynomials.
    """

    solved: int
    lengths: list[float] = field(default_factory=list)
    degrees: list[int] = field(default_factory=list)
    nodes: list[tuple[int, int]] = field(default_factory=list)
    weights: list[int] = field(default_factory=list)
    owners: list[tuple[str, int]] = field(default_factory=list)

    def add(self, owner: tuple[str, int], parts: np.ndarray, degrees: list[int], first: int, weight: int = 1) -> int:
        """Appends intervals that begin at a node, each of that weight; the node where they end."""
        for length, degree in zip(parts.tolist(), degrees, strict=True):
            last = max((b for _, b in self.nodes), default=0) + 1
            self.nodes.append((first, last))
            self.lengths.append(length)
            self.degrees.append(degree)
            self.weights.append(weight)
            self.owners.append(owner)
            first = last
        return first

    def _functions(self, of: int) -> list[int]:
        """The numbers of an interval's functions."""
        first = len(self.nodes) + 1 + sum(p - 1 for p in self.degrees[:of])
        return [*self.nodes[of], *range(first, first + self.degrees[of] - 1)]

    @property
    def size(self) -> int:
        """How many functions there are."""
        return len(self.nodes) + 1 + sum(p - 1 for p in self.degrees)

    def _of(self, kind: str, number: int) -> list[int]:
        """The intervals of a kind, or of one span or island; all where none is said."""
        return [i for i, (a, b) in enumerate(self.owners) if kind in ("", a) and number in (0, b)]

    def integral(self, kind: str = "", number: int = 0) -> np.ndarray:
        """(n,): the integrals of the functions."""
        found = np.zeros(self.size)
        for i in self._of(kind, number):
            x, w = legendre.leggauss(self.degrees[i] + 1)
            found[self._functions(i)] += self.weights[i] * self.lengths[i] / 2 * _shapes(self.degrees[i], x)[0] @ w
        return found

    def products(self, kind: str = "", number: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """(n, n) twice: the integrals of products of the functions, and of those of their slopes."""
        mass, stiffness = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        for i in self._of(kind, number):
            h, p, weight = self.lengths[i], self.degrees[i], self.weights[i]
            x, w = legendre.leggauss(p + 1)
            f, slopes = _shapes(p, x)
            own = np.ix_(self._functions(i), self._functions(i))
            mass[own] += weight * h / 2 * (f * w) @ f.T
            stiffness[own] += weight * 2 / h * (slopes * w) @ slopes.T
        return mass, stiffness

    def mean(self, kind: str, number: int) -> np.ndarray:
        """(n,): the mean over a span or an island."""
        found = self.integral(kind, number)
        mean: np.ndarray = found / found[: len(self.nodes) + 1].sum()
        return mean

    def middle(self, number: int) -> np.ndarray:
        """(n,): the value in the middle of a span."""
        return self.along(number, np.array([0.5]))[0]

    def along(self, number: int, places: np.ndarray) -> np.ndarray:
        """(places, n): values at some places of a span (from 0 to 1), of which its second half may mirror the first."""
        own = self._of("span", number)
        edges = np.concatenate([[0.0], np.cumsum([self.lengths[i] for i in own])])
        whole = edges[-1] if len(own) > len(_DEGREES) else 2 * edges[-1]
        at = np.where(places * whole > edges[-1], 1 - places, places) * whole
        found = np.zeros((len(at), self.size))
        within = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, len(own) - 1)
        for row, (i, y) in enumerate(zip(within.tolist(), at.tolist(), strict=True)):
            x = 2 * (y - edges[i]) / (edges[i + 1] - edges[i]) - 1
            found[row, self._functions(own[i])] = _shapes(self.degrees[own[i]], np.array([x]))[0][:, 0]
        return found


def _halved(sink: Sink, finer: int) -> _Line:
    """The intervals of half a row, with degrees so much higher."""
    inner, apart = different(sink.spans), math.ceil(math.log(_ALIKE) / math.log(decay(sink))) + finer // 2
    alike = apart < inner
    line = _Line(min(apart, inner))
    half, island = np.diff(_SPAN) * sink.length / 2, np.array([sink.island / 2])
    degrees, over = [p + finer for p in _DEGREES], [_ISLAND + finer]
    # Halves of spans and islands deeper than the middle of the first span of those that are alike.
    deeper = (sink.spans - 2 * line.solved + 1) * alike
    node = 0
    for number in range(1, line.solved + 1):
        first, last = node, number == line.solved
        node = line.add(("span", number), half, degrees, node, 1 + deeper * last)
        if last and (alike or sink.spans % 2):
            break
        node = line.add(("span", number), half[::-1], degrees[::-1], node)
        node = line.add(("island", number), island, over, node)
        node = node if last else line.add(("island", number), island, over, node)
    if alike:
        line.add(("island", line.solved), island, over, first, deeper)
    return line


def _shapes(p: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(p + 1, points) twice: the functions of an interval of degree p at points in (-1, 1), and their slopes."""
    v, one = legendre.legvander(x, p).T, np.ones(len(x))
    f = np.array([(1 - x) / 2, (1 + x) / 2, *((v[k] - v[k - 2]) / (2 * k - 1) for k in range(2, p + 1))])
    return f, np.array([-one / 2, one / 2, *(v[k - 1] for k in range(2, p + 1))])
