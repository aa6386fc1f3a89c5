"""A sink's plate on two meshes and the models that follow, each computed when first needed; and the ladder of models,
in which each rung drops one more assumption."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from reduced1d import ladder
from reduced1d.ladder.beam import Anchor, anchor_of, fin, hot, projected, steady_rise, thin_plate_remainder
from reduced1d.ladder.few_states import FewStates, lumps, result
from reduced1d.ladder.plate import COARSE, FINE, Grading, Plate, assemble, factorize
from scenes.result import Result
from scenes.sink import Sink

_WITHOUT_CIRCUIT = "fin-massless, no current in the pads"


@dataclass(frozen=True, eq=False)
class Level:
    """A sink of one span solved to some fineness: the mesh's, and the number of fields and degrees that go with it."""

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
        return anchor_of(self.plate)

    @cached_property
    def remainder(self) -> float:
        """Part of the anchor resistance that the plate neglects (-)."""
        return thin_plate_remainder(self._assembled)

    def fin(self, pad_capacity: bool = True, oxide_capacity: bool = True, circuit: bool = True) -> FewStates:
        """The fin on the plate's anchor, with or without the anchor's capacities and the circuit in it."""
        anchor = self.anchor if circuit else replace(self.anchor, circuit=0.0, source=0.0, feedback=0.0)
        model = fin(self.sink, anchor, pad_capacity=pad_capacity, oxide_capacity=oxide_capacity, finer=self.finer)
        inverse = factorize(model.conductance)
        return projected(model, inverse, steady_rise(model, inverse), self.plate_states)

    def moments(self, states: int) -> FewStates:
        """The plate with some states (fewer where they would depend on each other)."""
        plate, rise = self._hot
        return projected(plate.model, plate.inverse, rise, states)

    def model(self, name: str) -> FewStates:
        """The states of a reduction or of a rung by its name."""
        if name.startswith("moments:"):
            return self.moments(int(name.partition(":")[2]))
        return {
            "anchored": lambda: lumps(self.sink, self.anchor.resistance),
            _WITHOUT_CIRCUIT: lambda: self.fin(False, False, circuit=False),
            "fin-massless": lambda: self.fin(False, False),
            "fin, pad capacity only": lambda: self.fin(oxide_capacity=False),
            "fin": self.fin,
            "plate": lambda: self.moments(self.plate_states),
        }[name]()


@dataclass(frozen=True, eq=False)
class Levels:
    """The two levels of a sink of constant properties (`plain`); their difference bounds the error of the finer one.

    ``rough`` takes the coarser for both, in a quarter of the time: errors come out as 0; this is enough to decide
    which part is the largest.
    """

    sink: Sink
    rough: bool = False

    def without(self, keys: tuple[str, ...]) -> Levels:
        """The levels of the sink with ``None`` for some of its attributes; made once for each."""
        absent: dict[str, Any] = dict.fromkeys(keys)
        sink = replace(self.sink, **absent)
        return self if sink == self.sink else _levels(sink, self.rough)

    @cached_property
    def fine(self) -> Level:
        # With 24 fields the projection equals the plate to 1e-5 at all times that are compared.
        return self.coarse if self.rough else Level(self.sink.plain, FINE, 24, 2)

    @cached_property
    def coarse(self) -> Level:
        return Level(self.sink.plain, COARSE, 18, 0)


_levels = lru_cache(maxsize=4)(Levels)


@dataclass(frozen=True)
class Rung:
    """A model, and the assumption that the next model drops: its ``blame`` in tables, a clause about it, and the part
    of the model ``at_fault``; the sink's attributes that the model is ``without``."""

    name: str
    blame: str
    says: str
    at_fault: str
    without: tuple[str, ...] = ()


