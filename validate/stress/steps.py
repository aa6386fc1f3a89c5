"""Time steps from 1 ns to 1 s: which integrators ring, how far each is off, and where explicit coupling grows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import diags_array, eye_array

from fem3d.problems.assembly import assemble
from fem3d.problems.heat import HeatProblem
from fem3d.solution.exponential import integrate
from fem3d.spaces.domain import boxes
from meshes import grading, symmetry
from reduced1d.device.lumped import Lumped, Slab, lump
from reduced1d.device.paper import PaperScheme, layer_step, stability_limit
from scenes.device import Device
from scenes.sink import Sink
from validate.stress.report import Row
from validate.verify.methods import march

GROUP, COUPLING = "time steps", "explicit coupling"
STEPS = (1e-9, 1e-7, 1e-5, 1e-3, 1e-1, 1.0)  # s
# numbers of steps after which results are compared; an L-stable method may overshoot in the first few
COUNTS = (10, 11, 40, 41)
RINGING = 1e-3  # of the final rise

SIMULATED = 3000
AGREES = 0.02  # of the predicted limit; the bisection and the count of steps leave that much

Method = Callable[[np.ndarray, float], np.ndarray]  # decay rates, a step to the part of a constant load's rise missing


def rows() -> Iterator[Row]:
    """Each integrator on the sink's heat equation after a step of constant heat, in its modes: with z = rate * step,
    what is missing of the final rise is multiplied by the method's R(-z) in each step, exactly e^(-z)."""
    problem = _sink()
    rates, modes, final = _modal(problem)
    modes = modes[problem.unit[: problem.free] > 0]  # whose amplitudes are temperatures of vertices
    factors: dict[str, tuple[Method, bool]] = {
        "exponential collocation": (_exponential, True),
        "SDIRK of order 3 (second path)": (_sdirk, True),
        "backward Euler": (lambda r, h: 1 / (1 + r * h), False),
        "Crank-Nicolson": (lambda r, h: (1 - r * h / 2) / (1 + r * h / 2), False),
        "explicit Euler": (lambda r, h: 1 - r * h, False),
    }
    largest = float((modes @ final).max())
    for name, (method, ours) in factors.items():
        worst, at = 0.0, STEPS[0]
        for step in STEPS:
            with np.errstate(over="ignore", invalid="ignore"):
                factor = method(rates, step)
                # A constant load from rest heats every place monotonically: nothing ever exceeds the final rise.
                missing = np.column_stack([factor**n * final for n in COUNTS])
                over = -float((modes @ missing).min()) / largest
            if not over <= worst:
                worst, at = (over if np.isfinite(over) else np.inf), step
        said = f"largest with steps of {at:g} s" if worst > 1e-9 else "at no step"
        yield Row(GROUP, name, f"steps of 1 ns to 1 s, decay rates {rates[0]:.1e} to {rates[-1]:.1e} 1/s",
                  f"overshoot over the final rise after {COUNTS[0]} steps", worst, RINGING, ours, said)  # fmt: skip
    limit = 2 / float(rates[-1])

    def unstable(step: float) -> bool:
        with np.errstate(over="ignore"):
            return bool(np.abs((1 - rates * step) ** 20000).max() > 1.0)

    found_limit = _limit(limit / 2.7, limit * 3.1, unstable, 1e-5)
    yield Row(GROUP, "explicit Euler", "bisection of its largest stable step",
              f"found / predicted 2/rate = {limit:.2e} s, less 1", abs(found_limit / limit - 1), 1e-3)  # fmt: skip


def _sink() -> HeatProblem:
    part = symmetry.reduce(Sink().scene())
    grid = grading.first_grid(part.scene, 1e-2, grading.features(part.scene))
    lower = [np.maximum(d - 1, 2) for d in grid.degrees]
    return assemble(boxes(part.scene, grid.with_axes(grid.breaks, lower)))


