"""The parametric sink: the paper's beam on two anchored pads (section 2 of the paper, Figures 4 to 7), or a row of
beams with islands between.

Spans and islands are numbered from the lower outer end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any, ClassVar, Literal, NamedTuple

from scenes.checks import SINK_TOLERANCES, SLOPE_TOLERANCES
from scenes.model import ROUNDING, Boundary, Box, Contact, Declared, Material, Point, Probe, Scene

SILICON = Material("silicon", 130.0, 2330.0, 712.0, 6e-5, 5e-4, 293.0, valid_to=1687.0)
UNCERTAINTIES = {
    "materials.silicon.thermal_conductivity": 0.088,
    "materials.silicon.density": 0.0012,
    "materials.silicon.specific_heat": 0.0004,
    "materials.silicon.resistivity": 0.048,
    "materials.silicon.temperature_coefficient": 0.058,
    "materials.oxide.thermal_conductivity": 0.023,
    "materials.oxide.density": 0.013,
    "materials.oxide.specific_heat": 0.0004,
}
"""Typical relative standard uncertainties; `sink.toml` has their sources."""
OXIDE = Material("oxide", 1.38, 2200.0, 703.0, valid_to=1858.0)
SUBSTRATE = replace(SILICON, name="substrate", resistivity=None)
"""Silicon again; the oxide keeps the current from it."""


class Drive(NamedTuple):
    """A voltage (V) behind a ``series`` resistance (ohm), or a given current (A) where the resistance is infinite."""

    value: float
    series: float = 0.0

    @property
    def unit(self) -> str:
        return "A" if self.series == math.inf else "V"

    @property
    def called(self) -> str:
        return "current_A" if self.series == math.inf else "voltage_V"

    def through(self, resistance: Any) -> Any:
        """Return the current (A) through a resistance (ohm), a number or an array."""
        return self.value + 0 * resistance if self.series == math.inf else self.value / (resistance + self.series)


@dataclass(frozen=True)
class Sink(Declared):
    """Sizes in m, voltage in V, current in A, resistance in ohm, temperature in K, convection in W/(m2 K), time in s.

    The beam lies along y from 0 to ``length``, its underside in z = 0, symmetric about x = 0. ``oxide_offset`` is the
    paper's u_o, from the pad's edge at the beam to the oxide; ``None`` centres the oxide under its pad. More than one
    of ``spans`` follow each other along y, each of that ``length`` and at about that ``voltage``; between two of them
    the beam goes on over an island of oxide, with ``None`` as long as the anchors' oxide. The oxide stands on room
    temperature where ``substrate_thickness`` is ``None``, else on a plate of that thickness, centred under it, which
    is at room temperature at its bottom and adiabatic elsewhere. ``contact_resistance`` (m2 K/W) belongs to a contact
    at both faces of each block of oxide, ``None`` where these are perfect. ``gap_gas_conductivity`` in W/(m K) is of a
    gas that fills the gap, as high as the oxide, under beam and bare pads. With an ``emissivity`` all bare faces of
    beam and pads radiate to room temperature. ``uncertainties`` are relative and standard, by key, typical for the
    materials.
    """

    kind: ClassVar[str] = "sink"
    default_tolerances: ClassVar[Mapping[str, float]] = SINK_TOLERANCES | SLOPE_TOLERANCES
    length: float = 1000e-6
    width: float = 100e-6
    thickness: float = 2e-6
    spans: int = 1
    island_length: float | None = None
    pad_length: float = 150e-6
    pad_width: float = 150e-6
    oxide_length: float = 50e-6
    oxide_width: float = 50e-6
    oxide_thickness: float = 2e-6
    oxide_offset: float | None = None
    contact_resistance: float | None = None
    silicon: Material = SILICON
    oxide: Material = OXIDE
    substrate_thickness: float | None = None
    substrate_length: float = 3e-3
    substrate_width: float = 3e-3
    substrate: Material = SUBSTRATE
    voltage: float = 1.0
    current: float | None = None
    series_resistance: float = 0.0
    electrodes: Literal["beam-end", "pad-edge"] = "beam-end"
    room_temperature: float = 293.0
    convection_coefficient: float = 0.0
    gap_gas_conductivity: float = 0.0
    emissivity: float = 0.0
    end_time: float = 0.02
    accuracy: float = 1e-3
    name: str = "sink"
    uncertainties: dict[str, float] = field(default_factory=lambda: dict(UNCERTAINTIES), hash=False)

    @property
    def anchor_distance(self) -> float:
        """The paper's u_o (m): from the beam's end to the oxide."""
        return (self.pad_length - self.oxide_length) / 2 if self.oxide_offset is None else self.oxide_offset

    @property
    def island(self) -> float:
        """The length of an island (m), along the beam."""
        return self.oxide_length if self.island_length is None else self.island_length

    @property
    def island_width(self) -> float:
        """The width of an island (m): the anchors' oxide's, or the beam's if that is narrower."""
        return min(self.oxide_width, self.width)

    @property
    def gap_coefficient(self) -> float:
        """The film coefficient of the gas in the gap (W/(m2 K))."""
        return self.gap_gas_conductivity / self.oxide_thickness

    @property
    def materials(self) -> tuple[Material, ...]:
        """The materials of the 3D model."""
        materials = self.silicon, self.oxide
        return materials if self.substrate_thickness is None else (*materials, self.substrate)

    @property
    def plain(self) -> Sink:
        """The sink of the paper's equations: no radiation, laws of the temperature at their values at room temperature,
        a resistivity as its tangent there (eq 7)."""
        if not self.emissivity and not any(m.follows for m in self.materials):
            return self
        room, materials = self.room_temperature, (self.silicon, self.oxide, self.substrate)
        silicon, oxide, substrate = (m.touching(room) for m in materials)
        return replace(self, silicon=silicon, oxide=oxide, substrate=substrate, emissivity=0.0)

    @property
    def drive(self) -> Drive:
        """The given current, or the voltage behind its series resistance."""
        if self.current is not None:
            return Drive(self.current, math.inf)
        return Drive(self.spans * self.voltage, self.series_resistance)

    @property
    def absent(self) -> tuple[str, ...]:
        """The prefixes of keys without effect: of a missing substrate, and of the voltage beside a current."""
        none = () if self.substrate_thickness is not None else ("substrate.", "materials.substrate.")
        return none if self.current is None else (*none, "drive.voltage")

    @property
    def contacts(self) -> float:
        """The resistance (m2 K/W) of the contacts above and below a block of oxide together."""
        return 2 * (self.contact_resistance or 0.0)

    @property
    def row_length(self) -> float:
        """From pad to pad (m)."""
        return start(self, self.spans) + self.length

    @property
    def cross_section(self) -> float:
        """The paper's A_c (m2)."""
        return self.width * self.thickness

    def scene(self) -> Scene:
        """Return the sink as boxes, conditions and probes."""
        boxes = _boxes(self)
        return Scene(
            self.name, boxes, _boundaries(self, boxes), _probes(self, boxes), self.room_temperature,
            self.end_time, self.accuracy, contacts=_contacts(self, boxes),
        )  # fmt: skip


