"""Effects that both models of a sink leave out: solve in 3D without them, with each one, and with all of them.

A *change* is a quantity with the effect over the quantity without, less one.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from compare.analyses.base import Analysis
from compare.outcome import Outcome, Progress
from compare.report import Row, Section, Style, Table, sentences
from compare.verdict import ratio
from scenes import laws
from scenes.errors import NumericsError, RunawayError, SceneError
from scenes.formats import difference_text
from scenes.result import Estimate
from scenes.sink import OF_A_SINK, Sink
from scenes.units import THERMAL_CONTACT
from scenes.validity import check

CONDUCTIVITY = 0.0263
"""W/(m K) of air at 300 K, within a percent (Carroll et al., J. Chem. Eng. Data 13, 1968: 0.0264 at 25 C)."""


@dataclass(frozen=True)
class Effect:
    """An effect that a sink may leave out: the assumed magnitude and its source, and the keywords of a sink with it.

    ``changes`` are the relative changes by quantity; empty where the sink runs away.
    """

    assumed: str
    source: str
    changed: dict[str, Any]
    changes: dict[str, Estimate] = field(default_factory=dict)


def effects(sink: Sink) -> dict[str, Effect]:
    """Return the effects by their names in summary.json.

    Air at rest conducts from one side of a thin plate, L long and w wide, with the shape factor pi L / ln(4 L / w)
    (Holman, Heat Transfer, chapter 3: a plate in the surface of a half space).
    """
    short, long = sorted((sink.row_length, sink.width))
    film = math.pi * CONDUCTIVITY / (short * math.log(4 * long / short))
    given, contact, emissivity, exponent = sink.silicon.thermal_conductivity, 2e-8, 0.7, -1.3
    falling = [k if laws.varies(k) else laws.PowerLaw(k, sink.room_temperature, exponent) for k in laws.along(given)]
    law = tuple(falling) if isinstance(given, tuple) else falling[0]
    return {
        "conductivity": Effect(
            f"that of room temperature times (T/{sink.room_temperature:g} K)^{exponent:g}",
            "Glassbrenner and Slack, Phys. Rev. 134, A1058 (1964)",
            {"silicon": replace(sink.silicon, thermal_conductivity=law)},
        ),
        "contact": Effect(
            f"{THERMAL_CONTACT.show(contact)} at both faces of the oxide",
            "of films of SiO2 on silicon: Lee and Cahill, J. Appl. Phys. 81, 2590 (1997)",
            {"contact_resistance": contact},
        ),
        "gap_gas": Effect(
            f"{CONDUCTIVITY:g} W/(m K) under beam and pads, {1e6 * sink.oxide_thickness:.3g} um high",
            "air at 300 K: Carroll et al., J. Chem. Eng. Data 13 (1968)", {"gap_gas_conductivity": CONDUCTIVITY},
        ),
        "radiation": Effect(
            f"emissivity {emissivity:g} of all bare faces of beam and pads",
            "silicon has 0.42 to 0.78 from 880 to 1550 K: Jain et al., J. Phys. D 4, 1207 (1971)",
            {"emissivity": emissivity},
        ),
        "substrate": Effect(
            "a plate of silicon, 0.5 mm thick and 3 mm x 3 mm, under the oxide",
            "525 um is the thickness of wafers of 100 mm (SEMI M1)", {"substrate_thickness": 0.5e-3},
        ),
        "air": Effect(
            f"{film:.3g} W/(m2 K) from the top of beam and pads",
            "conduction of air at rest from one side of a thin plate: Holman, Heat Transfer, chapter 3",
            {"convection_coefficient": film},
        ),
    }  # fmt: skip


class LeftOut(NamedTuple):
    """The effects, the largest first, then all ``together``, and by name why others are ``skipped``."""

    effects: dict[str, Effect]
    skipped: dict[str, str]


class LeftOutStudy(Analysis[LeftOut]):
    name = "left_out"
    about = "3D again with each effect that both models leave out, and with all"

    def run(self, outcome: Outcome[Any], progress: Progress) -> LeftOut:
        from fem3d.runs.sink import solve

        sink, without, found, skipped = outcome.scene, outcome.solved.steady, dict[str, Effect](), dict[str, str]()

        def add(name: str, effect: Effect) -> None:
            progress(f"with what is left out: {name}")
            try:
                with_it = solve(check(replace(sink, **effect.changed)), transient=False).steady
                changes = {e.steady: ratio(with_it[e.steady], without[e.steady]) for e in OF_A_SINK.values()}
                found[name] = replace(effect, changes=changes)
            except RunawayError:
                found[name] = effect
            except (SceneError, NumericsError) as error:
                skipped[name] = str(error)

        for name, effect in effects(sink).items():
            (key,) = effect.changed
            if getattr(sink, key) and (key != "silicon" or laws.varies(sink.silicon.thermal_conductivity)):
                skipped[name] = "the scene has it"
            else:
                add(name, effect)
        # By the change of the peak; a runaway is the largest of all.
        size = {n: abs(e.changes["peak_rise_K"].value) if e.changes else math.inf for n, e in found.items()}
        found = {name: found[name] for name in sorted(found, key=lambda name: -size[name])}
        if len(found) > 1:
            everything = {key: value for each in found.values() for key, value in each.changed.items()}
            add("together", Effect(f"{', '.join(found)} at once", "", everything))
        return LeftOut(found, skipped)

    def section(self, found: LeftOut, outcome: Outcome[Any], style: Style) -> Section:
        """By effect the changes of the steady state, the largest first."""
        rows = list[Row]()
        shown = [entry for name, entry in OF_A_SINK.items() if style.page or name in ("peak", "end", "current")]
        for name, each in found.effects.items():
            known = [each.changes[entry.steady] for entry in shown if each.changes]
            cells = [difference_text(c.value, c.error, style.plus_minus) for c in known]
            source = f"; {each.source}" * bool(each.source and style.page)
            rows.append(Row([name, *(cells or ["runs away"] * len(shown))], below=each.assumed + source))
        skipped = [f"{name} is not here: {why}" for name, why in found.skipped.items()]
        table = Table(("left out", *(entry.called for entry in shown)), rows) if rows else ""
        said = "Changes of the 3D steady state with each effect, over that without." * bool(rows)
        return Section("What both models leave out", [table, said, *sentences(skipped)])

    def enter(self, summary: dict[str, Any], found: LeftOut, outcome: Outcome[Any]) -> None:
        summary["left_out"] = {
            name: {"assumed": each.assumed, "source": each.source}
            | {q: {"change": c.value, "error": c.error} for q, c in each.changes.items()}
            for name, each in found.effects.items()
        }
