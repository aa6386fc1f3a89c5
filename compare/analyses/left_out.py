"""Effects that both models leave out: solve in 3D without them, with each one, and with all of them.

A *change* is a quantity with the effect over the quantity without, less one. Both steady states have the accuracy
`CLOSE` or better. The difference of ``together`` from the sum of all changes is their interaction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from compare.analyses.base import Analysis
from compare.kinds import kind_of
from compare.outcome import Outcome, Progress
from compare.report.table import Row, Section, Style, Table, sentences
from scenes import laws
from scenes.errors import NumericsError, RunawayError, SceneError
from scenes.formats import difference_text, percent, quantity
from scenes.sink import OF_A_SINK, Sink
from scenes.units import THERMAL_CONTACT

if TYPE_CHECKING:
    from scenes.device import Device
    from scenes.result import Estimate, Result

CLOSE = 1e-4
"""Both solutions have this accuracy or a better one, as the smallest effects are half a percent."""
ALL = 1e-3
"""Accuracy of the solution with all effects: the gas leaves a tenth of the rise, so that the change is as accurate."""
TOGETHER = "together"
RANKED = "peak_rise_K"
MOST_OF_IT = 0.5
"""An effect that takes more than this part of the heat leaves no heat sink of this kind."""
GAS_CONSTANT, TEMPERATURE, RATIO, HEAT = 287.05, 300.0, 1.4, 718.0
"""Air: specific gas constant (J/(kg K)), temperature (K), ratio of specific heats there, and c_v (J/(kg K))."""
JUMP = "at less pressure Smoluchowski's jump of the temperature: Kennard, Kinetic Theory of Gases (1938), chapter 8"
KNOWN, MOST_TRIALS = 1e-2, 6
"""Relative tolerance of the peak's change at the pressure that is searched, and the most trials."""


@dataclass(frozen=True)
class Effect:
    """An effect: its name in a sentence (``what``), the ``source`` of its magnitude, and functions of a sink.

    ``assumed`` describes the magnitude, ``changed`` gives the keywords of the sink with the effect; none where the sink
    has the effect.
    """

    what: str
    source: str
    assumed: Callable[[Sink], str]
    changed: Callable[[Sink], dict[str, Any]]


CONDUCTIVITY = 0.0263
"""W/(m K) of air at 300 K, within a percent (Carroll et al., J. Chem. Eng. Data 13, 1968: 0.0264 at 25 C)."""
CONTACT = 2e-8
"""m2 K/W, at each face of an oxide."""
EMISSIVITY = 0.7
EXPONENT = -1.3
"""Silicon's conductivity falls as this power of the temperature from 300 to 1400 K, within a tenth."""


def conduction(sink: Sink) -> float:
    """The film coefficient (W/(m2 K)) of air at rest above the beam.

    Air conducts from one side of a thin plate, L long and w wide, with the shape factor pi L / ln(4 L / w) (Holman,
    Heat Transfer, chapter 3: a plate in the surface of a half space).
    """
    long, short = sorted((sink.row_length, sink.width), reverse=True)
    return math.pi * CONDUCTIVITY / (short * math.log(4 * long / short))


def _falling(sink: Sink) -> dict[str, Any]:
    """The keywords of a sink whose silicon's conductivity falls from its value at room temperature."""
    conductivity = sink.silicon.thermal_conductivity
    if laws.varies(conductivity):
        return {}
    conductivities = [laws.PowerLaw(k, sink.room_temperature, EXPONENT) for k in laws.along(conductivity)]
    return {
        "silicon": replace(
            sink.silicon,
            thermal_conductivity=tuple(conductivities) if isinstance(conductivity, tuple) else conductivities[0],
        )
    }