def different(count: int) -> int:
    """Return the number of different spans of a row, whose halves mirror each other."""
    return (count + 1) // 2


def start(sink: Sink, number: int) -> float:
    """Return the lower end of a span along y (m)."""
    return (number - 1) * (sink.length + sink.island)


def _boxes(sink: Sink) -> tuple[Box, ...]:
    """The beam, cut at the islands, and the islands; then pads and oxide, and the substrate where there is one."""
    w, t, depth, oxide = sink.width / 2, sink.thickness, sink.oxide_thickness, sink.island_width / 2
    boxes: list[Box] = []
    for number in range(1, sink.spans + 1):
        a, b, c = start(sink, number), start(sink, number) + sink.length, start(sink, number + 1)
        name = "beam" if sink.spans == 1 else f"span-{number}"
        boxes.append(Box(name, sink.silicon, (-w, a, 0.0), (w, b, t)))
        if number < sink.spans:
            boxes += [
                Box(f"bridge-{number}", sink.silicon, (-w, b, 0.0), (w, c, t)),
                Box(f"island-{number}", sink.oxide, (-oxide, b, -depth), (oxide, c, 0.0)),
            ]
    end, oxide = sink.row_length, sink.oxide_width / 2
    pad, near, far = sink.pad_width / 2, sink.anchor_distance, sink.anchor_distance + sink.oxide_length
    below, gas = list[Box](), list[Box]()
    if sink.substrate_thickness is not None:
        k = sink.gap_gas_conductivity
        if k:
            # A film: it conducts a millionth along the gap, and holds a millionth of the heat of air.
            filling = Material("gas", (1e-6 * k, 1e-6 * k, k), 1e-3, 1.0)
            gas = [
                Box(f"gas-{name}", filling, (a[0], a[1], -depth), (b[0], b[1], 0.0)) for name, a, b in over_gap(sink)
            ]
        half, middle, bottom = sink.substrate_width / 2, end / 2, -depth - sink.substrate_thickness
        y = sink.substrate_length / 2
        below = [Box("substrate", sink.substrate, (-half, middle - y, bottom), (half, middle + y, -depth))]
    return (
        *boxes,
        Box("pad-0", sink.silicon, (-pad, -sink.pad_length, 0.0), (pad, 0.0, t)),
        Box("pad-1", sink.silicon, (-pad, end, 0.0), (pad, end + sink.pad_length, t)),
        Box("oxide-0", sink.oxide, (-oxide, -far, -depth), (oxide, -near, 0.0)),
        Box("oxide-1", sink.oxide, (-oxide, end + near, -depth), (oxide, end + far, 0.0)),
        *gas,
        *below,
    )


