"""The plate against exact solutions, its balances, and its own error estimate."""

import math
from dataclasses import replace

import numpy as np
import pytest

from reduced1d.equations import room_resistivity
from reduced1d.ladder.beam import anchor_of, hot
from reduced1d.ladder.plate import COARSE, FINE, Grading, Plate, assemble, current_through_pads, factorize, film
from scenes.sink import Sink
from tests.reduced1d import relative

STRIP = Sink(width=100e-6, pad_width=100e-6, oxide_width=100e-6, pad_length=80e-6, oxide_length=80e-6)
"""A strip of one width, on oxide wherever there is a pad: nothing depends on x."""

SHAPES = {
    "default": Sink(),
    "wide beam": Sink(width=200e-6, pad_width=100e-6, oxide_width=80e-6),
    "oxide at the edge": Sink(oxide_offset=0.0),
    "all but equal": Sink(pad_width=100.0001e-6, oxide_width=99.9999e-6),
    "strip": STRIP,
}


def strip_resistance(sink: Sink, sideways: bool = True) -> float:
    """The anchor of a strip: a fin of length l with the conductance per width g = k t + k_o t_o/3 and the film h, so
    1 / (w sqrt(g h) tanh(l sqrt(h / g)))."""
    g = sink.silicon.thermal_conductivity * sink.thickness
    g += sideways * sink.oxide.thermal_conductivity * sink.oxide_thickness / 3
    h, length = film(sink), sink.pad_length
    return 1 / (sink.width * math.sqrt(g * h) * math.tanh(length * math.sqrt(h / g)))


def test_the_anchor_of_a_strip_is_the_exact_one():
    fine, coarse = (anchor_of(assemble(STRIP, grading)).resistance for grading in (FINE, COARSE))
    exact = strip_resistance(STRIP)
    # The meshes' own difference, 1e-4, bounds the error of the finer one.
    assert abs(fine - exact) < abs(fine - coarse) < 3e-4 * exact
    assert abs(fine - strip_resistance(STRIP, sideways=False)) > 1e-3 * exact


def carrying(sink: Sink, grading: Grading) -> Plate:
    """The plate of a sink with its pads in the circuit."""
    plate = assemble(replace(sink, electrodes="pad-edge"), grading)
    return plate.carrying(*current_through_pads(plate))


def test_the_current_in_a_strip_is_straight():
    plate = carrying(STRIP, COARSE)
    resistivity, _ = room_resistivity(STRIP.silicon, STRIP.room_temperature)
    per_length = resistivity / STRIP.cross_section
    assert plate.model.resistance_beam == relative(per_length * STRIP.length, 1e-9)
    assert plate.pads.resistance == relative(per_length * 2 * STRIP.pad_length, 1e-9)


def test_the_currents_resistance_is_approached_from_above():
    """Thomson's principle: no other pattern of the current has less heat."""
    sink = Sink()
    fine, coarse = (carrying(sink, grading).model.resistance for grading in (FINE, COARSE))
    squares = room_resistivity(sink.silicon, sink.room_temperature)[0] / sink.thickness
    assert coarse > fine
    assert fine == relative(coarse, 1e-5)
    # Between pads without any spreading resistance and pads as narrow as the beam.
    least = squares * (sink.length / sink.width + 2 * sink.pad_length / sink.pad_width)
    assert least < fine < squares * (sink.length + 2 * sink.pad_length) / sink.width


@pytest.mark.parametrize(
    "sink",
    [replace(SHAPES[name], electrodes="pad-edge") for name in ("default", "wide beam", "strip")]
    + [SHAPES["all but equal"]],
)
def test_heat_is_conserved(sink):
    sink = replace(sink, convection_coefficient=100.0, voltage=3.0)
    plate, rise = hot(assemble(sink, COARSE))
    one, model = np.ones(plate.unknowns), plate.model
    resistance = model.resistance + model.coefficient * model.source @ rise
    assert one @ (model.conductance @ rise) == relative(sink.voltage**2 / resistance, 1e-8)
    assert model.source.sum() == relative(model.resistance, 1e-10)
    # The capacity is all silicon and a third of the oxide.
    silicon = (sink.length * sink.width + 2 * sink.pad_length * sink.pad_width) * sink.thickness
    oxide = 2 * sink.oxide_length * sink.oxide_width * sink.oxide_thickness
    expected = sink.silicon.heat_capacity * silicon + sink.oxide.heat_capacity * oxide / 3
    assert one @ (model.capacity @ one) == relative(expected, 3e-6)


@pytest.mark.parametrize("sink", [SHAPES[name] for name in ("default", "wide beam", "oxide at the edge")])
def test_the_coarse_mesh_tells_the_error_of_the_fine_one(sink):
    fine, coarse = (anchor_of(assemble(sink, grading)).resistance for grading in (FINE, COARSE))
    best = anchor_of(assemble(sink, FINE._replace(corner=1e-4, outline=0.15, ratio=1.6, above=1.3))).resistance
    assert abs(fine - best) <= abs(fine - coarse)
    assert abs(fine - best) < 3e-4 * best


def test_the_anchors_capacity_is_what_its_impedance_says(levels):
    """Z(p) = R - p R^2 C + ...: a rate p of 1/s is slow against the anchor's own, of 1e4/s."""
    plate, anchor = levels.fine.plate, levels.fine.anchor
    mean, end = plate.model.outputs["mean"], plate.model.outputs["end"]
    field = plate.inverse.solve(mean)
    # The beam's capacity left out, the flow through the ends is the same at any rate except for the heat of the pads.
    moved = factorize((plate.model.conductance + 1.0 * (plate.in_pads + plate.in_oxide)).tocsc()).solve(mean)
    R, C = anchor.resistance, anchor.pad + anchor.oxide
    change = float(end @ (moved - field)) / float(end @ field)
    assert change == relative(-R * C, 1e-2)
    assert change != relative(-R * anchor.pad / 2, 0.3)
