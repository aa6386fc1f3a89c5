"""The value types of a scene, in SI units and without any numerics.

A *scene* is a union of axis-parallel boxes of materials with conditions on flat boxes (one extent zero). A surface
without a condition is adiabatic and electrically insulated; where boxes overlap the later one wins. The z axis points
up, y runs along a beam. A scene on a mesh file names groups of the mesh in place of corners; `meshes.grouped` checks it
against the mesh.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Literal

from scenes import laws
from scenes.laws import Property
from scenes.parameters import Parameters

Point = tuple[float, float, float]
ROUNDING = 1e-9
"""Relative: lengths that differ by less than this part of the extent are equal. Sums of a file's numbers are off by
some 1e-15 of it, and no structure has details a millionth of a micrometre apart."""
UNITS = {"temperature": "K", "potential": "V", "heat_flow": "W", "current": "A", "resistance": "ohm", "power": "W"}
"""The unit of each quantity that a probe may ask for."""
ELECTRIC = {"potential", "current", "resistance", "power"}
FLOWS = {"heat_flow", "current"}
DERIVED = {"resistance", "power"}
"""The quantities of the electric problem; those of a surface; and those that are products or ratios of others."""
OVER_TIME = "_over_time"
"""How ids of checks over time end; those of the steady state are the probes' names."""
SLOPES = "slope"
"""Stands for the checks of how a model follows each key, slope_<key>."""
SLOPE_TOLERANCE = 0.1
"""Tolerance of slopes where the scene gives none, relative to the largest one."""


@dataclass(frozen=True)
class Schedule:
    """A value over time: linear between ``times`` (s, not decreasing), constant before the first and after the last.

    Two equal times make a jump; at that instant the later value holds.
    """

    times: tuple[float, ...]
    values: tuple[float, ...]


Value = float | Schedule


def values(value: Value) -> tuple[float, ...]:
    """Return every given value of a possibly varying one."""
    return value.values if isinstance(value, Schedule) else (value,)


def is_zero(value: Value) -> bool:
    return not any(values(value))


@dataclass(frozen=True)
class Material:
    """A material: conductivity in W/(m K), density in kg/m3, specific heat in J/(kg K), resistivity in ohm m.

    The resistivity is ``resistivity * (1 + temperature_coefficient * (T - reference_temperature))`` (the paper's
    eq 7); ``None`` is an electrical insulator. Above ``valid_to`` (K, ``None`` if unknown) the material softens, melts
    or decomposes. Conductivity, specific heat and resistivity may follow the temperature by a law, and conductivity and
    resistivity may differ along x, y and z (`scenes.laws`). A law of the resistivity replaces the coefficient, and its
    three laws along the axes are proportional. ``electrical_conductivity`` (S/m) is the inverse of the resistivity
    where a file gives the conductivity, else ``None``.
    """

    name: str
    thermal_conductivity: Property
    density: float
    specific_heat: Property
    resistivity: Property | None = None
    temperature_coefficient: float = 0.0
    reference_temperature: float = 293.0
    valid_to: float | None = None
    electrical_conductivity: Property | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        """Drop a conductivity that the resistivity no longer follows from."""
        given = self.electrical_conductivity
        if given is not None and laws.inverse(given) != self.resistivity:
            object.__setattr__(self, "electrical_conductivity", None)

    @property
    def heat_capacity(self) -> float:
        """Volumetric heat capacity, density times specific heat, in J/(m3 K)."""
        return float(self.density * self.specific_heat)

    def given(self) -> Iterator[tuple[str, Property]]:
        """Yield the properties that may follow the temperature, by key."""
        for key in ("thermal_conductivity", "specific_heat", "resistivity"):
            yield key, getattr(self, key)

    @property
    def warms(self) -> bool:
        """Whether the resistivity follows the temperature."""
        return laws.varies(self.resistivity) or bool(self.resistivity and self.temperature_coefficient)

    def law(self, key: str) -> Property | laws.Line:
        """Return the law of a property; for the resistivity along x, a temperature coefficient as a line."""
        given = getattr(self, key)
        if key != "resistivity" or given is None:
            return given
        along_x = laws.along(given)[0]
        if not laws.varies(along_x) and self.temperature_coefficient:
            return laws.Line(along_x, self.temperature_coefficient, self.reference_temperature)
        return along_x

    @property
    def resistivity_ratios(self) -> tuple[float, float, float]:
        """The resistivities along x, y and z divided by the first, the same at every temperature.

        ValueError where they are not proportional (`scenes.physics.check_law` excludes this).
        """
        x, y, z = laws.along(self.resistivity or 1.0)
        ratios = laws.ratio(x, y), laws.ratio(x, z)
        if ratios[0] is None or ratios[1] is None:
            raise ValueError(f"resistivities of {self.name} along x, y and z are not proportional")
        return 1.0, ratios[0], ratios[1]

    @property
    def follows(self) -> tuple[str, ...]:
        """The keys of the properties that have a law."""
        return tuple(key for key, given in self.given() if laws.varies(given))

    def at(self, temperature: float) -> Material:
        """Return the material with the values of its laws at a temperature (K)."""
        coefficient = 0.0 if laws.varies(self.resistivity) else self.temperature_coefficient
        numbers = {key: laws.at(given, temperature) for key, given in self.given()}
        return replace(self, **numbers, temperature_coefficient=coefficient)

    def touching(self, temperature: float) -> Material:
        """Return `at` with the tangent of a resistivity law in its place."""
        law = self.resistivity
        if not isinstance(law, laws.Law):
            return self.at(temperature)
        coefficient = float(law.slope(temperature) / law(temperature))
        return replace(self.at(temperature), temperature_coefficient=coefficient, reference_temperature=temperature)


