"""Rows of sinks on one substrate: one of them in 3D with the substrate, and what the others and the sides of the plate
do to it through the substrate alone.

One element in the middle of the same plate is solved once: its rises, its current, and how the heat enters the plate
over its two feet. Elsewhere, and beside others, the plate under its feet is warmer by

    theta_k = sum_j g_kj q_j + (g_kk elsewhere - g_kk in the middle) q_k,

with q the heat of each foot and g the plate's own solution for heat of a footprint (`fem3d.runs.plate`). A foot of an
idle element changes nothing of that but for the heat that its beam takes from one foot to the other, and to the air. A
plate that is warmer by theta all over warms the element by theta, less what the air takes; of a driven one the
resistance then changes, and its power by what drives it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem3d.problems.heat import HeatProblem
from fem3d.runs import sink as alone
from fem3d.runs.plate import Plate
from meshes import symmetry
from scenes.array import SinkArray, driven, places
from scenes.errors import NumericsError
from scenes.plan import Request, Step
from scenes.result import Estimate, Result
from scenes.sink import Sink

POINTS = 16
"""Gauss points across a foot, by which the moments of what enters there are integrated."""
ROUNDS, SETTLED = 50, 1e-13
PITCHES, THICKNESSES = 25, (0.25, 0.5, 1.0, 2.0)
"""How many pitches crosstalk is found at, and on substrates of which parts of the scene's thickness."""
MATRIX = 100
"""Up to so many elements summary.json has the whole matrix of who warms whom."""


@dataclass(frozen=True, eq=False)
class Footprint:
    """How heat enters the plate under a foot: the places, from its middle, of points of equal parts of it along x and
    (towards the beam being positive) along y, m."""

    x: np.ndarray
    y: np.ndarray

    @property
    def middle(self) -> Footprint:
        """All heat at the centroid."""
        return Footprint(np.zeros(1), np.full(1, self.y.mean()))


@dataclass(frozen=True, eq=False)
class Coupling:
    """(elements, elements, 2, 2): the rise (K/W) of each foot of one by heat of each of another's besides what it has
    alone in the middle of the plate; in the order (element k, element j, foot of k, foot of j)."""

    per_heat: np.ndarray


@dataclass(frozen=True, eq=False)
class Warmed:
    """An element on a plate that is warmer all over: its own rise in the middle and on average, ``peak`` and ``mean``
    (K/K), and the heat ``to_air`` (W/K) that it then takes out of the plate. Of its own heat the part ``to_plate``
    enters the plate."""

    peak: float
    mean: float
    to_air: float
    to_plate: float


def solve(sink: SinkArray, progress: Callable[[str], None] | None = None) -> Result:
    """The steady state of every element with estimated errors; ``details`` have the crosstalk, its `fall`
    with the pitch, and the places.

    Raises what `fem3d.runs.sink.solve` raises, and NumericsError where the plate mirrors the array too often.
    """
    say = progress or (lambda _: None)
    element = sink.element
    one = alone.solve(element, Request(transient=False), say)
    say("the substrate between the elements")
    print_ = footprint(one)
    fine, rough = (coupling(sink, foot) for foot in (print_, print_.middle))
    above = warmed(one)
    state, other = (coupled(sink, one, above, by) for by in (fine, rough))
    result = _result(sink, one, above, state, other, fine)
    result.details["fall"] = fall(sink, one, above, print_)
    return result


def warmed(one: Result) -> Warmed:
    """That of an element's solution: where plate and air are a kelvin warmer all is, so that a warmer plate does what a
    warmer air leaves of that."""
    heat: HeatProblem = one.details["answer"].fine.state.heat
    to_plate = one.steady["heat_out_W"].value / one.steady["power_W"].value
    if not heat.films:
        return Warmed(1.0, 1.0, 0.0, to_plate)
    load = -np.sum([film.per_kelvin for film in heat.films.values()], axis=0)
    by_plate = heat.unit - heat.whole(heat.solve_steady(load[: heat.free]))
    domain: Any = heat.domain
    peak, mean = (float(heat.take(domain.mean(domain.probes[name])) @ by_plate) for name in ("peak", "mean"))
    copies = symmetry.reduce(one.details["sink"].scene()).copies
    return Warmed(peak, mean, copies * float(load @ by_plate), to_plate)


def footprint(one: Result) -> Footprint:
    """Of one element's solution: two points a side that have the moments of what enters under a foot, up to the third
    across, where it is symmetric, and the mean and the variance along."""
    state = one.details["answer"].fine.state
    return foot_of(one.details["sink"], state.heat, state.rise)


