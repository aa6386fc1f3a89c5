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
from scenes import laws
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
_STEADY = Request(models=("fem3d",), transient=False)


@dataclass(frozen=True)
class Effect:
    """What is left out: ``what`` in words as the subject of a sentence, the ``source`` of its magnitude, and of a sink
    what is ``assumed`` and the keywords that ``changed`` it; none where the sink has the effect already."""

    what: str
    source: str
    assumed: Callable[[Sink], str]
    changed: Callable[[Sink], dict[str, Any]]


EXPONENT = -1.3
"""Of silicon's conductivity over the temperature, from 300 to 1400 K, within a tenth."""


def _falling(sink: Sink) -> dict[str, Any]:
    """The keywords of a sink whose silicon's conductivity falls from its value at room temperature."""
    given = sink.silicon.thermal_conductivity
    if laws.varies(given):
        return {}
    of = [laws.PowerLaw(k, sink.room_temperature, EXPONENT) for k in laws.along(given)]
    return {"silicon": replace(sink.silicon, thermal_conductivity=tuple(of) if isinstance(given, tuple) else of[0])}


EFFECTS = {
    "conductivity": Effect(
        "silicon's falling conductivity",
        "Glassbrenner and Slack, Phys. Rev. 134, A1058 (1964)",
        lambda sink: f"that of room temperature times (T/{sink.room_temperature:g} K)^{EXPONENT:g}",
        _falling,
    ),
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
UNSOLVED = "contacts, the gas in the gap and radiation"
"""What both models leave out and 3D can't be asked for either: nothing is known of how much it matters."""
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
    sink = replace(sink, accuracy=min(sink.accuracy, CLOSE))
    say("without what is left out")
    bare = solve_3d(sink, _STEADY)
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
            found[name] = _found(effect.what, effect.assumed(sink), effect.source, bare, changed)
        except (SceneError, NumericsError) as error:
            skipped[name] = str(error)
            continue
        everything |= changed
    together = None
    if len(found) > 1:
        say("with all of that together")
        try:
            together = _found("all together", f"{', '.join(found)} at once", "", bare, everything)
        except (SceneError, NumericsError) as error:
            skipped[TOGETHER] = str(error)
    ranked = dict(sorted(found.items(), key=lambda item: -item[1].size))
    asked = [each.steady for each in OF_A_SINK.values()]
    added = {q: sum(f.changes[q].value for f in found.values() if f.changes) for q in asked}
    return LeftOut(ranked, together, added, skipped, _sentence(ranked))


def _found(what: str, assumed: str, source: str, bare: Result, changed: dict[str, Any]) -> Found:
    """What some changed keywords do to the sink of a result."""
    try:
        steady = solve_3d(check(replace(bare.details["sink"], **changed)), _STEADY).steady
    except RunawayError:
        return Found(what, assumed, source, {})
    changes = {}
    for name in (asked.steady for asked in OF_A_SINK.values()):
        inputs = {"predicted": steady[name], "measured": bare.steady[name]}
        changes[name] = Estimate(relative(*(e.value for e in inputs.values())), spread(relative, inputs))
    return Found(what, assumed, source, changes)


def _sentence(ranked: dict[str, Found]) -> str:
    """What decides, of all that is solved: the largest effect in air, and the largest one in vacuum."""
    if not ranked:
        return f"Of what both models leave out the scene has all that can be solved; not solved: {UNSOLVED}."
    said = []
    for where, inside in (("In air", True), ("In vacuum", False)):
        those = [each for name, each in ranked.items() if (name in IN_AIR) is inside]
        if those:
            said.append(f"{where} {_does(those[0], len(those))}.")
    return " ".join(said)


def _does(found: Found, of: int) -> str:
    """What the largest ``of`` so many effects does."""
    if not found.changes:
        return f"{found.what} makes it run away"
    change = percent(found.changes[RANKED].value, sign=True)
    if of > 1:
        return f"{found.what} matters most, {change} at the peak"
    return f"{found.what} changes the peak by {change}"
