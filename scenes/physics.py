"""The physics that a scene asks for: heat, current, their time derivatives; and refusals of unsolvable combinations.

A scene without electrodes needs no resistivity, and a steady state no heat capacity.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from itertools import pairwise

from scenes import laws
from scenes.errors import SceneError, quoted
from scenes.model import ELECTRIC, AnyScene, Boundary, GroupBoundary, Material, Schedule, Value, bends, is_zero, values

HEAT_KEYS = "thermal_conductivity", "density", "specific_heat"


def materials(scene: AnyScene) -> tuple[Material, ...]:
    """Return the material of every part."""
    return tuple(part.material for part in getattr(scene, scene.parts))


def heat_sources(scene: AnyScene) -> tuple[tuple[str, Value], ...]:
    """Return every heat source (W/m3) with the name of its part in messages."""
    table, items = scene.heated
    return tuple((f"{table} {quoted(item.name)}", item.heat_source) for item in getattr(scene, items))


def driving(scene: AnyScene) -> tuple[Value, ...]:
    """Return every value that drives the scene and may vary in time."""
    return (
        *(value for b in scene.boundaries for value in (b.value, b.ambient)),
        *(value for _, value in heat_sources(scene)),
    )


def coldest(scene: AnyScene) -> float:
    """Return a lower bound (K) of every temperature: the coldest initial, given or ambient one; 0 with a heat sink."""
    supplied = [value for _, value in heat_sources(scene)]
    supplied += [b.value for b in scene.boundaries if b.kind == "heat_flux"]
    if any(v < 0 for value in supplied for v in values(value)):
        return 0.0
    given = [b.value for b in scene.boundaries if b.kind == "temperature"]
    given += [b.ambient for b in scene.boundaries if b.kind in ("convection", "radiation")]
    return min([scene.initial_temperature, *(v for value in given for v in values(value))])


def frozen(scene: AnyScene) -> list[str]:
    """Remark on a temperature that looks like degrees Celsius without the unit."""
    lowest = coldest(scene)
    if not 0 < lowest < 77.0:  # liquid nitrogen boils there, and hardly any device is built for less
        return []
    return [
        f"a temperature of {lowest:g} K is given, which is {lowest - 273.15:.4g} degC: a number without a unit is in "
        f'kelvin, for degrees Celsius write "{lowest:g} degC"'
    ]


def jumps(given: Iterable[Value]) -> tuple[float, ...]:
    """Return the times (s) after the start at which any of the values jumps."""
    varying = (value.times for value in given if isinstance(value, Schedule))
    return tuple(sorted({t for times in varying for t, then in pairwise(times) if t == then and t > 0}))


def electric(scene: AnyScene) -> bool:
    """Whether the scene has an electrode, or a probe of an electric quantity."""
    return any(b.kind == "voltage" for b in scene.boundaries) or any(p.quantity in ELECTRIC for p in scene.probes)


def heat(scene: AnyScene) -> bool:
    """Whether temperatures are solved.

    They are where the scene has a thermal condition, a heat source or a thermal probe, and in a transient with
    electrodes where a resistivity follows the temperature. An electric steady state without any of these has its
    resistivities at the initial temperature.
    """
    return (
        any(b.kind != "voltage" for b in scene.boundaries)
        or any(not is_zero(value) for _, value in heat_sources(scene))
        or any(p.quantity in ("temperature", "heat_flow") for p in scene.probes)
        or (not scene.steady and electric(scene) and any(m.warms for m in materials(scene)))
        or not electric(scene)
    )


def needed(scene: AnyScene) -> tuple[str, ...]:
    """Return the thermal properties that the scene needs of every material."""
    if not heat(scene):
        return ()
    return HEAT_KEYS[:1] if scene.steady else HEAT_KEYS


def may_follow(scene: AnyScene, over_time: bool) -> tuple[str, ...]:
    """Return the properties that matter here and may have a law of the temperature."""
    if not heat(scene):
        return ()
    capacities = ("specific_heat",) if over_time else ()
    return "thermal_conductivity", *capacities, *(("resistivity",) if electric(scene) else ())


def follows(scene: AnyScene, over_time: bool) -> bool:
    """Whether a property that matters here has a law of the temperature."""
    keys = set(may_follow(scene, over_time))
    return any(keys & set(m.follows) for m in materials(scene))


def nonlinear(scene: AnyScene, over_time: bool) -> str:
    """Return the reason why the heat problem is nonlinear, in words; "" for a linear one."""
    why = ["a property follows the temperature"] * follows(scene, over_time)
    if heat(scene) and (kinds := {b.kind for b in scene.boundaries if bends(b)}):
        why += ["faces radiate"] * ("radiation" in kinds) + ["a film follows the temperature"] * ("convection" in kinds)
    return " and ".join(why)


def refuse_faces(scene: AnyScene, what: str) -> None:
    """Refuse a boundary with a nonlinear heat flux, for ``what`` takes linear fluxes alone."""
    for b in filter(bends, scene.boundaries):
        has = "radiates" if b.kind == "radiation" else "has a convection.coefficient that follows the temperature"
        instead = "give a convection with one coefficient, or ask for the 3D steady state alone"
        raise SceneError(f"boundary {quoted(b.name)} {has}, and {what} takes numbers alone: {instead}")


def refuse_following(scene: AnyScene, over_time: bool) -> None:
    """Refuse an ambient that varies in time beside a coefficient that follows the temperature."""
    for b in filter(bends, scene.boundaries if over_time else ()):
        if isinstance(b.ambient, Schedule):
            both = "its coefficient follows the temperature and its ambient varies in time"
            raise SceneError(f"boundary {quoted(b.name)}: {both}: give one ambient, or one coefficient")


def refuse_laws(used: Iterable[Material], what: str, takes: str = "one number", instead: str = "") -> None:
    """Refuse properties that differ along axes, and laws where ``what`` takes "one number"; ``instead`` is advice."""
    for material in used:
        for key, given in material.given():
            varies = laws.varies(given) and takes == "one number"
            if varies or isinstance(given, tuple):
                kind = "follows the temperature" if varies else "differs along x, y and z"
                name = f"{key} of {quoted(material.name)}"
                raise SceneError(f"{name} {kind}, and {what} takes {takes}: give one there{instead}")


def refuse_terminals(scene: AnyScene, what: str) -> None:
    """Refuse a given current and a series resistance, for ``what`` takes voltages alone."""
    for b in scene.boundaries:
        if b.series_resistance:
            has = "gives a current" if b.key == "current" else "has a series_resistance"
            instead = "give its voltage without, or ask for the 3D solution alone"
            raise SceneError(f"boundary {quoted(b.name)} {has}, and {what} takes voltages alone: {instead}")


def check_law(label: str, material: Material) -> None:
    """Refuse a law of the resistivity beside a temperature coefficient, and laws along x, y and z that are not
    proportional at every temperature."""
    if laws.varies(material.resistivity) and material.temperature_coefficient:
        coefficient = f"{label}.temperature_coefficient = {material.temperature_coefficient:g} 1/K"
        raise SceneError(
            f"{label}.resistivity is a law of the temperature, and {coefficient} another: give one of them"
        )
    along_x, *others = laws.along(material.resistivity or 1.0)
    if any(laws.ratio(along_x, other) is None for other in others):
        unlike = "follows the temperature along x, y and z in different ways"
        raise SceneError(f"{label}.resistivity {unlike}: give laws that are each some times the first")


def potential_of(boundary: Boundary | GroupBoundary) -> Value | str:
    """Identify an electrode's potential without current: its voltage, or else its name."""
    return boundary.name if boundary.series_resistance == math.inf else boundary.value