def foot_of(sink: Sink, heat: HeatProblem, rise: np.ndarray) -> Footprint:
    """The same of a rise (all nodes) of a structure on a sink's feet."""
    space: Any = heat.domain.space
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    part = symmetry.reduce(sink.scene())
    near = sink.anchor_distance
    x = sink.oxide_width / 2 * nodes
    y = -(near + sink.oxide_length / 2) + sink.oxide_length / 2 * nodes
    points = np.array([(a, b, -sink.oxide_thickness / 2) for a in x for b in y])
    inside = part.mirrored(points)
    field = heat.field(rise)
    flux = np.empty(len(points))
    for i, at in enumerate(inside):
        flux[i] = space.sample(field, *(at[d : d + 1] for d in range(3)), slope=2)[0, 0, 0]
    flux = flux.reshape(POINTS, POINTS) * np.outer(weights, weights)
    flux = flux / flux.sum()
    across, along = flux.sum(axis=1), flux.sum(axis=0)
    spread = np.sqrt(across @ x**2)
    local = y - y.mean()
    middle = float(along @ local)
    deviation = np.sqrt(along @ (local - middle) ** 2)
    return Footprint(np.array([-spread, spread]), np.array([middle - deviation, middle + deviation]))


def plate_of(sink: Sink) -> Plate:
    """The plate under an array."""
    return Plate(
        sink.substrate_width, sink.substrate_length, sink.substrate_thickness or 0.0,
        float(sink.substrate.thermal_conductivity),
    )  # fmt: skip


def coupling(sink: Sink, foot: Footprint) -> Coupling:
    """The plate's part of the array."""
    plate = plate_of(sink)
    centre = np.array([plate.x / 2, plate.y / 2])
    at = np.array(places(sink)).reshape(sink.rows, sink.columns, 2)
    columns = centre[0] + at[0, :, 0][:, None] + foot.x
    out = sink.length / 2 + sink.anchor_distance + sink.oxide_length / 2
    feet = np.stack([-out + foot.y, out - foot.y])
    rows = centre[1] + at[:, 0, 1][:, None, None] + feet
    count, n, m = sink.count, sink.columns, sink.rows
    between = plate.between(columns, rows.reshape(2 * m, -1)).reshape(n, n, m, 2, m, 2)
    per_heat = between.transpose(2, 0, 4, 1, 3, 5).reshape(count, count, 2, 2)
    middle = plate.mirrored(centre[0] + foot.x, centre[1] + feet)
    for k in range(count):
        row, column = divmod(k, n)
        per_heat[k, k] = plate.mirrored(columns[column], rows[row]) - middle
    return Coupling(per_heat)


@dataclass(frozen=True, eq=False)
class Coupled:
    """Of each element: how much warmer the plate is under its feet (elements, 2) in K, its power (W), its resistance
    (ohm) and the current (A)."""

    warmer: np.ndarray
    power: np.ndarray
    resistance: np.ndarray
    current: np.ndarray


def coupled(sink: SinkArray, one: Result, above: Warmed, by: Coupling) -> Coupled:
    """The elements on the plate that they warm together."""
    on = np.isin(np.arange(1, sink.count + 1), driven(sink))
    mean, power_alone = one.steady["mean_rise_K"].value, one.steady["power_W"].value
    change = _per_kelvin(sink)
    cold = power_alone / one.steady["current_A"].value ** 2 / (1 + change * mean)
    along = sink.length / (float(sink.silicon.thermal_conductivity) * sink.cross_section)
    from_foot_to_foot = 1 / (along + 2 * one.steady["anchor_resistance_K_per_W"].value)
    warmer, power = np.zeros((sink.count, 2)), power_alone * on
    for _ in range(ROUNDS):
        through = from_foot_to_foot * (warmer[:, 0] - warmer[:, 1])
        taken_alone = above.to_plate * power[:, None] - above.to_air * warmer
        heat = taken_alone / 2 + np.stack([-through, through], axis=1)
        before, warmer = warmer, np.einsum("kjab,jb->ka", by.per_heat, heat)
        # Newton's step for P = I(R)^2 R with R = cold (1 + change (theta + mean P/P_alone)).
        resistance = cold * (1 + change * (above.mean * warmer.mean(axis=1) + mean * power / power_alone))
        current = on * sink.drive.through(resistance)
        by_resistance = current**2 * (1 - 2 * resistance / (resistance + sink.drive.series))
        slope = 1 - by_resistance * cold * change * mean / power_alone
        if (resistance <= 0).any() or (slope <= 0).any() or not np.isfinite(resistance).all():
            raise NumericsError("the array has no steady state at this drive: its elements warm each other too much")
        last, power = power, power - (power - current**2 * resistance) / slope
        settled = np.abs(warmer - before).max() <= SETTLED * np.abs(warmer).max()
        if settled and np.abs(power - last).max() <= SETTLED * power_alone:
            return Coupled(warmer, power, resistance, current)
    raise NumericsError("the elements of the array warm each other without end: no steady state is found")


