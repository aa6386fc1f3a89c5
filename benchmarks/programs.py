"""Programs that solve the default sink: this toolkit's models, as their users call them, and plain scikit-fem.

The plain program meshes a quarter of the sink by graded hexahedra of degree 2. Between ideal electrodes at the beam's
ends the current density varies by 4e-7 at 1 V only: it is taken as uniform, so that the Joule heat is affine in the
temperature. A program is prepared first; the returned functions are its timed part, and the reading of its numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementHex2, LinearForm, MeshHex
from skfem.helpers import dot, grad

from benchmarks import sdirk
from fem3d.runs import sink as sinks
from reduced1d import ladder
from reduced1d.equations import room_resistivity
from scenes.result import Result
from scenes.sink import Sink

QUANTITIES = ("peak_rise_K", "end_rise_K", "mean_rise_K", "current_A")
TIMES = (*(1e-5 * 2.0**k for k in range(11)), 0.02)  # s, in octaves
COPIES = 4
Prepared = tuple[Callable[[], Any], Callable[[Any], dict[str, Any]]]

conduction = BilinearForm(lambda u, v, w: w.k * dot(grad(u), grad(v)))
capacity = BilinearForm(lambda u, v, w: w.c * u * v)
integral = LinearForm(lambda v, w: v)


def own(model: str, transient: bool, accuracy: float = 1e-3) -> Prepared:
    """Prepare this toolkit's ``model``: "3d", or a reduction by its name."""
    sink = Sink(accuracy=accuracy)

    def solve() -> Result:
        return sinks.solve(sink, transient) if model == "3d" else ladder.solve(sink, model, steady_only=not transient)

    def read(result: Result) -> dict[str, Any]:
        """The quantities at each of `TIMES`, or in the steady state, and the largest error bound over the value."""
        steady = {q: result.steady[q] for q in QUANTITIES}
        values, bounds = {q: [e.value] for q, e in steady.items()}, {q: e.error for q, e in steady.items()}
        if result.traces is not None:
            for q in QUANTITIES:
                name = q.replace("_rise", "")
                start = sink.room_temperature if name != q else 0.0
                values[q] = (np.interp(TIMES, result.traces.time, result.traces.values[name]) - start).tolist()
                bounds[q] = result.traces.errors.get(name, 0.0)
        size = result.details.get("unknowns", result.details.get("states"))
        bound = max(bounds[q] / abs(steady[q].value) for q in QUANTITIES)
        return {"values": values, "unknowns": size, "bound": bound}

    return solve, read


def plain(transient: bool, first: float, ratio: float, steps: int) -> Prepared:
    """Prepare scikit-fem, with equal ``steps`` in each octave, on cells that are ``first`` (m) long at planes and grow
    by a ``ratio``."""
    sink = Sink()
    cells = mesh(sink, first, ratio)

    def solve() -> tuple[int, list[list[float]]]:
        program = Program(sink, cells)
        if not transient:
            return program.size, [program.quantities(sdirk.solve_steady(program, 1e-8))]
        times = np.interp(np.arange(steps * len(TIMES) + 1) / steps, range(len(TIMES) + 1), (0.0, *TIMES))
        states = [program.quantities(rise) for rise in sdirk.march(program, times, 1e-7)]
        return program.size, states[steps::steps]

    def read(answer: tuple[int, list[list[float]]]) -> dict[str, Any]:
        return {"unknowns": answer[0], "values": dict(zip(QUANTITIES, np.array(answer[1]).T.tolist(), strict=True))}

    return solve, read


def mesh(sink: Sink, first: float, ratio: float) -> MeshHex:
    """Return the hexahedra of a quarter (m), with the subdomains "beam", "pad" and "oxide", and as boundaries the
    oxide's "substrate" and the beam's "end", which is inside."""
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
    """The discrete heat problem of the quarter, mass du/dt + stiffness u = load(u), u being the rise (K) of the nodes
    above the substrate.

    Attributes
    ----------
    mass, stiffness, pairs : matrices; of ``pairs`` the integrals of products of two functions over the beam (m3)
    rows : the weights (size,) of the peak, of the mean of the beam's end and of the mean of the beam
    """

    def __init__(self, sink: Sink, cells: MeshHex) -> None:
        basis = Basis(cells, ElementHex2(), intorder=5)
        beam, oxide = basis.with_elements("beam"), cells.subdomains["oxide"]
        k, c = (np.full(basis.dx.shape, v) for v in (sink.silicon.thermal_conductivity, sink.silicon.heat_capacity))
        k[oxide], c[oxide] = sink.oxide.thermal_conductivity, sink.oxide.heat_capacity
        free = basis.complement_dofs(basis.get_dofs("substrate"))
        self.mass, self.stiffness, self.pairs = (matrix[free][:, free].tocsc() for matrix in (
            capacity.assemble(basis, c=c), conduction.assemble(basis, k=k),
            capacity.assemble(beam, c=np.ones(beam.dx.shape)),
        ))  # fmt: skip
        middle = np.array([[0.0], [sink.length / 2], [sink.thickness / 2]])
        rows = [np.asarray(basis.probes(middle).todense())[0]]
        rows += [(load := integral.assemble(part)) / load.sum() for part in (basis.boundary("end"), beam)]
        self.sink, self.rows, self.size = sink, [row[free] for row in rows], len(free)
        self.volume = self.rows[2] * (sink.length * sink.cross_section / COPIES)
        self.rho, self.coefficient = room_resistivity(sink.silicon, sink.room_temperature)

    def factors(self, mass: float, stiffness: float) -> Callable[[np.ndarray], np.ndarray]:
        """Factorize a combination of the matrices."""
        matrix = (mass * self.mass + stiffness * self.stiffness).tocsc()
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        return factors.solve  # type: ignore[no-any-return]

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
