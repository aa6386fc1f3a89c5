"""The observed orders in space of every element that is used, on manufactured solutions: this project's bricks of any
degree and, by the second path, scikit-fem's hexahedra of degree 1 or 2; and those in time of every integrator, each
with fixed steps against an exact or a dense solution.

Errors in space are those in L2 and H1 of the rise (and of the potential), of a weighted mean, of the power.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.sparse.linalg import spsolve
from skfem import Basis, FacetBasis

from fem3d.problems import conductors
from fem3d.problems.assembly import assemble
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.solution import steady, transient
from fem3d.solution.exponential import integrate
from fem3d.solution.transient import Base, Krylov
from fem3d.spaces.domain import boxes
from meshes.grid import Grid
from reduced1d.device.lumped import Slab
from reduced1d.device.paper import crank_nicolson, mesh_ratio
from scenes.model import Boundary, Scene
from scenes.sink import Sink
from validate.verify import manufactured, reference
from validate.verify.manufactured import LAYER, SIZE, Heating, Manufactured, joule
from validate.verify.reference import FullOrder
from validate.verify.report import Row, observed_order, order_row

PLANES = ((0.0, 0.45, SIZE[0]), (0.0, 0.35, SIZE[1]), (0.0, LAYER, SIZE[2]))
FINER = 3  # Gauss points more than usual along each axis, at which errors are integrated
ORDER = 8  # of the quadrature for loads and errors on hexahedra
PICARD, SETTLED = 200, 1e-13
Errors = dict[str, float]
FAMILY, IN_TIME = "order in space", "order in time"
CUTS = {1: (4, 6), 2: (4, 6), 3: (5, 6), 4: (3, 4), 5: (3, 4), 6: (2, 3)}  # of two intervals an axis, by degree
COUPLED_CUTS = CUTS | {4: (4, 5)}  # the rise comes within the tolerance of its order from 4 cuts on only
TRANSIENT_CUTS = {1: (4, 8), 2: (3, 6), 3: (3, 4), 4: (2, 3)}
HEX_CUTS = {1: (3, 6), 2: (3, 5)}
HEX_TRANSIENT = {1: ((2, 4), (4, 8)), 2: ((2, 3), (4, 6))}  # cuts, and steps in time
MEANS = (1, 2, 4)  # degrees: those of twice their order take finer meshes at 3, and drown in rounding from 5 on


def bricks(solution: Manufactured | Heating, *degrees: int) -> Iterator[Row]:
    """This project's bricks on a steady solution, or on a transient, the worst of some instants."""
    for degree in degrees:
        if isinstance(solution, Manufactured):
            kind, cuts = "steady", (COUPLED_CUTS if solution.potential else CUTS)[degree]
            errors = [on_bricks(solution, degree, n) for n in cuts]
        else:
            kind, cuts = "transient", TRANSIENT_CUTS[degree]
            times = np.array([0.1, 0.5, 2.0]) / solution.modes[0][0]
            errors = [on_bricks_over_time(solution, degree, n, times) for n in cuts]
        yield from _rows(f"brick, {kind}, {solution.name}", degree, errors, cuts)


def hexahedra(solution: Manufactured | Heating, *degrees: int) -> Iterator[Row]:
    """scikit-fem's hexahedra, steady, or by the method of order 3 in time, refined in space and time together."""
    for degree in degrees:
        if isinstance(solution, Manufactured):
            kind, cuts = "steady", HEX_CUTS[degree]
            errors = [on_hexahedra(solution, degree, n) for n in cuts]
        else:
            kind, (cuts, steps) = "transient", HEX_TRANSIENT[degree]
            end = 1 / solution.modes[0][0]
            errors = [on_hexahedra_over_time(solution, degree, n, end, m) for n, m in zip(cuts, steps, strict=True)]
        yield from _rows(f"scikit-fem hexahedron, {kind}, {solution.name}", degree, errors, cuts)


def theory(quantity: str, degree: int) -> int:
    """p + 1 in L2, p in H1, 2 p for the power and for means with a smooth weight (Strang and Fix, chapter 3)."""
    return {"L2": degree + 1, "H1": degree}.get(quantity[-2:], 2 * degree)


def _rows(case: str, degree: int, errors: list[Errors], cuts: tuple[int, int]) -> Iterator[Row]:
    coarse, fine = errors
    for quantity in coarse:
        if degree == 3 and quantity.startswith("potential"):
            # Its part of the next order is as large: 4.21 in L2 from 2 to 3 cuts, 4.18 from 6 to 7, and 3.15 in H1.
            continue
        # The weight suits the dual problem of conduction; that of the coupled problem is less smooth with it.
        means = degree in MEANS and not ("power" in coarse and (quantity == "mean" or degree > 2))
        if means or quantity[-2:] in ("L2", "H1"):
            order = observed_order([coarse[quantity], fine[quantity]], cuts[1] / cuts[0])
            named = "weighted mean" if quantity == "mean" else quantity
            yield order_row(FAMILY, f"{case}, degree {degree}", named, theory(quantity, degree), order)


