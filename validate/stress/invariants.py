"""What must hold for every scene, whatever its shape: each invariant gives how far it is violated, over what its
estimated errors allow (at most 1 where it holds)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from fem3d.runs.scene import solve
from scenes.model import Boundary, Box, Material, Point, Probe, Scene, Value
from scenes.result import Result
from validate.stress.random_scenes import AT_PLUS, ROOM, Drawn

ROUNDING = 1e-7  # part of the largest value of a kind that solves of badly conditioned scenes may be off by
BALANCE = 1e-6  # part of all heat that passes which may be missing in the balance
# the balance of a transient may miss this factor times the accuracy, as it is no quantity that is controlled
OVER_TIME = 10.0


def energy(drawn: Drawn, result: Result) -> float:
    """What enters by the boundaries, the current and the sources adds up to nothing; over time, as the run itself says.

    All current leaves at "minus": an electrode inside has no probe.
    """
    if result.traces is not None:
        return float(result.details["energy_imbalance"]) / (OVER_TIME * drawn.scene.accuracy)
    scene, error = drawn.scene, 0.0
    volts = {b.name: float(b.value) for b in scene.boundaries if b.kind == "voltage"}  # type: ignore[arg-type]
    if AT_PLUS in result.steady:
        volts["plus"] = result.steady[AT_PLUS].value
        error += abs(result.steady[AT_PLUS].error * result.steady["into minus"].value)
    heats = [
        float(box.heat_source) * float(np.prod(np.subtract(box.upper, box.lower)))  # type: ignore[arg-type]
        for box in scene.boxes
    ]
    for b in scene.boundaries:
        if b.name != "plus":
            factor = volts["minus"] - volts["plus"] if b.kind == "voltage" else 1.0
            heats.append(factor * result.steady[f"into {b.name}"].value)
            error += abs(factor) * result.steady[f"into {b.name}"].error
    return abs(sum(heats)) / (error + BALANCE * sum(map(abs, heats)))


def never_colder(_: Drawn, result: Result) -> float:
    """No reported temperature is below that of the surroundings while the scene is heated."""
    means = [mean for name, mean in result.steady.items() if name.startswith("mean")]
    return max(max(ROOM - mean.value, 0.0) / (mean.error + 1e-12 * ROOM) for mean in means)


def undershoot(_: Drawn, result: Result) -> float:
    """The whole field falls below the surroundings by no more than its own estimated error, a part of the largest
    rise: beside a steep decay polynomials swing."""
    field, off = result.details["fields"].steady, result.details.get("field_error", np.inf)
    return float(max(ROOM - field.min(), 0.0) / (off * np.ptp(field) + 1e-12 * ROOM))


def ordered(_: Drawn, result: Result) -> float:
    """Means lie between the coldest and the hottest place."""
    field = result.details["fields"].steady
    worst = 0.0
    for name, mean in result.steady.items():
        if name.startswith("mean"):
            beyond = max(field.min() - mean.value, mean.value - field.max(), 0.0)
            worst = max(worst, float(beyond / (mean.error + 1e-12 * ROOM)))
    return worst


def mirrored(drawn: Drawn, result: Result) -> float:
    """Mirrored in x, and with the axes turned round, the scene has the same temperatures and flows."""
    far = max(box.upper[0] for box in drawn.scene.boxes)

    def turn(lower: Point, upper: Point) -> tuple[Point, Point]:
        return (lower[1], lower[2], far - upper[0]), (upper[1], upper[2], far - lower[0])

    return _apart(result, solve(changed(drawn.scene, move=turn)), times=drawn.scene.output_times)


def rescaled(drawn: Drawn, result: Result) -> float:
    """A thousand times the lengths with k, h, rho c, sources and fluxes to match has the same temperatures: the answer
    doesn't depend on the unit of length."""
    s = 1e3

    def material(m: Material) -> Material:
        resistivity = None if m.resistivity is None else m.resistivity * s
        return replace(m, thermal_conductivity=m.thermal_conductivity / s, resistivity=resistivity)

    def move(lower: Point, upper: Point) -> tuple[Point, Point]:
        x, y, z, far_x, far_y, far_z = (s * c for c in (*lower, *upper))
        return (x, y, z), (far_x, far_y, far_z)

    factors = {"heat_source": s**-3, "heat_flux": s**-2, "convection": s**-2}
    return _apart(result, solve(changed(drawn.scene, factors, material, move)))