@dataclass(frozen=True)
class Box:
    """A brick of one material between two corners (m), with an optional volumetric heat source (W/m3)."""

    name: str
    material: Material
    lower: Point
    upper: Point
    heat_source: Value = 0.0


@dataclass(frozen=True)
class Condition:
    """A condition on a place of a scene, of boxes or on a mesh."""

    name: str
    kind: Literal["temperature", "heat_flux", "convection", "radiation", "voltage"]
    contact_resistance: float = field(default=0.0, kw_only=True)
    series_resistance: float = field(default=0.0, kw_only=True)

    @property
    def key(self) -> str:
        """The key in a file: the kind, but "temperature" behind a contact resistance and "current" behind an infinite
        series resistance."""
        if self.series_resistance == math.inf:
            return "current"
        return "temperature" if self.kind == "convection" and self.contact_resistance else self.kind


@dataclass(frozen=True)
class Boundary(Condition):
    """A condition on a flat box (one extent zero), on the surface or, for an electrode, inside the solid.

    ``kind`` and ``value``: "temperature" in K; "heat_flux" in W/m2 into the solid; "convection", the coefficient in
    W/(m2 K) towards ``ambient`` in K, or its law over the face's temperature; "radiation", the emissivity of a face
    that radiates to ``ambient``; "voltage" in V. All but coefficient and emissivity may vary in time. A flux, a
    convection or radiation acts where one side of the flat box is solid and the other is not. An electrode behind a
    ``series_resistance`` (ohm) has one unknown potential; behind an infinite resistance ``value`` is the current (A)
    into the solid. A temperature behind a ``contact_resistance`` (m2 K/W; 0: a perfect contact) is a convection with
    the inverse coefficient. The contact resistance of a voltage is in ohm m2; all its Joule heat enters the face.
    """

    lower: Point
    upper: Point
    value: Value
    ambient: Value = 293.0


def bends(boundary: Boundary | GroupBoundary) -> bool:
    """Whether the heat flux of a boundary is nonlinear in the face's temperature."""
    return boundary.kind == "radiation" or (boundary.kind == "convection" and isinstance(boundary.value, laws.Law))


