"""The whole sensor: sink, insulator, sensor film and polymer with their controllers (sections 3 to 5 of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

from scenes.checks import DEVICE_3D_TOLERANCES, DEVICE_TOLERANCES, SLOPE_TOLERANCES
from scenes.model import Boundary, Box, Declared, Material, Probe, Scene, Schedule
from scenes.sink import Sink, face

SUBSTRATE = "substrate"
"""How the names of faces on the substrate, or of its bottom, begin."""

GOLD = Material("gold", 318.0, 19320.0, 129.0, 2.23e-8, 3.768e-3, 293.0, valid_to=1337.0)
PDMS = Material("pdms", 0.15, 970.0, 1460.0, valid_to=473.0)


@dataclass(frozen=True)
class Control:
    """The two sampled controllers of eq 21: sample time in s, gains in V, the set temperature in K.

    Sample k happens at ``k * sample_time``: each resistance is measured, its voltage is raised by ``gain`` times the
    normalised error and held until the next sample. ``allow_negative_voltage`` takes eq 21 literally; otherwise a
    voltage stops at zero. ``ground_resistance`` (ohm) belongs to the lead to ground that both currents share, so that
    it is in both measured resistances.
    """

    sample_time: float = 1e-4
    sink_gain: float = 1.0
    sensor_gain: float = 0.05
    set_temperature: float = 310.5
    allow_negative_voltage: bool = False
    ground_resistance: float = 0.0


@dataclass(frozen=True)
class External:
    """The temperature of the polymer's outer face in K: initial until ``step_time`` (s), final from then on."""

    initial_temperature: float = 293.0
    final_temperature: float = 273.0
    step_time: float = 0.25


@dataclass(frozen=True)
class Device(Declared):
    """A sink and the layers on it, from below: insulator, sensor film, polymer; all as long and wide as the beam.

    Thicknesses in m, ``end_time`` in s. ``accuracy`` is the largest numerical error of a temperature, as a fraction
    of the set temperature's rise above room temperature, in 1D, and ``accuracy_3d`` in 3D, of steady powers too. The
    sink's own voltage, electrodes, end time, accuracy and checks are not used.
    """

    kind: ClassVar[str] = "device"
    default_tolerances: ClassVar[Mapping[str, float]] = DEVICE_TOLERANCES | DEVICE_3D_TOLERANCES | SLOPE_TOLERANCES
    sink: Sink = field(default_factory=Sink)
    sensor_thickness: float = 0.2e-6
    insulator_thickness: float = 10e-6
    polymer_thickness: float = 100e-6
    gold: Material = GOLD
    pdms: Material = PDMS
    control: Control = field(default_factory=Control)
    external: External = field(default_factory=External)
    end_time: float = 0.5
    accuracy: float = 5e-6
    accuracy_3d: float = 1e-3
    name: str = "device"

    @property
    def contact_area(self) -> float:
        """The paper's A (m2): the face that sink, layers and sensor share."""
        return self.sink.length * self.sink.width

    @property
    def set_rise(self) -> float:
        """The set temperature above room temperature, in K."""
        return self.control.set_temperature - self.sink.room_temperature

    def scene(self) -> Scene:
        """The device without its controllers as boxes, conditions and probes: 1 V across the sink from the start on,
        across the sensor from the first sample after it on, and the outer temperature's step.

        The voltages are +0.5 and -0.5 V, so that the middle is a plane of symmetry of both films.
        """
        sink, half = self.sink, self.sink.width / 2
        base, boxes, height = sink.scene(), [], sink.thickness
        for name, material, thickness in (
            ("insulator", self.pdms, self.insulator_thickness),
            ("gold", self.gold, self.sensor_thickness),
            ("polymer", self.pdms, self.polymer_thickness),
        ):
            boxes.append(Box(name, material, (-half, 0.0, height), (half, sink.length, height + thickness)))
            height += thickness
        beam, gold, polymer = base.boxes[0], boxes[1], boxes[2]
        # The ground under the structure is an input of its own, at room temperature throughout.
        below: Any = Schedule((0.0,), (sink.room_temperature,))
        given = {"temperature": "value", "convection": "ambient"}
        boundaries = [
            replace(b, **{given[b.kind]: below}) if b.name.startswith(SUBSTRATE) else b
            for b in base.boundaries if b.kind != "voltage"
        ]  # fmt: skip
        for name, film, on in (("sink", beam, 0.0), ("sensor", gold, self.control.sample_time)):
            boundaries += [
                Boundary(f"{name}-{side}", "voltage", *face(film, 1, side), Schedule((on, on), (0.0, 0.5 - side)))
                for side in (0, 1)
            ]
        external = self.external
        outer = Schedule((external.step_time,) * 2, (external.initial_temperature, external.final_temperature))
        boundaries.append(Boundary("outside", "temperature", *face(polymer, 2, 1), outer))
        probes = tuple(Probe(name, film.lower, film.upper) for name, film in (("sink", beam), ("sensor", gold)))
        return Scene(
            self.name, (*base.boxes, *boxes), tuple(boundaries), probes, sink.room_temperature, self.end_time,
            self.accuracy_3d, contacts=base.contacts,
        )  # fmt: skip

    @property
    def steps_outside(self) -> bool:
        """Whether the outer temperature steps during the run."""
        outer = self.external
        return 0 < outer.step_time < self.end_time and outer.initial_temperature != outer.final_temperature