def swapped(drawn: Drawn, result: Result) -> float:
    """With the voltages swapped the currents change their sign, and nothing else does."""
    volts = {b.name: b.value for b in drawn.scene.boundaries if b.kind == "voltage"}
    if not volts:
        return 0.0
    other = {"plus": volts["minus"], "minus": volts["plus"]}
    boundaries = tuple(replace(b, value=other[b.name]) if b.name in other else b for b in drawn.scene.boundaries)
    return _apart(result, solve(replace(drawn.scene, boundaries=boundaries)), currents=-1.0)


def squared(drawn: Drawn, _: Result) -> float:
    """Without temperature coefficients twice the voltage and four times the other heat make four times the rises."""
    scene = changed(drawn.scene, material=lambda m: replace(m, temperature_coefficient=0.0))
    stronger = changed(scene, {"heat_source": 4.0, "voltage": 2.0, "heat_flux": 4.0})
    return _apart(solve(scene), solve(stronger), 4.0, 2.0, 4.0)


def reciprocal(drawn: Drawn, _: Result) -> float:
    """A watt in one box warms another by as much as a watt there warms the one."""
    boxes = drawn.scene.boxes
    first, last = boxes[0], boxes[-1]
    rises = []
    for source, seen in ((first, last), (last, first)):
        volume = float(np.prod(np.subtract(source.upper, source.lower)))
        heated = tuple(replace(b, heat_source=1e-3 / volume if b is source else 0.0) for b in boxes)
        cooled = tuple(b for b in drawn.scene.boundaries if b.kind in ("temperature", "convection"))
        probes = (Probe("seen", seen.lower, seen.upper),)
        rises.append(solve(replace(drawn.scene, boxes=heated, boundaries=cooled, probes=probes)).steady["seen"])
    one, two = rises
    return abs(one.value - two.value) / (one.error + two.error + ROUNDING * abs(one.value - ROOM) + 1e-12 * ROOM)


def honest(drawn: Drawn, result: Result, times: float = 10.0) -> float:
    """Every value is within its estimated error of a solve that is so many times finer."""
    finer = solve(replace(drawn.scene, accuracy=drawn.scene.accuracy / times))
    return _apart(result, finer, times=drawn.scene.output_times)


def tests(drawn: Drawn) -> dict[str, Callable[[Drawn, Result], float]]:
    """Those that a scene is held to: all that need no further solve, and one by turns of those that do."""
    always, in_turn = (ALWAYS, IN_TURN) if drawn.scene.steady else ({"energy closes over time": energy}, OVER_TIMES)
    number = drawn.seed if drawn.scene.steady else drawn.seed // 20
    turn = list(in_turn)[number % len(in_turn)]
    return always | {turn: in_turn[turn]}


ALWAYS: dict[str, Callable[[Drawn, Result], float]] = {
    "energy closes": energy, "nothing reported is colder than its surroundings": never_colder,
    "means within extremes": ordered, "field away from the probes": undershoot,
}  # fmt: skip
IN_TURN: dict[str, Callable[[Drawn, Result], float]] = {
    "mirrored and turned": mirrored, "another unit of length": rescaled, "voltages swapped": swapped,
    "scales with V^2": squared, "reciprocity of power": reciprocal, "errors honoured by a finer solve": honest,
}  # fmt: skip
OVER_TIMES: dict[str, Callable[[Drawn, Result], float]] = {
    "traces honoured by a finer solve": honest, "traces mirrored and turned": mirrored,
}  # fmt: skip


