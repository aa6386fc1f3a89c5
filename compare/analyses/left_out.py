"""Effects that both models leave out: solve in 3D without them, with each one, and with all of them.

A *change* is a quantity with the effect over the quantity without, less one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from compare.analyses.base import Analysis
from compare.kinds import kind_of
from compare.outcome import Outcome, Progress
from compare.report.table import Row, Section, Style, Table, sentences
from compare.verdict import ratio
from scenes import laws
from scenes.errors import NumericsError, RunawayError, SceneError
from scenes.formats import difference_text, percent
from scenes.result import Estimate
from scenes.sink import Sink
from scenes.units import THERMAL_CONTACT
from scenes.validity import check

TOGETHER = "together"
CONDUCTIVITY = 0.0263
"""W/(m K) of air at 300 K, within a percent (Carroll et al., J. Chem. Eng. Data 13, 1968: 0.0264 at 25 C)."""
CONTACT = 2e-8
"""m2 K/W, at each face of an oxide."""
EMISSIVITY = 0.7
EXPONENT = -1.3
"""Silicon's conductivity falls as this power of the temperature from 300 to 1400 K, within a tenth."""
SUBSTRATE = 0.5e-3
"""Thickness (m) of the substrate."""
IN_AIR = ("gap_gas", "air")
"""Effects that are absent in a vacuum."""


@dataclass(frozen=True)
class Effect:
    """An effect that a sink may leave out, and its result.

    Attributes
    ----------
    what, assumed, source : its name in a sentence, its magnitude, and the source of that
    changed : keywords of a sink with the effect; empty where the sink has it
    changes : by quantity the relative change; empty where the sink runs away
    """

    what: str
    assumed: str
    source: str
    changed: dict[str, Any]
    changes: dict[str, Estimate] = field(default_factory=dict)


def conduction(sink: Sink) -> float:
    """Return the film coefficient (W/(m2 K)) of air at rest above the beam.

    Air conducts from one side of a thin plate, L long and w wide, with the shape factor pi L / ln(4 L / w) (Holman,
    Heat Transfer, chapter 3: a plate in the surface of a half space).
    """
    long, short = sorted((sink.row_length, sink.width), reverse=True)
    return math.pi * CONDUCTIVITY / (short * math.log(4 * long / short))


def effects(sink: Sink) -> dict[str, Effect]:
    """Return the effects by their names in summary.json."""
    given, film = sink.silicon.thermal_conductivity, conduction(sink)
    falling = [laws.PowerLaw(k, sink.room_temperature, EXPONENT) for k in laws.along(given) if not laws.varies(given)]
    law = tuple(falling) if isinstance(given, tuple) else falling[0] if falling else given
    made = {
        "conductivity": Effect(
            "silicon's falling conductivity", f"that of room temperature times (T/{sink.room_temperature:g} K)^"
            f"{EXPONENT:g}", "Glassbrenner and Slack, Phys. Rev. 134, A1058 (1964)",
            {"silicon": replace(sink.silicon, thermal_conductivity=law)},
        ),
        "contact": Effect(
            "the contacts of the oxide", f"{THERMAL_CONTACT.show(CONTACT)} at both faces of the oxide",
            "of films of SiO2 on silicon: Lee and Cahill, J. Appl. Phys. 81, 2590 (1997)",
            {"contact_resistance": CONTACT},
        ),
        "gap_gas": Effect(
            "the gas under it",
            f"{CONDUCTIVITY:g} W/(m K) under beam and pads, {1e6 * sink.oxide_thickness:.3g} um high",
            "air at 300 K: Carroll et al., J. Chem. Eng. Data 13 (1968)", {"gap_gas_conductivity": CONDUCTIVITY},
        ),
        "radiation": Effect(
            "radiation", f"emissivity {EMISSIVITY:g} of all bare faces of beam and pads",
            "silicon has 0.42 to 0.78 from 880 to 1550 K: Jain et al., J. Phys. D 4, 1207 (1971)",
            {"emissivity": EMISSIVITY},
        ),
        "substrate": Effect(
            "the substrate's own resistance", "a plate of silicon, 0.5 mm thick and 3 mm x 3 mm, under the oxide",
            "525 um is the thickness of wafers of 100 mm (SEMI M1)", {"substrate_thickness": SUBSTRATE},
        ),
        "air": Effect(
            "the air above", f"{film:.3g} W/(m2 K) from the top of beam and pads",
            "conduction of air at rest from one side of a thin plate: Holman, Heat Transfer, chapter 3",
            {"convection_coefficient": film},
        ),
    }  # fmt: skip
    has = {name: laws.varies(given) if name == "conductivity" else getattr(sink, *each.changed)
           for name, each in made.items()}  # fmt: skip
    return {name: replace(each, changed={}) if has[name] else each for name, each in made.items()}