def _mesh(scene: Scene, degree: int, cuts: int) -> Grid:
    """Two unequal intervals along each axis, each cut into some equal ones."""
    breaks = [
        np.append(np.concatenate([np.linspace(a, b, cuts, endpoint=False) for a, b in pairwise(planes)]), planes[-1])
        for planes in PLANES
    ]
    return Grid(tuple(breaks), tuple(np.full(2 * cuts, degree) for _ in range(3)), scene.boxes)


def on_bricks(solution: Manufactured, degree: int, cuts: int) -> Errors:
    heat = assemble(boxes(solution.scene, _mesh(solution.scene, degree, cuts)))
    load = _load(heat, solution)
    if solution.potential is None:
        return _distances(heat, heat.whole(heat.solve_steady(load[: heat.free])), solution)
    rise, errors = _coupled(heat, solution, load)
    return _distances(heat, heat.whole(rise), solution) | errors


def on_bricks_over_time(heating: Heating, degree: int, cuts: int, times: np.ndarray) -> Errors:
    """The largest errors over some times (s) of a transient, by the product's own Krylov fields and time stepping.

    The fields and the tolerance are such that the error is that of space.
    """
    heat = assemble(boxes(heating.scene, _mesh(heating.scene, degree, cuts)))
    heat = replace(heat, loads=_load(heat, heating.at(np.inf))[None])
    base = Base.of_steady(steady.coupled(heat, None, True, 0.0, 1e-13))
    fields = Krylov(base, transient.shift(1 / heating.modes[0][0], float(times[0]))).fields(12)
    answer = transient.march(base, base.project(fields), float(times[-1]), 1e-12)
    errors = [_distances(heat, rise, heating.at(t)) for t, rise in zip(times, answer.rises(times), strict=True)]
    return {name: max(each[name] for each in errors) for name in errors[0]}


def _load(heat: HeatProblem, solution: Manufactured) -> np.ndarray:
    """(all nodes,): the manufactured loads and those of the scene itself (W)."""
    domain = heat.domain
    on: Any = domain.space.on(np.arange(len(domain.body)))
    load = on.load(solution.f(*on.points))
    for boundary, entering in solution.loads():
        face: Any = domain.faces(boundary)
        load += face.load(entering(*face.points))
    return heat.loads[0] + heat.take(load)


def _distances(heat: HeatProblem, rise: np.ndarray, solution: Manufactured) -> Errors:
    on, u = _finely(heat), heat.field(rise)
    return solution.distances(on.weights, on.points, on.value(u), on.gradient(u))


def _finely(heat: HeatProblem) -> Any:
    space: Any = heat.domain.space
    return space.on(np.arange(len(heat.domain.body)), FINER)


def _coupled(heat: HeatProblem, solution: Manufactured, load: np.ndarray) -> tuple[np.ndarray, Errors]:
    """The rise with its Joule heat, by Picard's iteration, and the errors of the potential and the power."""
    conductor = conductors.find(heat)
    assert conductor is not None
    assert solution.potential is not None
    fixed = _on_electrodes(conductor, solution)
    rise, electric = np.zeros(heat.free), conductor.solve(np.zeros(heat.free), fixed)
    for _ in range(PICARD):
        electric = conductor.solve(rise, fixed, electric.potential)
        old, rise = rise, heat.solve_steady((load + conductor.joule_load(electric.density, rise))[: heat.free])
        if np.abs(rise - old).max() <= SETTLED * np.abs(rise).max():
            break
    on, phi = _finely(heat), electric.potential
    exact = solution.potential
    errors = manufactured.norms("potential", on.weights, on.value(phi), on.gradient(phi), exact, on.points)
    return rise, errors | {"power": abs(float(phi @ electric.reaction) - solution.power())}


def _on_electrodes(conductor: Conductor, solution: Manufactured) -> np.ndarray:
    """(functions,): the manufactured potential, which varies along the electrodes, projected on their functions; the
    scene's electrodes have one voltage each."""
    assert solution.potential is not None
    domain = conductor.heat.domain
    faces: list[Any] = [domain.faces(b) for b in domain.scene.boundaries if b.kind == "voltage"]
    on = np.flatnonzero(np.any([face.functions for face in faces], axis=0))
    mass = sum(face.mass() for face in faces)
    load = sum(face.load(solution.potential(*face.points)) for face in faces)
    potential = np.zeros(domain.space.size)
    potential[on] = spsolve(mass[on][:, on].tocsc(), load[on])
    return potential