def _modal(problem: HeatProblem) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Decay rates (1/s), modes (nodes, modes) and the amplitudes of the final rise under heat in the beam (K)."""
    k, m = (np.asarray(a.todense()) for a in (problem.inner_stiffness, problem.inner_mass))
    rates, modes = eigh(k, m)
    domain = problem.domain
    beam = np.flatnonzero(np.array(domain.names)[domain.body] == "beam")
    load = problem.take(domain.space.on(beam).load(np.ones((len(beam), 1))))
    return rates, modes, modes.T @ load[: problem.free] / rates


def _exponential(rates: np.ndarray, step: float) -> np.ndarray:
    """The product's own integrator over one step, from rest under a source that brings every mode to 1."""
    run = integrate(rates, lambda since: lambda times, a: np.tile(rates, (len(a), 1)), step, 1e300, 1.0)
    return np.asarray(1.0 - run(np.array([step]))[0][0])


def _sdirk(rates: np.ndarray, step: float) -> np.ndarray:
    """The second path's own method, as `_exponential`."""
    problem = SimpleNamespace(
        size=len(rates), mass=eye_array(len(rates)), stiffness=diags_array(rates), load=lambda _: rates,
        factors=lambda mass, stiffness: lambda load: load / (mass + stiffness * rates),
    )  # fmt: skip
    *_, (rise, _) = march(problem, np.array([0.0, step]), 3, 1e-14)
    return np.asarray(1.0 - rise)


def _limit(low: float, high: float, grows: Callable[[float], bool], tolerance: float) -> float:
    """The step (s) beyond which something grows, by bisection."""
    while high - low > tolerance * high:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low


def coupling(quick: bool) -> Iterator[Row]:
    """The paper's explicit coupling, its largest stable step predicted and found by simulation, in devices with sensors
    of several thicknesses: films that see the layers' heat flows a step late."""
    for thickness in (200e-9,) if quick else (50e-9, 200e-9, 1e-6):
        device = replace(Device(), sensor_thickness=thickness)
        predicted = stability_limit(device)
        simulated = partial(grows, lump(device), scheme=PaperScheme())
        largest = _limit(predicted / 2.7, predicted * 3.1, simulated, 1e-3)
        yield Row(COUPLING, "the paper's partitioned scheme", f"sensor of {thickness * 1e9:g} nm",
                  f"largest stable step found / predicted {predicted * 1e6:.3g} us, less 1",
                  abs(largest / predicted - 1), AGREES, said=f"found {largest * 1e6:.3g} us by simulation")  # fmt: skip


def grows(lumped: Lumped, dt: float, scheme: PaperScheme) -> bool:
    """Whether films and layers, each stepped by itself as the paper does, get ever farther from rest."""
    sink, sensor, inner = 1.0, -1.0, [np.zeros(scheme.nx - 1), np.zeros(scheme.nx - 1)]
    layers = [layer_step(slab, scheme.nx, scheme.nt, dt) for slab in (lumped.insulator, lumped.polymer)]
    size = []
    for _ in range(SIMULATED):
        for i, faces in enumerate((np.array([sink, sensor]), np.array([sensor, 0.0]))):
            inner[i] = layers[i][0] @ inner[i] + layers[i][1] @ faces
        into = _flow(lumped.insulator, scheme, sink - inner[0][0])
        through = _flow(lumped.insulator, scheme, inner[0][-1] - sensor)
        out = _flow(lumped.polymer, scheme, sensor - inner[1][0])
        loss = lumped.conductance / lumped.capacity[0] * dt
        # Runge-Kutta of order 4 for a linear loss and a constant flow.
        decay, mean = 1 - loss + loss**2 / 2 - loss**3 / 6 + loss**4 / 24, 1 - loss / 2 + loss**2 / 6 - loss**3 / 24
        sink = sink * decay - mean * dt / lumped.capacity[0] * into
        sensor = sensor + dt / lumped.capacity[1] * (through - out)
        size.append(abs(sensor) + abs(sink))
        if size[-1] > 1e6:
            return True
    return size[-1] > 2 * max(size[: SIMULATED // 10])


def _flow(slab: Slab, scheme: PaperScheme, drop: float) -> float:
    return slab.conductivity * slab.area * scheme.nx / slab.thickness * drop
