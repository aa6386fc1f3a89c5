"""The sink in NGSolve, as one who knows it would write it: H1 hexahedra of any order on a graded quarter, sparse
Cholesky factors that serve again, and an L-stable Runge-Kutta method with steps that grow.

``options``: ``order`` of the elements, ``layers`` that across thin layers, ``grading`` (the cells),
``electric`` "uniform" or "full", ``transient``, ``steps`` in each interval of time, ``method`` (its order, 2 to 4),
``tolerance`` of the iterations.

"uniform" uses that with ideal electrodes at the beam's ends the current density hardly varies (by 4e-7 at 1 V): no
electric problem is solved, and the Joule heat is affine in the temperature. It is the fastest that can be done here.
"full" solves the potential with the resistivity of each stage and assembles the Joule heat anew.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import ngsolve as ng
import numpy as np
from ngsolve import dx, grad

from reduced1d.equations import room_resistivity
from scenes.loading import load
from scenes.model import Box
from scenes.sink import Sink
from validate.bench.problem import at_times, graded, numbers, quarter, step_times
from validate.bench.tools import hexahedra
from validate.verify.methods import METHODS

MICRO = 1e-6
COPIES = 4
Row = list[float]


class Problem:
    """The matrices, the Joule load of a state, and the quantities; lengths in micrometres, the rest in SI."""

    def __init__(self, sink: Sink, mesh: ng.Mesh, boxes: tuple[Box, ...], options: dict[str, Any]) -> None:
        self.sink, self.options, self.mesh = sink, options, mesh
        self.space = ng.H1(mesh, dirichlet="substrate", **hexahedra.orders(options["order"], options["layers"]))
        self.free = self.space.FreeDofs()
        u, v = self.space.TnT()
        materials = {box.name: box.material for box in boxes}
        k = self.mesh.MaterialCF({n: m.thermal_conductivity * MICRO for n, m in materials.items()})
        c = self.mesh.MaterialCF({n: m.heat_capacity * MICRO**3 for n, m in materials.items()})
        self.conduction = ng.BilinearForm(
            k * grad(u) * grad(v) * dx, symmetric=True, condense=not options["transient"]
        ).Assemble()
        self.stiffness = self.conduction.mat
        self.mass = ng.BilinearForm(c * u * v * dx, symmetric=True).Assemble().mat
        rho, coefficient = room_resistivity(sink.silicon, sink.room_temperature)
        self.rho, area = (rho, rho * coefficient), sink.cross_section
        mean = ng.LinearForm(v * dx("beam")).Assemble().vec
        end = ng.LinearForm(v * ng.ds("end")).Assemble().vec
        peak = ng.LinearForm(self.space)
        peak += v(0.0, sink.length / 2 / MICRO, sink.thickness / 2 / MICRO)
        peak.Assemble()
        volume = sink.length * area / COPIES / MICRO**3
        self.mean = mean
        self.rows = (peak.vec, end, mean), (1.0, area / 2 / MICRO**2, volume)
        # Heat per current squared: at no rise, and per kelvin; the current is that of the whole cross section.
        self.cold = (self.rho[0] * MICRO**3 / area**2) * mean
        if options["electric"] == "uniform":
            warm = self.rho[1] * MICRO**3 / area**2
            self.warm = ng.BilinearForm(warm * u * v * dx("beam"), symmetric=True).Assemble().mat
        else:
            self._electric()

    def _electric(self) -> None:
        self.rise = ng.GridFunction(self.space)
        orders = hexahedra.orders(self.options["order"], self.options["layers"])
        space = ng.H1(self.mesh, definedon="beam", dirichlet="end|middle", **orders)
        u, v = space.TnT()
        sigma = MICRO / (self.rho[0] + self.rho[1] * self.rise)
        self.phi = ng.GridFunction(space)
        self.phi.Set(self.mesh.BoundaryCF({"end": self.sink.voltage, "middle": self.sink.voltage / 2}), ng.BND)
        self.current = ng.BilinearForm(sigma * grad(u) * grad(v) * dx("beam"), symmetric=True)
        heat = sigma * grad(self.phi) * grad(self.phi)
        self.joule = ng.LinearForm(heat * self.space.TestFunction() * dx("beam"))
        self.power = heat * dx("beam")

    def load(self, rise: Any) -> tuple[Any, float]:
        """The Joule load (W) at a rise, and the current (A)."""
        if self.options["electric"] == "uniform":
            area, length = self.sink.cross_section, self.sink.length
            mean = ng.InnerProduct(self.mean, rise) / self.rows[1][2]
            current = self.sink.voltage / ((self.rho[0] + self.rho[1] * mean) * length / area)
            load = rise.CreateVector()
            load.data = current**2 * self.cold + current**2 * self.warm * rise
            return load, current
        self.rise.vec.data = rise
        self.current.Assemble()
        residual = self.phi.vec.CreateVector()
        residual.data = -self.current.mat * self.phi.vec
        inverse = self.current.mat.Inverse(self.phi.space.FreeDofs(), inverse="sparsecholesky")
        self.phi.vec.data += inverse * residual
        self.joule.Assemble()
        power = ng.Integrate(self.power, self.mesh)
        return self.joule.vec, COPIES * power / self.sink.voltage

    def quantities(self, rise: Any) -> Row:
        """In the order of QUANTITIES."""
        rises = [ng.InnerProduct(row, rise) / size for row, size in zip(*self.rows, strict=True)]
        return [*rises, self.load(rise)[1]]

    def factor(self, matrix: Any) -> Any:
        """The Cholesky factors of a matrix on the free nodes."""
        return matrix.Inverse(self.free, inverse="sparsecholesky")


def steady(problem: Problem) -> list[Row]:
    """Picard's iteration with one factorization, of what is left when the unknowns inside elements are condensed."""
    form = problem.conduction
    solve = form.mat.Inverse(problem.space.FreeDofs(True), inverse="sparsecholesky")
    rise, new, load = (problem.mean.CreateVector() for _ in range(3))
    rise[:] = 0.0
    while True:
        load.data = problem.load(rise)[0]
        inside = form.inner_solve * load
        load.data += form.harmonic_extension_trans * load
        new.data = solve * load
        new.data += form.harmonic_extension * new
        new.data += inside
        rise.data -= new
        change = rise.Norm()
        rise.data = new
        if change <= problem.options["tolerance"] * new.Norm():
            return [problem.quantities(rise)]