def share_terminals(
    voltages: dict[int, set[Value | str]], touched: Iterable[tuple[Boundary | GroupBoundary, Collection[int]]]
) -> None:
    """Put the name of an electrode behind a resistance in the place of its voltage among the ``voltages`` of parts of
    conductors (by `potential_of`), where it shares them with a part that carries current. Only the solution gives its
    potential; no current passes where a part touches no other electrode."""
    touched = list(touched)
    for b, parts in touched:
        if b.series_resistance and any(len(voltages[part]) > 1 for part in parts):
            for part in parts:
                alone = all(part not in others for other, others in touched if other is not b)
                voltages[part] = {b.name} if alone else {*voltages[part], b.name}


def is_exit(boundary: Boundary | GroupBoundary) -> bool:
    """Whether heat can leave by a boundary in a steady state."""
    film = boundary.kind in ("convection", "radiation") and boundary.value != 0
    return boundary.kind == "temperature" or film


def heats(boundary: Boundary | GroupBoundary, initial: float) -> bool:
    """Whether a boundary changes a solid that is at an initial temperature (K)."""
    if boundary.kind == "heat_flux":
        return not is_zero(boundary.value)
    outside = boundary.value if boundary.kind == "temperature" else boundary.ambient
    return is_exit(boundary) and any(value != initial for value in values(outside))


def check_resistivity(material: Material, label: str, where: str, temperature: float) -> None:
    """Refuse a resistivity that is not positive at a temperature (K); ``where`` names the temperature's key."""
    if laws.varies(material.resistivity) or material.resistivity is None:
        return
    factor = 1 + material.temperature_coefficient * (temperature - material.reference_temperature)
    if factor <= 0:
        raise SceneError(
            f"{label}.temperature_coefficient = {material.temperature_coefficient:g} 1/K makes the resistivity "
            f"{factor:.3g} times its reference value at {where}: give values that keep 1 + coefficient * "
            "(temperature - reference temperature) above 0"
        )