def on_hexahedra(solution: Manufactured, degree: int, cuts: int) -> Errors:
    """The errors of a steady solution on hexahedra, as `on_bricks` has them but for those of the potential."""
    full = second_path(solution, degree, cuts)
    rise = reference.steady(full)
    errors = _on_quadrature(full, rise, solution)
    if solution.potential is None:
        return errors
    _, phi, entering = full.heated(rise)
    return errors | {"power": abs(float(phi @ entering) - solution.power())}


def on_hexahedra_over_time(heating: Heating, degree: int, cuts: int, end: float, steps: int) -> Errors:
    """The errors at an end time (s) after some steps of the diagonally implicit method of order 3."""
    full = second_path(heating.at(np.inf), degree, cuts)
    errors = _on_quadrature(full, marched(full, end, steps), heating.at(end))
    del errors["mean"]  # it converges faster in space than the method does in time
    return errors


def marched(full: FullOrder, end: float, steps: int) -> np.ndarray:
    """(nodes,): the rise at an end time (s) after equal steps from rest."""
    return reference.transient(full, np.linspace(0.0, end, steps + 1))[-1][0]


def second_path(solution: Manufactured, degree: int, cuts: int) -> FullOrder:
    """The second path's matrices of a solution, with the manufactured loads and potential."""
    # It says in a log whenever it copies an array.
    logging.getLogger("skfem").setLevel(logging.ERROR)
    scene = solution.scene if solution.potential is not None else _dead(solution.scene)
    full = reference.assemble(scene, _mesh(scene, degree, cuts))
    volume = Basis(full.basis.mesh, full.basis.elem, intorder=ORDER)
    load = full.load + reference.integral.assemble(volume, density=solution.f(*volume.global_coordinates()))
    for boundary, entering in solution.loads():
        where = np.intersect1d(reference.facets(full.basis.mesh, boundary), full.basis.mesh.boundary_facets())
        face = FacetBasis(full.basis.mesh, full.basis.elem, facets=where, intorder=ORDER)
        load = load + reference.integral.assemble(face, density=entering(*face.global_coordinates()))
    full = replace(full, load=np.asarray(load))
    if solution.potential is not None:
        # The scene's electrodes have one voltage each; the manufactured potential varies along them.
        held = {
            name: (nodes, solution.potential(*full.basis.doflocs[:, nodes])) for name, (nodes, _) in full.held.items()
        }
        vars(full)["held"] = held
    return full


def _dead(scene: Scene) -> Scene:
    """The scene as a conductor without voltage: the second path always solves the electric problem too."""
    solid = tuple(replace(box, material=replace(box.material, resistivity=1.0)) for box in scene.boxes)
    ground = Boundary("ground", "voltage", *manufactured.face(solid[0].lower, solid[-1].upper, 0, 0), 0.0)
    return replace(scene, boxes=solid, boundaries=(*scene.boundaries, ground))


def _on_quadrature(full: FullOrder, nodal: np.ndarray, solution: Manufactured) -> Errors:
    basis = Basis(full.basis.mesh, full.basis.elem, intorder=ORDER)
    field = basis.interpolate(nodal)
    return solution.distances(basis.dx, basis.global_coordinates(), np.asarray(field), field.grad)


def exponential_collocation() -> Iterator[Row]:
    """The collocation of the source between exact exponentials: of order 2 q in non-stiff modes at degree q, like the
    Gauss-Lobatto rule whose points it takes (Hochbruck and Ostermann, Acta Numerica 19, 2010, section 2.2)."""
    rates, end = np.array([0.5, 1.0]), 1.5

    def source(a: np.ndarray) -> np.ndarray:
        return np.exp(0.2 * a.sum(axis=-1, keepdims=True)) * np.ones(2)

    exact = solve_ivp(
        lambda _, a: source(a) - rates * a, (0, end), np.zeros(2), "DOP853", rtol=1e-13, atol=1e-15
    ).y[:, -1]  # fmt: skip
    for degree, steps in ((2, (4, 8)), (3, (2, 4)), (4, (2, 3))):
        off = [float(np.linalg.norm(_fixed_steps(rates, source, end, n, degree) - exact)) for n in steps]
        yield order_row(IN_TIME, f"exponential collocation of degree {degree}", "modal state", 2 * degree,
                        observed_order(off, steps[1] / steps[0]))  # fmt: skip


def _fixed_steps(
    rates: np.ndarray, source: Callable[[np.ndarray], np.ndarray], end: float, steps: int, degree: int
) -> np.ndarray:
    """The final state after equal steps, each a run of the integrator of its own.

    Without any tolerance the integrator divides each run in the same proportions, so the order is that of its steps.
    """
    state = np.zeros(len(rates))
    for _ in range(steps):
        run = integrate(rates, lambda since: lambda times, a: source(a), end / steps, 1e300, 1.0, degree, state)
        state = run(np.array([end / steps]))[0][0]
    return state


