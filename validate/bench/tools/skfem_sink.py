"""The sink in scikit-fem, as one who knows it would write it: hexahedra of degree 1 or 2 on the graded quarter, every
matrix assembled once, scipy's splu with an ordering for symmetric matrices, an L-stable Runge-Kutta method.

``options``: ``degree``, ``grading``, ``cuts`` (the cells), ``transient``, ``steps`` in each interval of
time, ``method`` (its order, 2 to 4), ``tolerance`` of the iterations. With ideal electrodes at the beam's ends the
current density is uniform (to 4e-7 at 1 V), so the Joule heat is affine in the rise: no electric problem.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex1, ElementHex2, FacetBasis, LinearForm, MeshHex

from fem3d import forms
from reduced1d.equations import room_resistivity
from scenes.loading import load
from scenes.model import Box
from scenes.sink import Sink
from validate.bench.problem import at_times, graded, numbers, quarter, step_times
from validate.verify import reference
from validate.verify.methods import METHODS

COPIES = 4
SMALL = 1e-9  # of the extent: closer coordinates are the same
ELEMENTS = {1: (ElementHex1, 3), 2: (ElementHex2, 5)}  # with the order of integration that is exact on bricks
Row = list[float]


@LinearForm
def _mean(v: Any, w: Any) -> Any:
    return v


def matrices(
    mesh: MeshHex, owner: np.ndarray, boxes: tuple[Box, ...], degree: int
) -> tuple[Basis, np.ndarray, csc_array, csc_array]:
    """The space, its nodes that are not held at room temperature, and stiffness (W/K) and mass (J/K) between them."""
    element, order = ELEMENTS[degree]
    basis = Basis(mesh, element(), intorder=order)

    def per_element(name: str) -> np.ndarray:
        return np.array([getattr(box.material, name) for box in boxes])[owner][:, None] * np.ones(basis.dx.shape)

    floor, small = mesh.p[2].min(), SMALL * np.ptp(mesh.p)
    free = basis.complement_dofs(basis.get_dofs(lambda x: np.abs(x[2] - floor) < small))
    stiffness = forms.conduction.assemble(basis, conductivity=per_element("thermal_conductivity"))
    mass = forms.capacity.assemble(basis, heat_capacity=per_element("heat_capacity"))
    return basis, free, _inner(stiffness, free), _inner(mass, free)


def _inner(matrix: Any, free: np.ndarray) -> csc_array:
    return csc_array(matrix[free][:, free])


class Problem:
    """The matrices of the free nodes, the Joule load of a state, and the quantities."""

    def __init__(self, sink: Sink, mesh: MeshHex, owner: np.ndarray, boxes: tuple[Box, ...], degree: int) -> None:
        basis, free, self.stiffness, self.mass = matrices(mesh, owner, boxes, degree)
        in_beam = np.flatnonzero(owner == next(i for i, box in enumerate(boxes) if box.name == "beam"))
        beam = basis.with_elements(in_beam)

        self.in_beam = _inner(forms.capacity.assemble(beam, heat_capacity=np.ones(beam.dx.shape)), free)
        ends = mesh.facets_satisfying(lambda x: np.abs(x[1]) < SMALL * np.ptp(mesh.p))
        facets = np.intersect1d(ends, mesh.t2f[:, in_beam])
        end = FacetBasis(mesh, basis.elem, facets=facets, intorder=ELEMENTS[degree][1])
        centre = np.array([[0.0], [sink.length / 2], [sink.thickness / 2]])
        area = sink.cross_section
        self.mean = _mean.assemble(beam)[free] / (sink.length * area / COPIES)
        peak = np.asarray(basis.probes(centre).todense())[0, free]
        self.rows = peak, _mean.assemble(end)[free] / (area / 2), self.mean
        rho, coefficient = room_resistivity(sink.silicon, sink.room_temperature)
        self.rho = rho, rho * coefficient
        self.sink, self.cold = sink, self.mean * sink.length / area / COPIES

    def current(self, rise: np.ndarray) -> float:
        """The current (A) of the whole cross section."""
        ratio = self.sink.length / self.sink.cross_section
        return float(self.sink.voltage / ((self.rho[0] + self.rho[1] * (self.mean @ rise)) * ratio))

    def load(self, rise: np.ndarray) -> np.ndarray:
        """The Joule load (W) at a rise."""
        warm = self.rho[1] / self.sink.cross_section**2 * (self.in_beam @ rise)
        found: np.ndarray = self.current(rise) ** 2 * (self.rho[0] * self.cold + warm)
        return found

    def quantities(self, rise: np.ndarray) -> Row:
        """In the order of QUANTITIES."""
        return [*(float(row @ rise) for row in self.rows), self.current(rise)]


def factors(matrix: csc_array) -> Callable[[np.ndarray], np.ndarray]:
    """Solves with a symmetric positive definite matrix."""
    options = {"SymmetricMode": True}
    solve: Any = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve
    return solve  # type: ignore[no-any-return]


def _steady(problem: Problem, tolerance: float) -> list[Row]:
    """Picard's iteration with one factorization."""
    solve, rise = factors(problem.stiffness), np.zeros(len(problem.mean))
    while True:
        new = solve(problem.load(rise))
        rise, change = new, float(np.linalg.norm(new - rise))
        if change <= tolerance * float(np.linalg.norm(new)):
            return [problem.quantities(rise)]


def _transient(problem: Problem, steps: int, method: tuple[tuple[float, ...], ...], tolerance: float) -> list[Row]:
    """Steps of equal length in each interval, one factorization each; every stage starts from the last one's rate."""
    times, gamma = step_times(steps), method[0][0]
    rise, rate = np.zeros((2, len(problem.mean)))
    length, found = 0.0, [problem.quantities(rise)]
    for step in np.diff(times):
        if abs(step - length) > 1e-9 * step:
            length = float(step)
            solve = factors(problem.mass + gamma * length * problem.stiffness)
        rates: list[np.ndarray] = []
        for weights in method:
            start = rise + length * sum((w * r for w, r in zip(weights, rates, strict=False)), np.zeros(len(rise)))
            for _ in range(40):
                stage = start + gamma * length * rate
                change = solve(problem.load(stage) - problem.mass @ rate - problem.stiffness @ stage)
                rate = rate + change
                if length * np.linalg.norm(change) <= tolerance * np.linalg.norm(stage):
                    break
            rates.append(rate)
        rise = start + gamma * length * rate
        found.append(problem.quantities(rise))
    return [found[i] for i in at_times(times)]


def prepare(
    options: dict[str, Any],
) -> tuple[Callable[[], tuple[int, list[Row]]], Callable[[tuple[int, list[Row]]], dict[str, Any]]]:
    """Assemble and solve the quarter on its mesh; read the numbers."""
    sink = load("sink", [])
    brick = graded(quarter(sink), options["grading"], options["cuts"], 1)
    mesh, owner = reference.hexahedra(brick)

    def solve() -> tuple[int, list[Row]]:
        problem = Problem(sink, mesh, owner, brick.boxes, options["degree"])
        if not options["transient"]:
            return len(problem.mean), _steady(problem, options["tolerance"])
        method = METHODS[options["method"]]
        return len(problem.mean), _transient(problem, options["steps"], method, options["tolerance"])

    return solve, lambda answer: numbers(options, *answer)
