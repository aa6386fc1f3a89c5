"""The paper's resistance and conductances around the beam of a sink."""

from __future__ import annotations

from reduced1d import equations
from scenes.sink import Sink


def anchor_series_resistance(sink: Sink) -> float:
    """Compute eq 14's resistance (K/W) of one anchor: u_o of silicon as wide as the pad, then the oxide block."""
    return equations.series_resistance(
        sink.anchor_distance, sink.silicon.thermal_conductivity, sink.pad_width * sink.thickness,
        sink.oxide_thickness, sink.oxide.thermal_conductivity, sink.oxide_length * sink.oxide_width,
    )  # fmt: skip


def air_conductance(sink: Sink) -> float:
    """Compute the conductance (W/K) from the beam's top face to the room: coefficient times length times width.

    Our reading: the paper announces the loss to the air and leaves it out of eq 20; as a lumped term h A dT_c with the
    equivalent rise it is exact for the beam (dT_c is the mean rise). The pads' faces, which the 3D scene cools too,
    have no temperature in this model.
    """
    return sink.convection_coefficient * sink.length * sink.width


def gap_conductance(sink: Sink) -> float:
    """Compute the conductance (W/K) of the gap's gas from the beam to a substrate at room temperature."""
    return sink.gap_coefficient * sink.length * sink.width
