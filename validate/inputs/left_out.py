"""What both models leave out: the sink in 3D once without and once with each effect, at a magnitude with a source.

A *change* is a quantity with the effect over that without, less one. Both steady states are solved more closely than
the effects are small, to `CLOSE` or better. ``together`` has all at once: what it is off from their sum is how they
work on each other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from compare.verdict import relative, spread
from fem3d.runs.sink import solve as solve_3d
from scenes.errors import NumericsError, RunawayError, SceneError
from scenes.formats import percent
from scenes.plan import Request
from scenes.result import Estimate, Result
from scenes.sink import OF_A_SINK, Sink
from scenes.validity import check
from validate.inputs.air import conduction

CLOSE = 1e-4
"""The accuracy of both solutions, at most: the smallest effects are half a percent."""
TOGETHER = "together"
RANKED = "peak_rise_K"


@dataclass(frozen=True)
class Effect:
    """What is left out: ``what`` in words as the subject of a sentence, the ``source`` of its magnitude, and of a sink
    what is ``assumed`` and the keywords that ``changed`` it; none where the sink has the effect already."""

    what: str
    source: str
    assumed: Callable[[Sink], str]
    changed: Callable[[Sink], dict[str, Any]]


EFFECTS = {
    "substrate": Effect(
        "the substrate's own resistance",
        "525 um is the thickness of wafers of 100 mm (SEMI M1)",
        lambda sink: "a plate of silicon, 0.5 mm thick and 3 mm x 3 mm, under the oxide",
        lambda sink: {} if sink.substrate_thickness is not None else {"substrate_thickness": 0.5e-3},
    ),
    "air": Effect(
        "the air above",
        "conduction of air at rest from one side of a thin plate: Holman, Heat Transfer, chapter 3",
        lambda sink: f"{conduction(sink):.3g} W/(m2 K) from the top of beam and pads",
        lambda sink: {} if sink.convection_coefficient else {"convection_coefficient": conduction(sink)},
    ),
}
"""By name, as summary.json has them."""
IN_AIR = ("gap_gas", "air")
"""The effects that a vacuum is without."""


@dataclass(frozen=True)
class Found:
    """What an effect does: what is ``assumed`` of it and the ``source`` of that, and by quantity the ``changes``, empty
    where the sink runs away with it."""

    what: str
    assumed: str
    source: str
    changes: dict[str, Estimate]

    @property
    def size(self) -> float:
        return abs(self.changes[RANKED].value) if self.changes else float("inf")


@dataclass(frozen=True)
class LeftOut:
    """By effect what it does, the largest first, all of them ``together``, and the ``sum`` of the changes of each
    quantity; why others were not made (``skipped``); the ``sentence`` of what decides."""

    found: dict[str, Found]
    together: Found | None
    sum: dict[str, float]
    skipped: dict[str, str]
    sentence: str

    def document(self) -> dict[str, Any]:
        def one(each: Found) -> dict[str, Any]:
            changes = {name: {"change": c.value, "error": c.error} for name, c in each.changes.items()}
            return {"assumed": each.assumed, "source": each.source, **changes}

        whole = {} if self.together is None else {TOGETHER: self.together}
        return {name: one(each) for name, each in (self.found | whole).items()}


def of_sink(sink: Sink, say: Callable[[str], None]) -> LeftOut:
    """What each effect changes of a sink. Raises RunawayError where there is no steady state without any of them."""
    request = Request(models=("fem3d",), transient=False)
    sink = replace(sink, accuracy=min(sink.accuracy, CLOSE))
    say("without what is left out")
    bare = solve_3d(sink, request)
    found: dict[str, Found] = {}
    skipped: dict[str, str] = {}
    everything: dict[str, Any] = {}
    for number, (name, effect) in enumerate(EFFECTS.items(), 1):
        changed = effect.changed(sink)
        if not changed:
            skipped[name] = "the scene has it"
            continue
        say(f"with what is left out, {number} of {len(EFFECTS)}: {effect.what}")
        try:
            found[name] = _found(effect, effect.assumed(sink), bare, lambda c=changed: _solved(sink, c, request))  # type: ignore[misc]
        except (SceneError, NumericsError) as error:
            skipped[name] = str(error)
            continue
        everything |= changed
    together = None
    if len(found) > 1:
        say("with all of that together")
        all_of_it = Effect("all together", "", lambda sink: "", lambda sink: everything)
        together = _found(all_of_it, f"{', '.join(found)} at once", bare, lambda: _solved(sink, everything, request))
    ranked = dict(sorted(found.items(), key=lambda item: -item[1].size))
    asked = [each.steady for each in OF_A_SINK.values()]
    added = {q: sum(f.changes[q].value for f in found.values() if f.changes) for q in asked}
    return LeftOut(ranked, together, added, skipped, _sentence(sink, ranked))


def _solved(sink: Sink, changed: dict[str, Any], request: Request) -> Result:
    return solve_3d(check(replace(sink, **changed)), request)


def _found(effect: Effect, assumed: str, bare: Result, solved: Callable[[], Result]) -> Found:
    try:
        steady = solved().steady
    except RunawayError:
        return Found(effect.what, assumed, effect.source, {})
    changes = {}
    for name in (asked.steady for asked in OF_A_SINK.values()):
        inputs = {"predicted": steady[name], "measured": bare.steady[name]}
        changes[name] = Estimate(relative(*(e.value for e in inputs.values())), spread(relative, inputs))
    return Found(effect.what, assumed, effect.source, changes)


def _sentence(sink: Sink, ranked: dict[str, Found]) -> str:
    """What decides."""
    if not ranked:
        return "Nothing is left out: the scene has every effect that is known here."
    of = [f for name, f in ranked.items() if name not in IN_AIR]
    said = []
    if "air" in ranked:
        said.append(f"In air {_does(ranked['air'])}.")
    if of:
        said.append(f"In vacuum {_does(of[0])}.")
    return " ".join(said)


def _does(found: Found) -> str:
    if not found.changes:
        return f"{found.what} makes it run away"
    return f"{found.what} matters most, {percent(found.changes[RANKED].value, sign=True)} at the peak"