def _contacts(sink: Sink, boxes: tuple[Box, ...]) -> tuple[Contact, ...]:
    """The contacts of the blocks of oxide with the silicon above and, where there is one, the substrate below."""
    if not sink.contact_resistance:
        return ()
    contacts = []
    for block in (b.name for b in boxes if b.name.startswith(("oxide", "island"))):
        kind, number = block.split("-")
        above = f"{'pad' if kind == 'oxide' else 'bridge'}-{number}"
        contacts.append(Contact(f"{above} on {block}", (above, block), sink.contact_resistance))
        if sink.substrate_thickness is not None:
            contacts.append(Contact(f"{block} on substrate", (block, "substrate"), sink.contact_resistance))
    return tuple(contacts)


def over_gap(sink: Sink) -> list[tuple[str, tuple[float, float], tuple[float, float]]]:
    """The rectangles (x, y; m) of one span's underside that are over the gap, each with a name: the beam, and around
    its oxide each pad's sides, its part near the beam and its far part."""
    pad, oxide, end = sink.pad_width / 2, sink.oxide_width / 2, sink.pad_length
    near, far = sink.anchor_distance, sink.anchor_distance + sink.oxide_length
    around = [
        ("near", (-pad, 0.0), (pad, near)), ("far", (-pad, far), (pad, end)),
        ("left", (-pad, near), (-oxide, far)), ("right", (oxide, near), (pad, far)),
    ]  # fmt: skip
    bare = [each for each in around if min(b - a for a, b in zip(*each[1:], strict=True)) > ROUNDING * end]
    rectangles = [("beam", (-sink.width / 2, 0.0), (sink.width / 2, sink.length))]
    for name, (a, y), (b, z) in bare:
        rectangles += [
            (f"pad-0-{name}", (a, -z), (b, -y)), (f"pad-1-{name}", (a, sink.length + y), (b, sink.length + z)),
        ]  # fmt: skip
    return rectangles