def _per_kelvin(sink: Sink) -> float:
    """By which part a kelvin above room changes the resistance that the beam has there."""
    a = sink.silicon.temperature_coefficient
    return a / (1 + a * (sink.room_temperature - sink.silicon.reference_temperature))


def _result(sink: SinkArray, one: Result, above: Warmed, state: Coupled, other: Coupled, by: Coupling) -> Result:
    single, a = one.steady, abs(sink.silicon.temperature_coefficient)
    base = {q: single[q].error / abs(single[q].value) for q in ("peak_rise_K", "mean_rise_K", "current_A", "power_W")}
    theta = state.warmer.mean(axis=1)
    part = state.power / single["power_W"].value
    # The pattern of the heat along the beam follows the resistance of each place, which what is left out changes.
    moved = np.abs(1 - part) * a * single["peak_rise_K"].value
    # A given current makes more heat where the plate is warmer than known; of that by a voltage there is less.
    more = np.where(math.isinf(sink.drive.series), a * single["mean_rise_K"].value * part, 0.0)
    through = (base["power_W"] * np.abs(theta) + np.abs(state.warmer - other.warmer).max(axis=1)) * (1 + more)
    by_resistance = state.resistance / (state.resistance + sink.drive.series)
    steady: dict[str, Estimate] = {}
    for k in range(sink.count):
        for q, by_plate in (("peak_rise_K", above.peak), ("mean_rise_K", above.mean)):
            rise = single[q].value * part[k]
            error = (base[q] + moved[k]) * rise + through[k]
            steady[f"sink{k + 1}_{q}"] = Estimate(float(rise + by_plate * theta[k]), float(error))
        change = (moved[k] + a * through[k]) * by_resistance[k]
        error = (base["current_A"] + change) * state.current[k]
        steady[f"sink{k + 1}_current_A"] = Estimate(float(state.current[k]), float(error))
    mean = by.per_heat.mean(axis=(2, 3))
    crosstalk = above.mean * np.linalg.solve(np.eye(sink.count) + above.to_air * mean, mean) * above.to_plate
    crosstalk[np.diag_indices(sink.count)] += single["mean_rise_K"].value / single["power_W"].value
    details = {
        "sink": sink, "one": one, "places": places(sink), "driven": driven(sink), "crosstalk": crosstalk,
        "unknowns": one.details["unknowns"], "warnings": one.details["warnings"], "plan": plan(sink),
        "energy_imbalance": one.details.get("energy_imbalance"),
    }  # fmt: skip
    return Result("fem3d", steady, None, details)


@dataclass(frozen=True, eq=False)
class Fall:
    """Of two elements beside each other on a substrate of a ``thickness`` (m): the ``part`` of the driven one's mean
    rise that the idle one gets, by their ``pitch`` (m)."""

    thickness: float
    pitch: np.ndarray
    part: np.ndarray

    def below(self, tolerance: float) -> float:
        """The pitch (m) from which the part is below a tolerance; infinite where none that fits is."""
        over = np.flatnonzero(self.part > tolerance)
        if not len(over):
            return float(self.pitch[0])
        if (i := int(over[-1])) == len(self.part) - 1:
            return float("inf")
        x, y = np.log(self.pitch[i : i + 2]), np.log(self.part[i : i + 2])
        return float(np.exp(np.interp(-np.log(tolerance), -y, x)))


def fall(sink: SinkArray, one: Result, above: Warmed, foot: Footprint) -> list[Fall]:
    """How crosstalk falls with the pitch, on substrates of a quarter, half, the whole and twice the thickness.

    The two stand about the middle of the plate; the footprint ``foot`` of each is that on the sink's own
    substrate, and so is the rise per watt of the driven ``one``, most of which is its own.
    """
    rise_per_watt = one.steady["mean_rise_K"].value / one.steady["power_W"].value
    least, most = 1.01 * max(sink.pad_width, sink.width), sink.substrate_width - sink.oxide_width
    pitches, falls = np.geomspace(least, max(most, 1.02 * least), PITCHES), []
    for factor in THICKNESSES:
        thickness = factor * (sink.substrate_thickness or 0.0)
        part = []
        for pitch in pitches.tolist():
            pair = replace(sink, columns=2, rows=1, pitch=pitch, driven=None, substrate_thickness=thickness)
            by_heat = float(coupling(pair, foot).per_heat[0, 1].mean())
            part.append(above.mean * above.to_plate * by_heat / rise_per_watt)
        falls.append(Fall(thickness, pitches, np.array(part)))
    return falls


def plan(sink: SinkArray) -> tuple[Step, ...]:
    """What `solve` does."""
    names = f"{sink.count} elements" if sink.rows == 1 else f"{sink.columns} x {sink.rows} elements"
    return (
        *(step for step in alone.plan(sink.element, Request(transient=False)) if step.state == "done"),
        Step(
            names, "done", "one is solved in 3D; the substrate between them by its own solution for heat at a footprint"
        ),
    )