@dataclass(frozen=True)
class LeftOut:
    """The effects, the largest first, all ``together``, and by name why others are ``skipped``."""

    effects: dict[str, Effect]
    together: Effect | None
    skipped: dict[str, str]

    @property
    def every(self) -> dict[str, Effect]:
        """The effects and all together, by name."""
        return self.effects | ({} if self.together is None else {TOGETHER: self.together})

    @property
    def sentence(self) -> str:
        """The largest effect in air, and in vacuum."""
        said = []
        for where, inside in (("In air", True), ("In vacuum", False)):
            some = [each for name, each in self.effects.items() if (name in IN_AIR) is inside]
            for each in some[:1]:
                does = "makes it run away"
                if each.changes:
                    quantity, change = next(iter(each.changes.items()))
                    whole = "peak" if quantity == "peak_rise_K" else "power that the sink takes"
                    does = f"changes the {whole}{' most,' * (len(some) > 1)} by {percent(change.value, sign=True)}"
                said.append(f"{where} {each.what} {does}.")
        return " ".join(said) or "Of the effects that both models leave out the scene has all that can be solved."


class LeftOutStudy(Analysis[LeftOut]):
    name, leads = "left_out", True
    about = "3D again with each effect that both models leave out, and with all"

    def run(self, outcome: Outcome[Any], progress: Progress) -> LeftOut:
        with progress.stage("left out"):
            return study(outcome.scene, progress)

    def sentence(self, found: LeftOut, outcome: Outcome[Any]) -> str:
        return found.sentence

    def section(self, found: LeftOut, outcome: Outcome[Any], style: Style) -> Section:
        """By effect the changes of the steady state, the largest first."""
        kind, rows = kind_of(outcome.scene), list[Row]()
        shown = {q: word for q, (word, _) in kind.quantities(outcome.scene).items() if style.page or q in kind.shown}
        for name, each in found.every.items():
            cells = [difference_text(c.value, c.error, style.plus_minus) for q, c in each.changes.items() if q in shown]
            source = f"; {each.source}" * bool(each.source and style.page)
            rows.append(Row([name, *(cells or ["runs away"] * len(shown))], below=each.assumed + source))
        skipped = [f"{name} is not here: {why}" for name, why in found.skipped.items()]
        table = Table(("left out", *shown.values()), rows) if rows else ""
        said = "Changes of the 3D steady state with each effect, over that without." * bool(rows)
        return Section("What both models leave out", [table, said, sentences(skipped)])

    def document(self, found: LeftOut, outcome: Outcome[Any]) -> dict[str, Any]:
        return {
            name: {"assumed": each.assumed, "source": each.source}
            | {q: {"change": c.value, "error": c.error} for q, c in each.changes.items()}
            for name, each in found.every.items()
        }


def study(scene: Any, say: Callable[[str], None]) -> LeftOut:
    """Solve a sink or a device with each effect and with all; the first quantity ranks them.

    Raises RunawayError without a steady state, SceneError for a device that 3D does not take, and NumericsError.
    """
    sink = scene if scene.kind == "sink" else scene.sink
    say("without what is left out")
    bare, found, skipped = _solve(scene, sink), dict[str, Effect](), dict[str, str]()

    def add(name: str, effect: Effect) -> None:
        say(f"with what is left out: {effect.what}")
        try:
            steady = _solve(scene, replace(sink, **effect.changed))
            changes = {q: ratio(steady[q], bare[q]) for q in kind_of(scene).quantities(scene)}
        except RunawayError:
            changes = {}
        except (SceneError, NumericsError) as error:
            skipped[name] = str(error)
            return
        found[name] = replace(effect, changes=changes)

    for name, effect in effects(sink).items():
        if not effect.changed:
            skipped[name] = "the scene has it"
        elif name != "air" or scene.kind == "sink":  # Above the sink of a device is the polymer, not the air.
            add(name, effect)
    # A runaway is the largest of all.
    sizes = {n: abs(next(iter(e.changes.values())).value) if e.changes else math.inf for n, e in found.items()}
    ranked = {name: found[name] for name in sorted(found, key=lambda name: -sizes[name])}
    if len(ranked) > 1:
        everything = {key: value for each in ranked.values() for key, value in each.changed.items()}
        add(TOGETHER, Effect("all together", f"{', '.join(ranked)} at once", "", everything))
    return LeftOut(ranked, found.get(TOGETHER), skipped)


def _solve(scene: Any, sink: Sink) -> dict[str, Estimate]:
    """The steady quantities in 3D of a sink, or of a device with this sink."""
    if scene.kind == "sink":
        from fem3d.runs.sink import solve

        return solve(check(sink), transient=False).steady
    from fem3d.runs.device import model

    changed = check(replace(scene, sink=sink))
    states = model(changed, changed.accuracy_3d)
    steady, errors = states.steady(changed), states.steady_errors(changed)
    return {name: Estimate(getattr(steady, name), errors[name]) for name in kind_of(scene).quantities(scene)}