def of_laws(drawn: Drawn) -> dict[str, Callable[[Drawn, Result], float]]:
    """Those that a scene with laws of the temperature is held to. A finer solve takes too long where it is ten times
    finer: three times leave the error of the first all but as it is, and add a third of it to what is allowed."""
    finer = partial(honest, times=3.0)
    if drawn.scene.steady:
        return ALWAYS | {"errors honoured by a finer solve": finer}
    return {"energy closes over time": energy, "traces honoured by a finer solve": finer}


def of_plates(drawn: Drawn) -> dict[str, Callable[[Drawn, Result], float]]:
    """Those that a plate with pads is held to. Tetrahedra don't reach a tenth of 1e-2 within the unknowns that they
    may have: a quarter is asked for."""
    finer = partial(honest, times=4.0)
    if drawn.scene.steady:
        return {
            "nothing reported is colder than its surroundings": never_colder,
            "errors honoured by a finer solve": finer,
        }
    return {"energy closes over time": energy, "traces honoured by a finer solve": finer}


def _apart(
    one: Result, two: Result, rises: float = 1.0, currents: float = 1.0, flows: float = 1.0,
    times: tuple[float, ...] = (),
) -> float:  # fmt: skip
    """The largest distance of two results over their errors, the first's rises, currents and flows being multiplied;
    of traces at some times (s)."""
    factors = {"rise": rises, "current": currents, "flow": flows, "potential": currents}
    largest = dict.fromkeys(factors, 0.0)
    pairs, mine, theirs = [], _numbers(one, times), _numbers(two, times)
    for name, (a, error) in mine.items():
        b, other = theirs[name]
        kind = "rise" if name.startswith("mean") else "current" if name in ("into plus", "into minus") else "flow"
        kind = "potential" if name == AT_PLUS else kind
        off = ROOM if kind == "rise" else 0.0
        largest[kind] = max(largest[kind], float(np.abs(b - off).max()))
        pairs.append((kind, np.abs(factors[kind] * (a - off) - (b - off)).max(), abs(factors[kind]) * error + other))
    return max(
        float(apart / (error + ROUNDING * largest[kind] + 1e-12 * ROOM * (kind == "rise") + 1e-300))
        for kind, apart, error in pairs
    )


def _numbers(result: Result, times: tuple[float, ...]) -> dict[str, tuple[np.ndarray, float]]:
    """The steady values, or those of the traces at some times, with their errors."""
    if result.traces is None:
        return {name: (np.array(e.value), e.error) for name, e in result.steady.items()}
    at, traces = result.traces.time, result.traces
    return {name: (np.interp(times, at, v), traces.errors[name]) for name, v in traces.values.items()}


def changed(
    scene: Scene, factors: Mapping[str, float] = MappingProxyType({}),
    material: Callable[[Material], Material] = lambda m: m,
    move: Callable[[Point, Point], tuple[Point, Point]] = lambda lower, upper: (lower, upper),
) -> Scene:  # fmt: skip
    """The scene with its heat sources and values by kind multiplied, of other materials, at other places."""

    def at(thing: Box | Boundary | Probe) -> dict[str, Any]:
        return dict(zip(("lower", "upper"), move(thing.lower, thing.upper), strict=True))

    def times(value: Value, kind: str) -> Value:
        return float(value) * factors[kind] if kind in factors else value  # type: ignore[arg-type]

    made = {box.material: material(box.material) for box in scene.boxes}
    boxes = tuple(
        replace(b, material=made[b.material], heat_source=times(b.heat_source, "heat_source"), **at(b))
        for b in scene.boxes
    )
    boundaries = tuple(replace(b, value=times(b.value, b.kind), **at(b)) for b in scene.boundaries)
    return replace(scene, boxes=boxes, boundaries=boundaries, probes=tuple(replace(p, **at(p)) for p in scene.probes))
