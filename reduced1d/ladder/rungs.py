"""The ladder, rung by rung: what each assumption that is dropped does, with everything before it already dropped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from reduced1d import ladder
from reduced1d.ladder.answer import result
from reduced1d.ladder.few_states import FewStates
from reduced1d.ladder.levels import Level, Levels

if TYPE_CHECKING:
    import numpy as np

    from scenes.result import Result


@dataclass(frozen=True)
class Rung:
    """A model, and the one assumption that the model after it drops: its ``blame`` for tables, a sentence's part that
    says what the assumption is, and what in the model is ``at_fault``."""

    name: str
    blame: str
    says: str
    at_fault: str


def rungs(levels: Levels, start: str = "paper") -> list[Rung]:
    """From a reduction (its canonical name) up to the plate, after which only the 3D model is left."""
    if start.startswith("moments:"):
        return [replace(_FEW, name=start), *(_OF_ROWS["fin"] if levels.sink.spans > 1 else (_PLATE,))]
    names = [rung.name for rung in _ALL]
    found = _ALL[names.index(start) :]
    if levels.sink.spans > 1:
        found = [own for rung in found for own in _OF_ROWS.get(rung.name, (rung,))]
    if levels.sink.electrodes == "beam-end":
        found = [rung for rung in found if rung.name != _WITHOUT_CIRCUIT]
    return found


def solve(levels: Levels, rung: Rung, steady_only: bool, times: np.ndarray | None) -> Result:
    """The answer of a rung's model, without the remarks on it. Raises RunawayError."""
    if rung.name == "paper":
        return ladder.solve(levels.sink, rung.name, steady_only=steady_only, times=times)
    build = _BETWEEN.get(rung.name, partial(ladder.build, name=rung.name))
    if rung is _PLATE and steady_only:
        build = partial(Level.moments, states=1)  # that field is the steady state itself
    fine = build(levels.fine)
    coarse = fine if levels.rough else build(levels.coarse)
    return result(rung.name, levels.sink, fine, coarse, steady_only, times)


_WITHOUT_CIRCUIT = "fin-massless, no current in the pads"
_WITH_ISLANDS = "anchored, islands in the circuit"
_PLATE = Rung(
    "plate", "rest (thin plate)", "the silicon layer is averaged over its thickness",
    "the average over the layer's thickness",
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
_OF_ROWS: dict[str, tuple[Rung, ...]] = {
    "anchored": (
        Rung("anchored", "islands in the circuit", "the beam has no resistance over the islands",
             "the missing resistance of the beam over the islands"),
        Rung(_WITH_ISLANDS, "fixed parabola", "eq 9 holds each span to a steady parabola on blocks of its own",
             "the fixed parabola (eq 9)"),
    ),
    "fin": (Rung("fin", "rest (uniform across)", "the rise is the same across the beam, over narrower islands too",
                 "the rise taken as the same across the beam"),),
    "plate": (),
}  # fmt: skip
"""What stands in a row's ladder for some of these: no plate is made of a row, and the fin is the last before 3D."""

AT_FAULT = {rung.blame: rung.at_fault for rung in (*_ALL, _FEW, *(own for of in _OF_ROWS.values() for own in of))}
"""What is at fault, by its ``blame``."""

_BETWEEN: dict[str, Callable[[Level], FewStates]] = {
    _WITH_ISLANDS: lambda level: level.lump(circuit=True),
    _WITHOUT_CIRCUIT: lambda level: level.fin(False, False, circuit=False),
    "fin, pad capacity only": lambda level: level.fin(oxide_capacity=False),
}