def rungs(levels: Levels, start: str = "paper") -> list[Rung]:
    """From a reduction (its canonical name) up to the plate, after which only the 3D model is left."""
    if levels.sink.spans > 1:
        return [_ROW]
    if start.startswith("moments:"):
        return [replace(_FEW, name=start), _PLATE]
    names = [rung.name for rung in _ALL]
    models = _ALL[names.index(start) :]
    if levels.sink.electrodes == "beam-end":
        models = [rung for rung in models if rung.name != _WITHOUT_CIRCUIT]
    if start in ladder.CONSTANT:
        # The paper's model has neither, the models that stand on the plate do: both are dropped last.
        last, missing = models.pop(), _missing(levels.sink, start)
        models = [replace(rung, without=missing) for rung in models]
        models += [replace(_MISSING[key], name=last.name, without=missing[n:]) for n, key in enumerate(missing)]
        models.append(last)
    if levels.sink != levels.sink.plain:
        laws = replace(levels.sink, emissivity=0.0) != levels.sink.plain
        only_3d = (_BOTH if laws else _RADIATION) if levels.sink.emissivity else _LAWS
        models[-1] = replace(only_3d, name=models[-1].name)
    return models


def _missing(sink: Sink, start: str) -> tuple[str, ...]:
    """The keys of `_MISSING` that the sink has and the paper's model leaves out."""
    return tuple(key for key in _MISSING if start == "paper" and getattr(sink, key) is not None)


def solve(levels: Levels, rung: Rung, steady_only: bool, times: np.ndarray | None) -> Result:
    """The answer of a rung's model, without the remarks on it. Raises RunawayError."""
    levels = levels.without(rung.without)
    if rung.name == "paper":
        return ladder.solve(levels.sink, rung.name, steady_only=steady_only, times=times)
    # The first field of the plate is the steady state itself.
    name = "moments:1" if rung.name == "plate" and steady_only else rung.name
    fine = levels.fine.model(name)
    coarse = fine if levels.rough else levels.coarse.model(name)
    return result(rung.name, levels.sink, fine, coarse, steady_only, times)


_PLATE = Rung(
    "plate", "rest (thin plate)", "the silicon layer is averaged over its thickness",
    "the average over the layer's thickness",
)  # fmt: skip
_MISSING = {
    "contact_resistance": Rung(
        "plate", "contacts", "the oxide touches without any resistance", "the missing resistance of the contacts",
    ),
    "substrate_thickness": Rung(
        "plate", "substrate", "the oxide stands on room temperature", "the missing substrate",
    ),
}  # fmt: skip
"""What the paper's equations are without, by the sink's attribute."""
_LAWS = Rung(
    "plate", "properties at room temperature", "properties are those at room temperature",
    "the properties at room temperature",
)  # fmt: skip
_RADIATION = Rung("plate", "radiation", "nothing radiates", "the missing radiation")
_BOTH = Rung(
    "plate", "laws and radiation", "properties are those at room temperature, and nothing radiates",
    "the missing laws and radiation",
)  # fmt: skip
_FEW = Rung("moments", "few states", "the response is made of a few fields", "the small number of states")
_ALL = [
    Rung("paper", "anchor resistance", "eq 14 takes the anchor for two prisms in series",
         "the anchor resistance (eq 14)"),
    Rung("anchored", "fixed parabola", "eq 9 holds the profile to a steady parabola at every instant",
         "the fixed parabola (eq 9)"),
    Rung(_WITHOUT_CIRCUIT, "pads in the circuit", "the pads carry the current too, and the model has none there",
         "the missing current in the pads"),
    Rung("fin-massless", "pad capacity", "the pads are taken to hold no heat", "the pads' missing heat capacity"),
    Rung(
        "fin, pad capacity only", "oxide capacity", "the oxide is taken to hold no heat",
        "the oxide's missing heat capacity",
    ),
    Rung("fin", "anchor as one node", "the anchor warms up in one fixed shape", "the anchor taken as one node"),
    _PLATE,
]  # fmt: skip
_ROW = Rung(
    "paper", "row of lumps", "each span is a lump after eq 20, and the beam has no resistance over the islands",
    "the row of lumps (eq 20)",
)  # fmt: skip
"""A row of spans has no better reduction: the next model is 3D."""

AT_FAULT = {rung.blame: rung.at_fault for rung in (*_ALL, _FEW, _ROW, _LAWS, _RADIATION, _BOTH, *_MISSING.values())}
"""What is at fault, by its ``blame``."""