def transient(problem: Problem) -> list[Row]:
    """Steps of equal length in each interval, one factorization each; every stage starts from the last one's rate."""
    times = step_times(problem.options["steps"])
    method, tolerance = METHODS[problem.options["method"]], problem.options["tolerance"]
    gamma = method[0][0]
    rise, start, stage, change = (problem.mean.CreateVector() for _ in range(4))
    rates = [problem.mean.CreateVector() for _ in method]
    residual, matrix = problem.mean.CreateVector(), problem.mass.CreateMatrix()
    rise[:] = 0.0
    rates[-1][:] = 0.0
    length, found = 0.0, [problem.quantities(rise)]
    for step in np.diff(times):
        if abs(step - length) > 1e-9 * step:
            length = float(step)
            matrix.AsVector().data = problem.mass.AsVector() + gamma * length * problem.stiffness.AsVector()
            solve = problem.factor(matrix)
        for s, weights in enumerate(method):
            start.data = rise
            for weight, earlier in zip(weights[:-1], rates, strict=False):
                start.data += weight * length * earlier
            rate = rates[s]
            rate.data = rates[s - 1]
            for _ in range(40):
                stage.data = start + gamma * length * rate
                residual.data = problem.load(stage)[0] - problem.mass * rate - problem.stiffness * stage
                change.data = solve * residual
                rate.data += change
                if length * change.Norm() <= tolerance * stage.Norm():
                    break
        rise.data = start + gamma * length * rates[-1]
        found.append(problem.quantities(rise))
    return [found[i] for i in at_times(times)]


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Any], Callable[[Any], dict[str, Any]]]:
    """Assemble and solve the quarter on its mesh; read the numbers."""
    sink = load("sink", [])
    brick = graded(quarter(sink), options["grading"], 1, options["order"], options["layers"])
    mesh = hexahedra.of(brick)

    def solve() -> tuple[int, list[Row]]:
        problem = Problem(sink, mesh, brick.boxes, options)
        return sum(problem.free), (transient if options["transient"] else steady)(problem)

    return solve, lambda answer: numbers(options, *answer)