@dataclass(frozen=True)
class Contact:
    """A contact at all faces where two boxes touch, or volume groups of a mesh, ``between`` which the temperature jumps
    by the heat flux times the ``thermal_resistance`` (m2 K/W) and the potential by the current density times the
    ``electrical_resistance`` (ohm m2); 0 is perfect. The Joule heat of the latter enters both faces, half each."""

    name: str
    between: tuple[str, str]
    thermal_resistance: float = 0.0
    electrical_resistance: float = 0.0

    @property
    def perfect(self) -> bool:
        """Whether nothing jumps there."""
        return not (self.thermal_resistance or self.electrical_resistance)


Quantity = Literal["temperature", "potential", "heat_flow", "current", "resistance", "power"]


@dataclass(frozen=True)
class Probe:
    """A reading over the box between two corners: a point, a line, a flat box or a volume.

    "temperature" (K) and "potential" (V): the mean, largest or smallest value. "heat_flow" (W) and "current" (A): the
    flow through a flat box, positive into the solid on the surface, along the positive axis inside. "resistance" (ohm):
    the difference of potential of the electrode on a flat box to the other electrode of its conductor, divided by the
    current that enters. "power" (W): the Joule heat in a volume, with the heat that contacts pass into it. Temperature
    and potential are read in the named ``boxes`` alone: one box decides the side of a contact, several are the parts of
    a volume.
    """

    name: str
    lower: Point
    upper: Point
    quantity: Quantity = "temperature"
    reduce: Literal["mean", "max", "min"] = "mean"
    boxes: tuple[str, ...] = ()


@dataclass(frozen=True)
class OwnModel:
    """A 1D or lumped model that a scene names.

    ``file`` is relative to ``folder``; ``parameters`` are SI numbers, or texts: quantities with units or keys of the
    scene; ``outputs`` are the names of the model by the probes.
    """

    file: str = ""
    parameters: dict[str, float | str] = field(default_factory=dict, hash=False)
    outputs: dict[str, str] = field(default_factory=dict, hash=False)
    folder: str = ""


@dataclass(frozen=True)
class Declared:
    """Any scene: the ``tolerances`` of checks by their ids, the checks that are expected to differ (``None`` without a
    declaration), and the ``parameters`` of its file."""

    default_tolerances: ClassVar[Mapping[str, float]]
    tolerances: dict[str, float] = field(default_factory=dict, hash=False, kw_only=True)
    expected_to_differ: tuple[str, ...] | None = field(default=None, kw_only=True)
    parameters: Parameters | None = field(default=None, compare=False, repr=False, kw_only=True)

    def tolerance(self, check: str) -> float:
        """The relative tolerance of a check: the declared one, or else its default (KeyError for an unknown id)."""
        return self.tolerances.get(check, self.default_tolerances[check])


@dataclass(frozen=True)
class FreeScene(Declared):
    """A scene of boxes or on a mesh: its ``contacts``, its 1D ``model``, and the ``memory`` (bytes) that limits a run;
    None stands for the free memory."""

    kind: ClassVar[str] = "free"
    default_tolerances: ClassVar[Mapping[str, float]] = defaultdict(lambda: 0.05, {SLOPES: SLOPE_TOLERANCE})
    parts: ClassVar[str]
    """The attribute with the parts, each of one material."""
    heated: ClassVar[tuple[str, str]]
    """The table of parts with heat sources in a file, and their attribute."""
    contacts: tuple[Contact, ...] = field(default=(), kw_only=True)
    model: OwnModel | None = field(default=None, kw_only=True)
    memory: float | None = field(default=None, kw_only=True)


