"""The default sink as other finite-element programs solve it: the mesh, the Joule heat, the quantities and the times.

A quarter of the sink is meshed by graded hexahedra. Between ideal electrodes at the beam's ends the current density
varies by 4e-7 at 1 V only: the programs take it as uniform, so that the Joule heat is affine in the temperature.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from skfem import MeshHex

from benchmarks import sdirk
from reduced1d.equations import room_resistivity
from scenes.loading import load
from scenes.sink import Sink

QUANTITIES = ("peak_rise_K", "end_rise_K", "mean_rise_K", "current_A")
END = 0.02  # s
TIMES = (*(1e-5 * 2.0**k for k in range(11)), END)  # octaves; they are among the steps of every program
EDGES = (0.0, *(1e-5 * 4.0**k for k in range(6)), END)  # equal steps within each of these intervals
COPIES = 4
Prepared = tuple[Callable[[], Any], Callable[[Any], dict[str, Any]]]
"""The timed part of an entry, and the reading of its numbers from the answer."""


def mesh(sink: Sink, first: float, ratio: float) -> MeshHex:
    """Return the hexahedra of a quarter (m), with the subdomains "beam", "pad" and "oxide", and as boundaries the
    oxide's "substrate" and the beam's "end", which is inside.

    Cells at the planes of the geometry are ``first`` long (m) and grow by ``ratio`` away from them.
    """
    half, far = sink.length / 2, sink.anchor_distance + sink.oxide_length
    x = (0.0, sink.width / 2, sink.oxide_width / 2, sink.pad_width / 2)
    y = (-sink.pad_length, -far, -sink.anchor_distance, 0.0, half)
    z = (-sink.oxide_thickness, 0.0, sink.thickness)
    cells = MeshHex.init_tensor(*(_graded(sorted(set(planes)), first, ratio) for planes in (x, y, z)))
    subdomains = {
        "beam": lambda x: (x[1] > 0) & (x[0] < sink.width / 2) & (x[2] > 0),
        "pad": lambda x: (x[1] < 0) & (x[2] > 0),
        "oxide": lambda x: (x[2] < 0) & (x[0] < sink.oxide_width / 2) & (-far < x[1]) & (x[1] < -sink.anchor_distance),
    }
    boundaries = {
        "substrate": lambda x: np.isclose(x[2], -sink.oxide_thickness),
        "end": lambda x: np.isclose(x[1], 0.0) & (x[0] < sink.width / 2) & (x[2] > 0),
    }
    solid = np.concatenate([cells.elements_satisfying(inside) for inside in subdomains.values()])
    part = cells.restrict(np.sort(solid)).with_subdomains(subdomains)
    return part.with_boundaries(boundaries, boundaries_only=False)


def _graded(planes: Sequence[float], first: float, ratio: float) -> np.ndarray:
    points = [np.array(planes[:1])]
    for a, b in pairwise(planes):
        lengths = [first]
        while sum(lengths) < (b - a) / 2:
            lengths.append(lengths[-1] * ratio)
        half = np.cumsum(lengths) / sum(lengths) * (b - a) / 2
        points += [a + half, b - half[-2::-1], np.array([b])]
    return np.concatenate(points)


class Program:
    """A discrete heat problem of the quarter, mass du/dt + stiffness u = load(u), u being the rise (K) of the nodes.

    Attributes
    ----------
    mass, stiffness, pairs : matrices; of ``pairs`` the integrals of products of two functions over the beam (m3)
    rows : the weights (size,) of the peak, of the mean of the beam's end and of the mean of the beam
    """

    def __init__(self, sink: Sink, rows: Sequence[np.ndarray], mass: Any, stiffness: Any, pairs: Any) -> None:
        self.sink, self.rows, self.size = sink, rows, len(rows[0])
        self.mass, self.stiffness, self.pairs = mass, stiffness, pairs
        self.volume = rows[2] * (sink.length * sink.cross_section / COPIES)
        self.rho, self.coefficient = room_resistivity(sink.silicon, sink.room_temperature)

    def current(self, rise: np.ndarray) -> float:
        """Return the current (A)."""
        mean = self.rho * (1 + self.coefficient * float(self.rows[2] @ rise))
        return float(self.sink.voltage) * self.sink.cross_section / (mean * self.sink.length)

    def load(self, rise: np.ndarray) -> np.ndarray:
        """Return the Joule load (W)."""
        density = self.current(rise) / self.sink.cross_section
        return density**2 * self.rho * (self.volume + self.coefficient * (self.pairs @ rise))

    def quantities(self, rise: np.ndarray) -> list[float]:
        """Return the numbers that `QUANTITIES` names."""
        return [*(float(row @ rise) for row in self.rows), self.current(rise)]


def step_times(per_octave: int) -> np.ndarray:
    """Return the times (s) of equal steps within each interval of `EDGES`, with `TIMES` among them."""
    times = [np.zeros(1)]
    for i, (a, b) in enumerate(pairwise(EDGES)):
        count = per_octave * (3 if 0 < i < len(EDGES) - 2 else 1)
        times.append(a + (b - a) * np.arange(1, count + 1) / count)
    return np.concatenate(times)


def prepare(assemble: Callable[[Sink, MeshHex, int], Program], options: Mapping[str, Any]) -> Prepared:
    """Return the timed part of a program, from the mesh to the answer, and the reading of its numbers.

    Options are ``transient``, ``order``, ``first`` and ``ratio`` of the mesh, and ``steps`` to an octave.
    """
    sink = load("sink", [])
    cells = mesh(sink, options["first"], options["ratio"])

    def solve() -> tuple[int, list[list[float]]]:
        program = assemble(sink, cells, options["order"])
        if not options["transient"]:
            return program.size, [program.quantities(sdirk.solve_steady(program, 1e-8))]
        times = step_times(options["steps"])
        wanted = {int(np.abs(times - t).argmin()) for t in TIMES}
        states = enumerate(sdirk.march(program, times, 1e-7))
        return program.size, [program.quantities(rise) for i, rise in states if i in wanted]

    def read(answer: tuple[int, list[list[float]]]) -> dict[str, Any]:
        return {"unknowns": answer[0], "values": dict(zip(QUANTITIES, np.array(answer[1]).T.tolist(), strict=True))}

    return solve, read
