"""The parametric sink: the paper's beam on two anchored pads (section 2 of the paper, Figures 4 to 7)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from scenes import row
from scenes.checks import AGAINST_TOLERANCES, DEFAULT_TOLERANCES
from scenes.model import Material, Scene

SILICON = Material("silicon", 130.0, 2330.0, 712.0, 6e-5, 5e-4, 293.0, valid_to=1687.0)
OXIDE = Material("oxide", 1.38, 2200.0, 703.0, valid_to=1858.0)


@dataclass(frozen=True)
class Sink:
    """Sizes in m, voltage in V, room temperature in K, convection in W/(m2 K), time in s.

    The beam lies along y from 0 to ``length``, its underside in z = 0, symmetric about x = 0. ``oxide_offset`` is the
    paper's u_o, from the pad's edge at the beam to the oxide; ``None`` centres the oxide under its pad. More than one
    of ``spans`` follow each other along y, each of that ``length`` and at about that ``voltage``; between two of them
    the beam goes on over an island of oxide, with ``None`` as long as the anchors' oxide. ``tolerances`` holds those
    that are declared, by check id; ``expected_to_differ`` is ``None`` where nothing is declared about it.
    """

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
    def island(self) -> float:
        """The length of an island (m), along the beam."""
        return self.oxide_length if self.island_length is None else self.island_length

    @property
    def island_width(self) -> float:
        """The width of an island (m): the anchors' oxide's, or the beam's if that is narrower."""
        return min(self.oxide_width, self.width)

    @property
    def row_length(self) -> float:
        """From pad to pad (m)."""
        return row.start(self, self.spans) + self.length

    @property
    def cross_section(self) -> float:
        """The paper's A_c (m2)."""
        return self.width * self.thickness

    def tolerance(self, check: str) -> float:
        """The relative tolerance of a check: the declared one, or else its default (KeyError for an unknown id)."""
        return {**DEFAULT_TOLERANCES, **AGAINST_TOLERANCES, **self.tolerances}[check]

    def scene(self, count: int | None = None) -> Scene:
        """The sink as boxes, conditions and probes; with so many spans, the innermost of which stand for the rest."""
        count = self.spans if count is None else count
        return Scene(
            self.name, row.boxes(self, count), row.boundaries(self, count), row.probes(self, count),
            self.room_temperature, self.end_time, self.accuracy,
        )  # fmt: skip
