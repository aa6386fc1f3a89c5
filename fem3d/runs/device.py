"""The whole sensor in 3D under its controllers, and its derivatives.

A structure is solved once, for its few states; runs of its controllers have estimated errors. Its steady state under
the controllers is differentiated by differences on moved meshes. For each key the structure is solved on its cells,
moved, for its steady fields: they hold every steady state.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fem3d.adaptivity import brick_mesh
from fem3d.adaptivity.estimator import tail
from fem3d.adaptivity.nested import discretize
from fem3d.adaptivity.responses import TIME_SHARE
from fem3d.runs.device_model import DEPARTS, Structure, projected, structures
from fem3d.runs.differences import STEP, Difference, Table, Values
from fem3d.runs.motion import move
from fem3d.solution.steady import TIGHT
from fem3d.spaces import edge_exponents
from fem3d.spaces.domain import box_domain
from meshes import grading, symmetry
from scenes.device import Device, External
from scenes.errors import NumericsError, SceneError
from scenes.model import ROUNDING
from scenes.result import Estimate
from scenes.varied import neighbour, numbers
from statespace import stability
from statespace.device_model import Modal, Whole
from statespace.march import March, march
from statespace.result import QUANTITIES, TOP, DeviceResult, Run, Runs, Steady, device_result, with_others
from statespace.stability import Shielding, Stability, assess, gains, plant, steady

_NAMES = (*QUANTITIES, TOP)
FOLLOWED = tuple(q for q in QUANTITIES if not q.endswith("_K"))
"""Quantities to differentiate; the controllers hold the temperatures."""


@dataclass(frozen=True, eq=False)
class Model:
    """The few states of a device's structure, for any controllers and outer temperatures.

    Attributes
    ----------
    fine, low, fewer : the model, the model of the next lower space, and the fine model with fewer fields
    by_fewer : by quantity the relative error of fewer fields and nodes
    nodes : unknown heats between samples
    edges : the error of steady values over the distance of the lower space, which singular edges decide
    structure : the problems of the solved part
    """

    device: Device
    fine: Modal
    low: Modal
    fewer: Modal
    by_fewer: dict[str, float]
    nodes: int
    edges: float
    details: dict[str, Any]
    structure: Structure

    def steady(self, device: Device, external: float | None = None) -> Steady:
        """The steady state at an outer temperature (K; by default the final one)."""
        return steady(self.fine, device, external)

    def stability(self, device: Device, external: float | None = None) -> Stability:
        """The stability of the loop about that state, with the largest stable gains."""
        return assess(plant(self.fine, device, external), device)

    def steady_errors(self, device: Device, external: float | None = None) -> dict[str, float]:
        """The estimated errors of a steady state's quantities, in their units."""
        fine, low = (asdict(steady(modal, device, external)) for modal in (self.fine, self.low))
        return {q: self.edges * abs(fine[q] - low[q]) + ROUNDING * abs(fine[q]) for q in QUANTITIES}

    @cached_property
    def shielding(self) -> tuple[Shielding, dict[str, float]]:
        """The effect of the substrate's temperature on both steady powers, with errors (W/K). The error sums twice the
        error by the lower space (differences of small values need not halve with a degree), the change by fewer fields,
        and the possible contribution of omitted local departures."""
        models, device = (self.fine, self.low, self.fewer), self.device
        fine, low, fewer = (asdict(stability.shielding(modal, device)) for modal in models)
        power = max(self.steady(device).sink_power_W, self.steady(device).sensor_power_W)
        rounding, part = 1e3 * np.finfo(float).eps * power, DEPARTS * device.accuracy_3d
        errors = {
            name: 2 * self.edges * abs(value - low[name]) + abs(value - fewer[name]) + part * abs(value) + rounding
            for name, value in fine.items()
        }
        return Shielding(**fine), errors

    def solve(
        self, device: Device, meter: tuple[float, float] = (0.0, 0.0), start: Literal["cold", "settled"] = "cold"
    ) -> tuple[DeviceResult, DeviceResult]:
        """Traces of a device of this structure under its controllers, as of `reduced1d.device.schemes` in 1D; and the
        traces of the lower space.

        Raises ArithmeticError where the powers between two samples do not converge.
        """
        tolerance = TIME_SHARE * device.accuracy_3d * device.set_rise  # K, of the powers between samples
        runs = [march(modal, self.nodes, device, tolerance, meter, start) for modal in (self.fine, self.low)]
        scale, apart = _scales(device, runs[0]), runs[0].distance(runs[1])
        rest = {q: self.by_fewer[q] * scale[q] for q in _NAMES}
        errors, parts = {q: apart[q] + rest[q] for q in _NAMES}, {"space": apart, "states and time": rest}
        before, after = self.steady(device, device.external.initial_temperature), self.steady(device)
        result, lower = (
            device_result(
                "few states of 3D", device, run.traces, errors, before=before, after=after, error_parts=parts,
                details=self.details | {"stopped": runs[0].stopped},
            )
            for run in runs
        )  # fmt: skip
        return result, lower


