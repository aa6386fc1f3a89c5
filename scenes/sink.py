"""The parametric sink: the paper's beam on two anchored pads (section 2 of the paper, Figures 4 to 7)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from scenes.checks import AGAINST_TOLERANCES, DEFAULT_TOLERANCES
from scenes.model import Boundary, Box, Material, Point, Probe, Scene

SILICON = Material("silicon", 130.0, 2330.0, 712.0, 6e-5, 5e-4, 293.0, valid_to=1687.0)
OXIDE = Material("oxide", 1.38, 2200.0, 703.0, valid_to=1858.0)


@dataclass(frozen=True)
class Sink:
    """Sizes in m, voltage in V, room temperature in K, convection in W/(m2 K), time in s.

    The beam lies along y from 0 to ``length``, its underside in z = 0, symmetric about x = 0. ``oxide_offset`` is the
    paper's u_o, from the pad's edge at the beam to the oxide; ``None`` centres the oxide under its pad. ``tolerances``
    holds those that are declared, by check id; ``expected_to_differ`` is ``None`` where nothing is declared about it.
    """

    length: float = 1000e-6
    width: float = 100e-6
    thickness: float = 2e-6
    pad_length: float = 150e-6
    pad_width: float = 150e-6
    oxide_length: float = 50e-6
    oxide_width: float = 50e-6
    oxide_thickness: float = 2e-6
    oxide_offset: float | None = None
    silicon: Material = SILICON
    oxide: Material = OXIDE
    voltage: float = 1.0
    electrodes: Literal["beam-end", "pad-edge"] = "beam-end"
    room_temperature: float = 293.0
    convection_coefficient: float = 0.0
    end_time: float = 0.02
    accuracy: float = 1e-3
    name: str = "sink"
    tolerances: dict[str, float] = field(default_factory=dict)
    expected_to_differ: tuple[str, ...] | None = None

    @property
    def anchor_distance(self) -> float:
        """The paper's u_o (m): from the beam's end to the oxide."""
        return (self.pad_length - self.oxide_length) / 2 if self.oxide_offset is None else self.oxide_offset

    @property
    def cross_section(self) -> float:
        """The paper's A_c (m2)."""
        return self.width * self.thickness

    def tolerance(self, check: str) -> float:
        """The relative tolerance of a check: the declared one, or else its default (KeyError for an unknown id)."""
        return {**DEFAULT_TOLERANCES, **AGAINST_TOLERANCES, **self.tolerances}[check]

    def scene(self) -> Scene:
        """The sink as boxes, conditions and probes."""
        return Scene(
            self.name, self._boxes(), self._boundaries(), self._probes(),
            self.room_temperature, self.end_time, self.accuracy,
        )  # fmt: skip

    def _boxes(self) -> tuple[Box, ...]:
        length, t = self.length, self.thickness
        w, pad, oxide = self.width / 2, self.pad_width / 2, self.oxide_width / 2
        near, far = self.anchor_distance, self.anchor_distance + self.oxide_length
        return (
            Box("beam", self.silicon, (-w, 0.0, 0.0), (w, length, t)),
            Box("pad-0", self.silicon, (-pad, -self.pad_length, 0.0), (pad, 0.0, t)),
            Box("pad-1", self.silicon, (-pad, length, 0.0), (pad, length + self.pad_length, t)),
            Box("oxide-0", self.oxide, (-oxide, -far, -self.oxide_thickness), (oxide, -near, 0.0)),
            Box("oxide-1", self.oxide, (-oxide, length + near, -self.oxide_thickness), (oxide, length + far, 0.0)),
        )

    def _boundaries(self) -> tuple[Boundary, ...]:
        boxes = {b.name: b for b in self._boxes()}
        room = self.room_temperature
        found = [
            Boundary(f"substrate-{i}", "temperature", *face(boxes[f"oxide-{i}"], 2, 0), room) for i in (0, 1)
        ]  # fmt: skip
        if self.electrodes == "beam-end":
            faces = (face(boxes["beam"], 1, 0), face(boxes["beam"], 1, 1))
        else:
            faces = (face(boxes["pad-0"], 1, 0), face(boxes["pad-1"], 1, 1))
        found += [
            Boundary("electrode-0", "voltage", *faces[0], self.voltage),
            Boundary("electrode-1", "voltage", *faces[1], 0.0),
        ]
        if self.convection_coefficient:
            found += [
                Boundary(f"air-{n}", "convection", *face(boxes[n], 2, 1), self.convection_coefficient, room)
                for n in ("beam", "pad-0", "pad-1")
            ]
        return tuple(found)

    def _probes(self) -> tuple[Probe, ...]:
        beam = self._boxes()[0]
        centre = (0.0, self.length / 2, self.thickness / 2)
        return (
            Probe("peak", centre, centre),
            Probe("end", *face(beam, 1, 0)),
            Probe("mean", beam.lower, beam.upper),
        )


def face(box: Box, axis: int, side: int) -> tuple[Point, Point]:
    """The flat box of a box's lower (0) or upper (1) face along an axis."""
    lower, upper = list(box.lower), list(box.upper)
    lower[axis] = upper[axis] = (box.lower, box.upper)[side][axis]
    return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])