def _boundaries(sink: Sink, boxes: tuple[Box, ...]) -> tuple[Boundary, ...]:
    room, pads = sink.room_temperature, [b for b in boxes if b.name.startswith("pad")]
    beams = [b for b in boxes if b.name.startswith(("beam", "span", "bridge"))]
    # Heat leaves by the undersides of all oxide, or of the plate below.
    lowest = {f"substrate-{b.name.removeprefix('oxide-')}": b for b in boxes if b.name.startswith(("oxide", "island"))}
    if sink.substrate_thickness is not None:
        lowest = {"substrate": boxes[-1]}
    boundaries = [Boundary(name, "temperature", *face(b, 2, 0), room) for name, b in lowest.items()]
    if (resistance := sink.contact_resistance) and sink.substrate_thickness is None:
        film: dict[str, Any] = {"kind": "convection", "value": 1 / resistance, "contact_resistance": resistance}
        boundaries = [replace(b, ambient=room, **film) for b in boundaries]
    value, series = sink.drive
    ends = beams if sink.electrodes == "beam-end" else pads
    boundaries += [
        Boundary("electrode-0", "voltage", *face(ends[0], 1, 0), value, series_resistance=series),
        Boundary("electrode-1", "voltage", *face(ends[-1], 1, 1), 0.0),
    ]
    if sink.convection_coefficient:
        boundaries += [
            Boundary(f"air-{b.name}", "convection", *face(b, 2, 1), sink.convection_coefficient, room)
            for b in (*beams, *pads)
        ]
    if sink.gap_gas_conductivity and sink.substrate_thickness is None:
        boundaries += [
            Boundary(f"substrate-gas-{name}", "convection", (*a, 0.0), (*b, 0.0), sink.gap_coefficient, room)
            for name, a, b in over_gap(sink)
        ]
    # The faces of beam and pads radiate where they are bare, but for electrodes at the pads' edges.
    leads = {("pad-0", 1, 0), ("pad-1", 1, 1)} if sink.electrodes == "pad-edge" else set()
    for part, axis, side in product([*beams, *pads], range(3), range(2)) if sink.emissivity else ():
        if (part.name, axis, side) not in leads:
            name = f"radiation-{part.name}-{'xyz'[axis]}{side}"
            boundaries.append(Boundary(name, "radiation", *face(part, axis, side), sink.emissivity, room))
    return tuple(boundaries)


def _probes(sink: Sink, boxes: tuple[Box, ...]) -> tuple[Probe, ...]:
    """The probes: "end", and of one span "peak" and "mean"; of several, for each span of the lower half, "span<k>_"
    with "peak", the largest along the middle of its underside, "middle" and "mean"."""
    spans = [b for b in boxes if b.name.startswith(("beam", "span"))]
    end = Probe("end", *face(spans[0], 1, 0))
    if sink.spans == 1:
        centre = (0.0, sink.length / 2, sink.thickness / 2)
        gas: tuple[Probe, ...] = ()
        if sink.gap_gas_conductivity and sink.substrate_thickness is not None:
            # The gas between takes heat from the beam.
            foot = (-sink.width / 2, 0.0, -sink.oxide_thickness), (sink.width / 2, sink.length, -sink.oxide_thickness)
            gas = Probe("underside", *face(spans[0], 2, 0)), Probe("below", *foot)
        return Probe("peak", centre, centre), end, Probe("mean", spans[0].lower, spans[0].upper), *gas
    probes = [end]
    for number, span in enumerate(spans[: different(sink.spans)], start=1):
        a, b = (0.0, span.lower[1], 0.0), (0.0, span.upper[1], 0.0)
        middle = (0.0, (a[1] + b[1]) / 2, sink.thickness / 2)
        probes += [
            Probe(f"span{number}_peak", a, b, reduce="max"),
            Probe(f"span{number}_middle", middle, middle),
            Probe(f"span{number}_mean", span.lower, span.upper),
        ]
    return tuple(probes)


def face(box: Box, axis: int, side: int) -> tuple[Point, Point]:
    """The flat box of a box's lower (0) or upper (1) face along an axis."""
    lower, upper = list(box.lower), list(box.upper)
    lower[axis] = upper[axis] = (box.lower, box.upper)[side][axis]
    return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])


class SinkQuantity(NamedTuple):
    """A quantity: the keys of its ``steady`` value in summary.json and of its ``trace`` in traces.csv (or ""), its SI
    unit, and its name in text."""

    steady: str
    trace: str
    unit: str
    called: str


OF_A_SINK = {
    "peak": SinkQuantity("peak_rise_K", "peak_K", "K", "peak rise"),
    "end": SinkQuantity("end_rise_K", "end_K", "K", "end rise"),
    "mean": SinkQuantity("mean_rise_K", "mean_K", "K", "mean rise"),
    "current": SinkQuantity("current_A", "current_A", "A", "current"),
    "power": SinkQuantity("power_W", "power_W", "W", "power"),
    "heat_out": SinkQuantity("heat_out_W", "", "W", "heat to the substrate"),
    "anchor_resistance": SinkQuantity("anchor_resistance_K_per_W", "", "K/W", "anchor resistance"),
}
"""The quantities of a sink, by a user's word."""