def reduce_structure(device: Device, accuracy: float, say: Callable[[str], None] = lambda _: None) -> Model:
    """The few states of a device's structure, on a mesh and in as many fields as an accuracy takes: of temperatures
    relative to the set rise, of steady powers relative to themselves, from the second sample on.

    The distances from the model of the next lower space, with two generations of fields fewer and with two nodes fewer
    in time are the errors. Each level refines whatever has more than its share of the accuracy: the mesh, by a degree
    more everywhere, three quarters, fields and nodes an eighth each.

    Raises NumericsError where the accuracy is not reached within twelve levels.
    """
    scene = replace(device.scene(), accuracy=accuracy)
    part = symmetry.reduce(scene)
    features = edge_exponents.features(part.scene)
    # The distance from the lower space is some four times the error that it bounds.
    rough = brick_mesh.first_grid(part.scene, min(accuracy, brick_mesh.COARSEST) / 4, features)
    grid = grading.with_diffusion_layers(rough, part.scene, device.control.sample_time)
    # A degree more across the layers, through which heat comes and goes in a few samples.
    grid = grid.with_axes(grid.breaks, [*grid.degrees[:2], grading.raised(grid).degrees[2]])
    problems = discretize(box_domain(part.scene, grid), accuracy)
    judged = ("sink_K", "sensor_K", "sink_power_W", "sensor_power_W")
    generations, nodes = 10, 4
    for number in range(1, 13):
        say(f"level {number}: {problems.heat.size} unknowns")
        nested = structures(device, problems, part.copies)
        (fine, fewer), (low, _) = (projected(structure, generations, accuracy) for structure in nested[:2])
        distances = _judged(device, fine, low, fewer, nodes)
        space, fields, between = (max(distances[name][q] for q in judged) for name in ("low", "fewer", "nodes"))
        if space + fields + between <= accuracy:
            details = {
                "unknowns": problems.heat.size, "states": fine.count, "responses": fine.responses,
                "levels": number, "symmetry": part.part, "nodes": nodes, "degrees": [d.tolist() for d in grid.degrees],
            }  # fmt: skip
            missed = {q: distances["fewer"][q] + distances["nodes"][q] for q in _NAMES}
            degree = np.array([min(int(d.min()) for d in grid.degrees[:2])])
            edges = max(float(tail(degree, np.array([4 * features.sharpest]))[0]), 1.0)
            return Model(device, fine, low, fewer, missed, nodes, edges, details, nested[0])
        if space > 0.75 * accuracy:
            grid = grading.raised(grid)
            problems = discretize(box_domain(part.scene, grid), accuracy)
        generations += 2 * (fields > accuracy / 8)
        nodes += 2 * (between > accuracy / 8)
    raise NumericsError(f"an accuracy of {accuracy:g} isn't reached in this device")


def _short(device: Device) -> Device:
    """The same device with its outer step soon after the start, and the end soon after that, to judge meshes by."""
    external = device.external
    final = external.final_temperature
    if final == external.initial_temperature:
        final -= device.set_rise
    step = 60 * device.control.sample_time
    return replace(device, external=External(external.initial_temperature, final, step), end_time=2 * step)