@dataclass(frozen=True)
class Scene(FreeScene):
    """A 3D scene: boxes, conditions, probes, the uniform initial temperature (K) and accuracy (-).

    ``steady`` selects the steady state alone, else the transient up to ``end_time`` (s) is solved and reported at
    ``output_times`` (s). ``mesh`` is "" where the run chooses bricks or tetrahedra.
    """

    parts: ClassVar[str] = "boxes"
    heated: ClassVar[tuple[str, str]] = ("box", "boxes")
    name: str
    boxes: tuple[Box, ...]
    boundaries: tuple[Boundary, ...]
    probes: tuple[Probe, ...]
    initial_temperature: float = 293.0
    end_time: float = 0.02
    accuracy: float = 1e-3
    steady: bool = False
    output_times: tuple[float, ...] = ()
    mesh: Literal["", "bricks", "tetrahedra"] = ""

    def means(self) -> tuple[Probe, ...]:
        """Return a probe of the mean temperature of every box."""
        return tuple(Probe(f"mean {box.name}", box.lower, box.upper) for box in self.boxes)

    def contact(self, first: int, second: int) -> Contact | None:
        """Return the imperfect contact between two boxes, by their numbers, or None."""
        return self._contacts.get(frozenset((self.boxes[first].name, self.boxes[second].name)))

    @cached_property
    def _contacts(self) -> dict[frozenset[str], Contact]:
        return {frozenset(c.between): c for c in self.contacts if not c.perfect}


@dataclass(frozen=True)
class Body:
    """The volume groups of one material."""

    material: Material
    groups: tuple[str, ...]


@dataclass(frozen=True)
class Source:
    """A heat source (W/m3) in every cell of a volume group; sources that overlap add up."""

    name: str
    group: str
    heat_source: Value


@dataclass(frozen=True)
class GroupBoundary(Condition):
    """A condition on a surface group: ``kind``, ``value``, ``ambient`` and ``contact_resistance`` as of `Boundary`."""

    group: str
    value: Value
    ambient: Value = 293.0


@dataclass(frozen=True)
class GroupProbe:
    """A reading at a point (m), over a group, or over volume ``groups``; the other two are ``None`` or empty.

    "temperature" (K) and "potential" (V): the mean, largest or smallest value over a volume or a surface group.
    "heat_flow" (W) and "current" (A): the flow into the solid through the conditions on a surface group, or, through a
    group inside the solid, along its faces' normals. "resistance" (ohm) and "power" (W): as for a `Probe`, of the
    surface group of an electrode and of a volume group. A temperature or a potential is read in the cells of the volume
    group ``side``, if it is named, which decides the side of a contact.
    """

    name: str
    at: Point | None = None
    group: str | None = None
    quantity: Quantity = "temperature"
    reduce: Literal["mean", "max", "min"] = "mean"
    side: str = ""
    groups: tuple[str, ...] = ()


@dataclass(frozen=True)
class MeshScene(FreeScene):
    """A scene on a mesh: ``file`` as the scene gives it, relative to ``folder``, in units of ``unit`` (m)."""

    parts: ClassVar[str] = "bodies"
    heated: ClassVar[tuple[str, str]] = ("source", "sources")
    name: str
    file: str
    unit: float
    bodies: tuple[Body, ...]
    sources: tuple[Source, ...]
    boundaries: tuple[GroupBoundary, ...]
    probes: tuple[GroupProbe, ...]
    initial_temperature: float = 293.0
    end_time: float = 0.02
    accuracy: float = 1e-3
    steady: bool = False
    output_times: tuple[float, ...] = ()
    folder: str = ""

    def means(self) -> tuple[GroupProbe, ...]:
        """Return a probe of the mean temperature of every volume group."""
        groups = dict.fromkeys(group for body in self.bodies for group in body.groups)
        return tuple(GroupProbe(f"mean {name}", group=name) for name in groups)

    @property
    def path(self) -> Path:
        return Path(self.folder) / self.file


AnyScene = Scene | MeshScene
AnyBoundary = Boundary | GroupBoundary
AnyProbe = Probe | GroupProbe
"""A scene of boxes, or one on a mesh."""