EFFECTS = {
    "conductivity": Effect(
        "silicon's falling conductivity",
        "Glassbrenner and Slack, Phys. Rev. 134, A1058 (1964)",
        lambda sink: f"that of room temperature times (T/{sink.room_temperature:g} K)^{EXPONENT:g}",
        _falling,
    ),
    "contact": Effect(
        "the contacts of the oxide",
        "of films of SiO2 on silicon: Lee and Cahill, J. Appl. Phys. 81, 2590 (1997)",
        lambda sink: f"{THERMAL_CONTACT.show(CONTACT)} at both faces of the oxide",
        lambda sink: {} if sink.contact_resistance is not None else {"contact_resistance": CONTACT},
    ),
    "gap_gas": Effect(
        "the gas under it",
        "air at 300 K: Carroll et al., J. Chem. Eng. Data 13 (1968)",
        lambda sink: f"{CONDUCTIVITY:g} W/(m K) under beam and pads, {1e6 * sink.oxide_thickness:.3g} um high",
        lambda sink: {} if sink.gap_gas_conductivity else {"gap_gas_conductivity": CONDUCTIVITY},
    ),
    "radiation": Effect(
        "radiation",
        "silicon has 0.42 to 0.78 from 880 to 1550 K: Jain et al., J. Phys. D 4, 1207 (1971)",
        lambda sink: f"emissivity {EMISSIVITY:g} of all bare faces of beam and pads",
        lambda sink: {} if sink.emissivity else {"emissivity": EMISSIVITY},
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
"""The effects by name, as summary.json has them."""
IN_AIR = ("gap_gas", "air")
"""Effects that are absent in a vacuum."""


@dataclass(frozen=True)
class Found:
    """The result of an effect: by quantity the ``changes``, empty where the sink runs away.

    ``assumed`` and ``source`` are of its magnitude; ``share`` is the part of the heat that a gas takes.
    """

    what: str
    assumed: str
    source: str
    changes: dict[str, Estimate]
    share: float | None = None


@dataclass(frozen=True)
class LeftOut:
    """The effects, the largest first, and all ``together``.

    ``sum`` adds the changes of each quantity, ``skipped`` has reasons, ``sentence`` names the largest effects, and
    ``called`` the quantities' words.
    """

    effects: dict[str, Found]
    together: Found | None
    sum: dict[str, float]
    skipped: dict[str, str]
    sentence: str
    called: dict[str, str]


class LeftOutStudy(Analysis[LeftOut]):
    name, figure_name, leads = "left_out", "left_out", True
    about = "3D again with each effect that both models leave out, and with all"

    def run(self, outcome: Outcome[Any], progress: Progress) -> LeftOut:
        with progress.stage("left out"):
            return (of_sink if outcome.scene.kind == "sink" else of_device)(outcome.scene, progress)

    def sentence(self, found: LeftOut, outcome: Outcome[Any]) -> str:
        return found.sentence

    def section(self, found: LeftOut, outcome: Outcome[Any], style: Style) -> Section:
        """By effect the changes of the steady state, the largest first."""
        shown = [q for q in found.called if style.page or q in kind_of(outcome.scene).shown]

        def row(called: str, each: Found) -> Row:
            if not each.changes:
                return Row([called, *["runs away"] * len(shown)], below=each.assumed)
            cells = (difference_text(c.value, c.error, style.plus_minus) for c in (each.changes[q] for q in shown))
            said = f"{each.assumed}; {each.source}" if each.source and style.page else each.assumed
            return Row([called, *cells], below=said)

        rows = [row(name.replace("_", " "), each) for name, each in found.effects.items()]
        if found.together is not None:
            rows.append(row(TOGETHER, found.together))
            rows.append(Row(["their sum", *(percent(found.sum[q], sign=True) for q in shown)]))
        skipped = [f"{name.replace('_', ' ')} is not here: {why}" for name, why in found.skipped.items()]
        parts: list[Table | str | Sequence[str]] = []
        if rows:
            parts.append(Table(("left out", *(found.called[q] for q in shown)), rows))
            parts.append("Changes of the 3D steady state with each effect, over that without.")
        return Section("What both models leave out", [*parts, sentences(skipped)])

    def document(self, found: LeftOut, outcome: Outcome[Any]) -> dict[str, Any]:
        def entry(each: Found) -> dict[str, Any]:
            changes = {name: {"change": c.value, "error": c.error} for name, c in each.changes.items()}
            return {"assumed": each.assumed, "source": each.source, **changes}

        together = {} if found.together is None else {TOGETHER: found.together}
        return {name: entry(each) for name, each in (found.effects | together).items()}


@dataclass(frozen=True)
class _Subject:
    """What effects are asked of: a ``sink``, how another sink in its place is solved (``solve``), by quantity what that
    is ``called``, which they are ``ranked`` by, and the ``effects``."""

    sink: Sink
    solve: Callable[[Sink], Result]
    called: dict[str, str]
    ranked: str
    effects: dict[str, Effect]

    def changes(self, bare: Result, with_it: Result) -> dict[str, Estimate]:
        """By quantity the change from one result to another."""
        from compare.verdict import relative, spread
        from scenes.result import Estimate

        changes = {}
        for name in self.called:
            inputs = {"predicted": with_it.steady[name], "measured": bare.steady[name]}
            changes[name] = Estimate(relative(*(e.value for e in inputs.values())), spread(relative, inputs))
        return changes


def of_sink(sink: Sink, say: Callable[[str], None]) -> LeftOut:
    """Compute the change of a sink by each effect. Raises RunawayError without a steady state."""
    from fem3d.runs.sink import solve as solve_3d
    from scenes.validity import check

    called = {each.steady: each.called for each in OF_A_SINK.values()}
    close = replace(sink, accuracy=min(sink.accuracy, CLOSE))
    return _study(_Subject(close, lambda other: solve_3d(check(other), transient=False), called, RANKED, EFFECTS), say)


def of_device(device: Device, say: Callable[[str], None]) -> LeftOut:
    """Compute the change of a device by each effect; the polymer is above the sink, not the air.

    Raises SceneError for a device that 3D does not take, ArithmeticError where the numerics fail.
    """
    from fem3d.device.solve import model
    from reduced1d.slopes import OF_DEVICE
    from scenes.result import Estimate, Result
    from scenes.validity import check

    def solve(sink: Sink) -> Result:
        changed = check(replace(device, sink=sink))
        states = model(changed, changed.accuracy_3d)
        steady, errors = states.steady(changed), states.steady_errors(changed)
        return Result("fem3d", {name: Estimate(getattr(steady, name), errors[name]) for name in OF_DEVICE}, None, {})

    effects = {name: effect for name, effect in EFFECTS.items() if name != "air"}
    return _study(_Subject(device.sink, solve, dict(OF_DEVICE), "sink_power_W", effects), say)


def _study(subject: _Subject, say: Callable[[str], None]) -> LeftOut:
    sink = subject.sink
    say("without what is left out")
    bare = subject.solve(sink)
    effects: dict[str, Found] = {}
    skipped: dict[str, str] = {}
    everything: dict[str, Any] = {"accuracy": max(sink.accuracy, ALL)}
    for number, (name, effect) in enumerate(subject.effects.items(), 1):
        changed = effect.changed(sink)
        if not changed:
            skipped[name] = "the scene has it"
            continue
        say(f"with what is left out, {number} of {len(subject.effects)}: {effect.what}")
        try:
            effects[name] = _effect_of(subject, effect.what, effect.assumed(sink), effect.source, bare, changed)
            if name == "gap_gas" and subject.ranked == RANKED:
                say(f"from which pressure on {effect.what} matters")
                effects[name] = _with_pressure(subject, effects[name], bare)
        except (SceneError, NumericsError) as error:
            skipped[name] = str(error)
            continue
        everything |= changed
    together = None
    if len(effects) > 1:
        say("with all of that together")
        try:
            together = _effect_of(subject, "all together", f"{', '.join(effects)} at once", "", bare, everything)
        except (SceneError, NumericsError) as error:
            skipped[TOGETHER] = str(error)

    def size(each: Found) -> float:
        return abs(each.changes[subject.ranked].value) if each.changes else math.inf

    ranked = dict(sorted(effects.items(), key=lambda item: -size(item[1])))
    added = {q: sum(f.changes[q].value for f in effects.values() if f.changes) for q in subject.called}
    return LeftOut(ranked, together, added, skipped, _sentence(subject, ranked), subject.called)


def _effect_of(
    subject: _Subject, what: str, assumed: str, source: str, bare: Result, changed: dict[str, Any]
) -> Found:  # fmt: skip
    try:
        with_it = subject.solve(replace(subject.sink, **changed))
    except RunawayError:
        return Found(what, assumed, source, {})
    return Found(what, assumed, source, subject.changes(bare, with_it), _share(with_it))


def _share(with_it: Result) -> float | None:
    if "answer" not in with_it.details:
        return None
    flows = with_it.details["answer"].fine.out
    gas = [float(flow) for name, flow in flows.items() if name.startswith("flow:substrate-gas")]
    return -sum(gas) / float(flows["power"]) if gas else None


def _with_pressure(subject: _Subject, effect: Found, bare: Result) -> Found:
    sink, change = subject.sink, effect.changes
    tolerance = sink.tolerance("fig4")
    if not change or abs(change[RANKED].value) <= tolerance:
        return replace(effect, assumed=f"{effect.assumed}; within {percent(tolerance)} at any pressure")
    wanted, k, size = -tolerance, CONDUCTIVITY, change[RANKED].value
    for _ in range(MOST_TRIALS):
        # One over the peak, over that without gas, less one, goes with k where that is little.
        k *= (1 / (1 + wanted) - 1) / (1 / (1 + size) - 1)
        size = subject.changes(bare, subject.solve(replace(sink, gap_gas_conductivity=k)))[RANKED].value
        if abs(size / wanted - 1) < KNOWN:
            break
    pressure = 2 * jump(1.0) / sink.oxide_thickness / (CONDUCTIVITY / k - 1)
    when = f"from {quantity(pressure, 'Pa', 2)} on it changes the peak by more than {percent(tolerance)}"
    return replace(effect, assumed=f"{effect.assumed}; {when}", source=f"{effect.source}; {JUMP}")


def jump(pressure: float) -> float:
    """Smoluchowski's distance g (m) at a pressure (Pa): at a wall the temperature of air jumps by g dT/dn, with g =
    sqrt(2 pi R T) / ((gamma + 1) c_v) k / p for molecules that leave at its temperature (Kennard, Kinetic Theory of
    Gases, 1938, chapter 8); at low pressure that is Knudsen's conduction."""
    return math.sqrt(2 * math.pi * GAS_CONSTANT * TEMPERATURE) / ((RATIO + 1) * HEAT) * CONDUCTIVITY / pressure


def _sentence(subject: _Subject, ranked: dict[str, Found]) -> str:
    if not ranked:
        return "Of what both models leave out the scene has all that can be solved."
    said = []
    for where, inside in (("In air", True), ("In vacuum", False)):
        effects = [each for name, each in ranked.items() if (name in IN_AIR) is inside]
        if effects:
            said.append(f"{where} {_does(subject, effects[0], len(effects))}.")
    return " ".join(said)


def _does(subject: _Subject, effect: Found, count: int) -> str:
    if not effect.changes:
        return f"{effect.what} makes it run away"
    if effect.share is not None and effect.share > MOST_OF_IT:
        return f"the sink would not work: {effect.what} takes {percent(effect.share)} of the heat"
    change = percent(effect.changes[subject.ranked].value, sign=True)
    peak = subject.ranked == RANKED
    if count > 1:
        return f"{effect.what} matters most, {change} {'at the peak' if peak else 'of the power that the sink takes'}"
    return f"{effect.what} changes {'the peak' if peak else 'the power that the sink takes'} by {change}"