def _judged(device: Device, fine: Modal, low: Modal, fewer: Modal, nodes: int) -> dict[str, dict[str, float]]:
    """Distances from the models of the lower space, with fewer fields and with fewer nodes, for each quantity relative
    to its scale, in a short run and in the steady state."""
    short, state, tolerance = _short(device), steady(fine, device), TIME_SHARE * device.accuracy_3d * device.set_rise
    run = march(fine, nodes, short, tolerance)
    others = {"low": (low, nodes), "fewer": (fewer, nodes), "nodes": (fine, nodes - 2)}
    scale, distances = _scales(device, run), dict[str, dict[str, float]]()
    for name, (modal, count) in others.items():
        apart = run.distance(march(modal, count, short, tolerance))
        distances[name] = {q: apart[q] / scale[q] for q in _NAMES}
        for q in ("sink_power_W", "sensor_power_W"):
            size = max(abs(getattr(state, q)), 1e-3 * scale[q])
            off = abs(getattr(state, q) - getattr(steady(modal, device), q)) / size
            distances[name][q] = max(distances[name][q], off)
    return distances


def _scales(device: Device, run: March) -> dict[str, float]:
    """The scale of each quantity's error: the set temperature's rise, or its largest value."""
    largest = dict(zip(_NAMES, np.maximum(np.abs(run.traces).max(axis=0), 1e-300).tolist(), strict=True))
    return largest | dict.fromkeys(("sink_K", "sensor_K"), device.set_rise)


@dataclass(frozen=True)
class Solved:
    """The few states of a device's structure, and their runs."""

    model: Model
    runs: Runs

    @property
    def exported(self) -> Whole:
        """The model to export, and its closed loop."""
        model, base = self.model, self.runs.base
        others = [(model.low, model.edges), (model.fewer, 1.0)]
        return Whole(
            f"{base.device.name}, in 3D", base.device, model.fine, base.result, model.steady_errors(base.device), others
        )


def solve(device: Device, meter: tuple[float, float], slow: bool, steps: bool, say: Callable[[str], None]) -> Solved:
    """Compute the few states of a device's structure and the scene's own run; its loop rounds resistances to the steps
    ``meter`` (ohm). With ``slow`` add the run that is sampled slowly, with ``steps`` the runs of the outer steps.

    Raises ArithmeticError where the numerics fail.
    """
    say("solving in 3D")
    states = reduce_structure(device, device.accuracy_3d, say)

    def simulate(other: Device, start: Literal["cold", "settled"]) -> Run:
        result, lower = states.solve(other, meter, start)
        return Run(other, result, lambda at: plant(states.fine, at).eigenvalue(gains(at)), reference=lower)

    return Solved(states, with_others(device, simulate(device, "cold"), simulate, slow, steps, say))


def of_device(device: Device, model: Model, keys: Sequence[str] | None = None) -> tuple[Table, dict[str, str]]:
    """Return d ln quantity / d ln key of the steady state after the outer step, and why a key has none.

    ``keys`` are the keys to differentiate by, instead of all. Quantities that are zero are left out.
    """
    domain, part, accuracy = model.structure.heat.domain, symmetry.reduce(device.scene()), TIGHT * device.accuracy_3d

    def levels(key: str, step: float) -> tuple[Values, Values]:
        other = neighbour(device, key, step) if key else device
        problems = discretize(move(domain, part, symmetry.reduce(other.scene())), accuracy)
        values = []
        for structure in structures(other, problems, part.copies)[:2]:
            base = structure.base()
            state = steady(structure.modal(base.project(base.fields), base.patterns, accuracy), other)
            values.append(Values({q: float(getattr(state, q)) for q in FOLLOWED}))
        return values[0], values[1]

    base, table, left_out = levels("", 0.0), Table(), dict[str, str]()
    known = {q: Estimate(v, model.steady_errors(device)[q]) for q, v in base[0].steady.items() if v}
    for key in numbers(device):
        if keys is not None and key not in keys:
            continue
        if key.endswith((".density", ".specific_heat")):  # no steady state depends on these
            table[key] = {q: Estimate(0.0, 0.0) for q in known}
            continue
        try:
            found = Difference(base, levels(key, STEP), levels(key, -STEP)[0], model.edges)
        except (SceneError, NumericsError) as error:
            left_out[key] = str(error)
            continue
        table[key] = {q: found.logarithmic(q, e) for q, e in known.items()}
    return table, left_out
