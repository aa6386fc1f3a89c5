"""A sink's plate on two meshes, and what follows from it, each computed when first asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from reduced1d.ladder.anchor import Anchor, anchor_of, one_node_remainder, thin_plate_remainder
from reduced1d.ladder.few_states import FewStates, steady_state
from reduced1d.ladder.fin import fin
from reduced1d.ladder.lumps import lumps
from reduced1d.ladder.moments import PLATE_STATES, hot, moment_fields
from reduced1d.ladder.plate import COARSE, FINE, Grading, Plate, assemble
from scenes.sink import Sink


@dataclass(frozen=True, eq=False)
class Level:
    """A sink solved to some fineness: the mesh's, and the number of fields and of degrees that go with it.

    The plate of a row of spans is that of one of them alone: it is there for the row's anchors.
    """

    sink: Sink
    grading: Grading
    plate_states: int
    finer: int

    @cached_property
    def _hot(self) -> tuple[Plate, np.ndarray]:
        return hot(self._assembled)

    @cached_property
    def _assembled(self) -> Plate:
        return assemble(self.sink, self.grading)

    @property
    def plate(self) -> Plate:
        """The plate with its current. Raises RunawayError where that depends on a steady state that there isn't."""
        return self._hot[0] if self.sink.electrodes == "pad-edge" else self._assembled

    @cached_property
    def anchor(self) -> Anchor:
        """The anchor, with the circuit in it."""
        return anchor_of(self.plate)

    @cached_property
    def remainder(self) -> float:
        """What the plate leaves out of the anchor resistance (-)."""
        return thin_plate_remainder(self._assembled)

    @cached_property
    def one_node(self) -> float:
        """What a fin on one-node anchors may leave out at its ends (-)."""
        return one_node_remainder(self._assembled)

    def lump(self, circuit: bool = False) -> FewStates:
        """The paper's model on the plate's anchor resistance; of a row perhaps with the islands in the circuit."""
        return lumps(self.sink, self.anchor.resistance, circuit)

    def fin(self, pad_capacity: bool = True, oxide_capacity: bool = True, circuit: bool = True) -> FewStates:
        """The fin on the plate's anchor, with what is asked for of the anchor's capacity and of the circuit in it."""
        anchor = self.anchor if circuit else replace(self.anchor, circuit=0.0, source=0.0, feedback=0.0)
        return fin(self.sink, anchor, pad_capacity=pad_capacity, oxide_capacity=oxide_capacity, finer=self.finer)

    def moments(self, states: int) -> FewStates:
        """The plate, of a row the fin, with some states (fewer where they would depend on each other)."""
        if self.sink.spans > 1:
            model = self.fin()
            cold, rise = model.source / model.rates, steady_state(model)[0]
        else:
            plate, rise = self._hot
            model = plate.model
            cold = plate.inverse.solve(model.source)
        return model.on(moment_fields(model, cold, rise, states)).in_modes()

    def whole_plate(self) -> FewStates:
        """The plate, on so many fields that it is the plate."""
        return self.moments(self.plate_states)

    def most(self) -> tuple[str, FewStates]:
        """The last model before 3D and its name: the plate, of a row the fin."""
        return ("fin", self.fin()) if self.sink.spans > 1 else ("plate", self.whole_plate())


@dataclass(frozen=True, eq=False)
class Levels:
    """The two levels of a sink; the difference of what they give bounds the error of the finer one.

    ``rough`` takes the coarser for both, in a quarter of the time: errors come out as 0, so that it is for whoever asks
    which part is the largest, not how large it is.
    """

    sink: Sink
    rough: bool = False

    @cached_property
    def fine(self) -> Level:
        return self.coarse if self.rough else Level(self.sink, FINE, PLATE_STATES, 2)

    @cached_property
    def coarse(self) -> Level:
        return Level(self.sink, COARSE, PLATE_STATES - 6, 0)