def diagonally_implicit(heating: Heating) -> Iterator[Row]:
    """Alexander's method of order 3 of the second path, on the semi-discrete problem of a heater: exact by modes."""
    full, end = second_path(heating.at(np.inf), 1, 1), 0.02
    exact = _exact_linear(full, end)
    off = [float(np.abs(marched(full, end, steps) - exact).max()) for steps in (8, 16)]
    yield order_row(IN_TIME, "SDIRK of order 3 (second path)", "nodal rise, linear", 3, observed_order(off, 2.0))
    coupled = second_path(joule(), 1, 1)
    runs = [marched(coupled, 0.004, steps) for steps in (8, 16, 32)]
    yield _of_three("SDIRK of order 3 (second path)", "nodal rise, resistivity of the temperature", 3, runs)


def _of_three(case: str, quantity: str, theory: int, runs: list[np.ndarray]) -> Row:
    gaps = [float(np.abs(b - a).max()) for a, b in pairwise(runs)]
    return order_row(IN_TIME, case, quantity, theory, observed_order(gaps, 2.0), "from the differences of three runs")


def _exact_linear(full: FullOrder, end: float) -> np.ndarray:
    """The rise (nodes,) at an end time of M u' + K u = load from rest, by the modes of the free nodes."""
    free = full.free
    k, m = (np.asarray(a[free][:, free].todense()) for a in (full.stiffness, full.mass))
    rates, modes = eigh(k, m)
    rise = np.zeros(len(full.load))
    rise[free] = modes @ (-np.expm1(-rates * end) / rates * (modes.T @ full.load[free]))
    return rise


def runge_kutta() -> Iterator[Row]:
    """The paper's Runge-Kutta method of order 4 for eq 20, against eq 20's closed solution."""
    from reduced1d.device.paper import runge_kutta_step
    from reduced1d.lumped import rise_at
    from reduced1d.sink import lump

    model = lump(Sink(voltage=5.0))
    end = 2 * model.time_constant
    exact = rise_at(model, np.array([end]))[0]
    errors = []
    for steps in (40, 80):
        rise = 0.0
        for _ in range(steps):
            rise = runge_kutta_step(rise, 0.0, model.conductance, model.voltage**2 / model.resistance,
                                    model.coefficient, end / steps / model.capacity)  # fmt: skip
        errors.append(abs(rise - exact))
    yield order_row(
        IN_TIME, "Runge-Kutta of order 4 (1D sink, eq 20)", "equivalent rise", 4, observed_order(errors, 2.0)
    )


def layer() -> Iterator[Row]:
    """The paper's Crank-Nicolson scheme for a layer (Appendix B) in space and time at once, on its slowest sine."""
    slab = Slab(10e-6, 1e-7, 0.15, 1.4e6)
    end = 0.5 * slab.thickness**2 / (np.pi**2 * slab.diffusivity)
    errors = []
    for nx in (20, 40):
        dt, x = end / nx, np.linspace(0, np.pi, nx + 1)[1:-1]
        inner, none = np.sin(x), np.zeros((2,))
        for _ in range(nx):
            inner = crank_nicolson(inner, mesh_ratio(slab, nx, dt), none, none)
        errors.append(float(np.abs(inner - np.sin(x) * np.exp(-0.5)).max()))
    yield order_row(IN_TIME, "Crank-Nicolson in a layer (1D device)", "temperature, step and spacing halved", 2,
                    observed_order(errors, 2.0))  # fmt: skip


def partitioned() -> Iterator[Row]:
    """The paper's whole scheme: each film sees a heat flow that is late by a step, so it is of order 1 in time."""
    from reduced1d.device.paper import PaperScheme, solve_paper
    from scenes.device import Device, External

    device = replace(Device(), end_time=2e-3, external=External(293.0, 293.0, 1.0))
    runs = [solve_paper(device, PaperScheme(dt)).trace("sink_K") for dt in (0.5e-6, 0.25e-6, 0.125e-6)]
    yield _of_three("the paper's partitioned scheme (1D device)", "sink temperature", 1, runs)


def device_estimate() -> Iterator[Row]:
    """The accurate device scheme has no fixed order; its error estimate is checked against a much finer run."""
    from reduced1d.device.accurate import solve_accurate
    from scenes.device import Device

    device = replace(Device(), end_time=0.02)
    rough, fine = (solve_accurate(replace(device, accuracy=a)) for a in (1e-4, 1e-8))
    for quantity, name in (("sink_K", "sink temperature"), ("sensor_K", "sensor temperature")):
        off = float(np.abs(rough.trace(quantity) - fine.trace(quantity)).max())
        yield Row(IN_TIME, "collocation in powers of sqrt(t) (1D device)", f"{name}, distance from a finer run", "K",
                  0.0, off, rough.errors[quantity] + fine.errors[quantity])  # fmt: skip
