"""Random scenes, their invariants and the table; each invariant sees the fault that it is there for."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compare.report.table import Style
from fem3d.runs.scene import start
from reduced1d.device.lumped import lump
from reduced1d.device.paper import stability_limit
from scenes import laws
from scenes.device import Device
from scenes.model import Boundary, Box, Material, Probe, Scene, Schedule
from validate.stress import (
    invariants,
    random_effects,
    random_laws,
    random_plates,
    random_scenes,
    report,
    steps,
    sweep,
)  # fmt: skip
from validate.stress.random_scenes import ROOM, Drawn, draw
from validate.stress.report import Row, failed

METAL = Material("metal", 100.0, 1000.0, 1000.0, 1e-6, 1e-3)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 10**6))
def test_random_scenes_are_heated_cooled_and_reproducible(seed):
    drawn = draw(seed)
    assert drawn == draw(seed)
    kinds = {b.kind for b in drawn.scene.boundaries}
    assert "temperature" in kinds
    assert drawn.heats
    assert ("voltage" in kinds) == ("current" in drawn.heats)
    for box in drawn.scene.boxes:
        assert all(low < high for low, high in zip(box.lower, box.upper, strict=True))
    for b in drawn.scene.boundaries:
        assert sum(low == high for low, high in zip(b.lower, b.upper, strict=True)) == 1


def test_all_kinds_of_scenes_are_drawn():
    scenes = [draw(seed).scene for seed in range(100)]
    names = [{b.name for b in s.boundaries} for s in scenes]
    assert sum(not s.steady for s in scenes) == 15
    assert any({"film", "back"} <= n for n in names)
    assert any(
        "plus" in n and "into plus" not in {p.name for p in s.probes} for n, s in zip(names, scenes, strict=True)
    )
    assert any(len({b.material for b in s.boxes if b.material.resistivity}) == 2 for s in scenes)
    for steady in (True, False):
        falling = [any(b.material.temperature_coefficient < 0 for b in s.boxes) for s in scenes if s.steady == steady]
        assert 0 < sum(falling) < len(falling) / 2


def bar(**changes):
    """A small heated bar with the probes of a random scene."""
    low, high = (0.0, 0.0, 0.0), (1e-5, 4e-5, 1e-6)
    ends = [((0.0, y, 0.0), (1e-5, y, 1e-6)) for y in (0.0, 4e-5)]
    boundaries = (
        Boundary("cold", "temperature", *ends[0], ROOM), Boundary("plus", "voltage", *ends[0], 0.05),
        Boundary("minus", "voltage", *ends[1], 0.0), Boundary("flux", "heat_flux", *ends[1], 1e6),
    )  # fmt: skip
    probes = [Probe("mean 0", low, high)]
    probes += [
        Probe(f"into {b.name}", b.lower, b.upper, "current" if b.kind == "voltage" else "heat_flow") for b in boundaries
    ]
    box = Box("bar", METAL, low, high, 1e12)
    return Drawn(0, replace(Scene("bar", (box,), boundaries, tuple(probes), ROOM, steady=True), **changes), ())


@pytest.mark.long
def test_a_bar_keeps_every_invariant():
    drawn = bar()
    found = invariants.solve(drawn.scene)
    for name, test in (invariants.ALWAYS | invariants.IN_TURN).items():
        assert test(drawn, found) <= 1.0, name
    violation, padding = invariants.compared(drawn, found, 10.0)
    assert violation <= 1.0 < padding
    # Half of the error stated is half of the padding.
    less = replace(found, steady={n: replace(e, error=e.error / 2) for n, e in found.steady.items()})
    assert invariants.compared(drawn, less, 10.0)[1] == pytest.approx(padding / 2)


def test_invariants_see_what_they_are_there_for():
    drawn = bar()
    found = invariants.solve(drawn.scene)
    stronger = replace(drawn.scene, boxes=(replace(drawn.scene.boxes[0], heat_source=1.01e12),))
    # The results of another scene: neither the balance nor any comparison holds.
    assert invariants.energy(Drawn(0, stronger, ()), found) > 1
    assert invariants.mirrored(Drawn(0, stronger, ()), found) > 1
    assert invariants.honest(Drawn(0, stronger, ()), found) > 1
    cooled = replace(drawn.scene, boxes=(replace(drawn.scene.boxes[0], heat_source=-3e13),))
    assert invariants.never_colder(drawn, invariants.solve(cooled)) > 1
    assert invariants.undershoot(drawn, invariants.solve(cooled)) > 1


@pytest.mark.long
def test_invariants_over_time_see_what_they_are_there_for():
    """A step of what heats the bar and of what cools it; the traces of another scene, and a balance that is off."""
    hot, cold = Schedule((0.0, 3e-6, 3e-6), (1e12, 1e12, -2e12)), Schedule((0.0, 5e-6, 5e-6), (ROOM, ROOM, ROOM + 5))
    steady = bar().scene
    boundaries = (replace(steady.boundaries[0], value=cold), steady.boundaries[3])
    scene = replace(
        steady, steady=False, accuracy=1e-2, end_time=1e-5, output_times=(2e-6, 6e-6, 1e-5), boundaries=boundaries,
        boxes=(replace(steady.boxes[0], heat_source=hot),), probes=(*steady.probes[:2], steady.probes[4]),
    )  # fmt: skip
    drawn = Drawn(0, scene, ())
    found = invariants.solve(scene)
    assert list(invariants.tests(drawn)) == ["energy closes over time", "traces mirrored and turned"]
    assert invariants.energy(drawn, found) <= 1
    assert invariants.honest(drawn, found) <= 1
    later = replace(boundaries[0], value=replace(cold, times=(0.0, 5.5e-6, 5.5e-6)))
    assert invariants.honest(Drawn(0, replace(scene, boundaries=(later, *boundaries[1:])), ()), found) > 1
    off = replace(found, details=found.details | {"energy_imbalance": 0.2})
    assert invariants.energy(drawn, off) > 1


def test_scenes_with_laws_hold_their_errors_and_a_law_that_is_off_is_seen():
    drawn = random_laws.draw_steady(4)
    assert drawn == random_laws.draw_steady(4)
    assert any(b.material.follows for b in drawn.scene.boxes)
    outcome = sweep.examine(4, kind="laws")
    assert outcome.ended == ""
    assert set(outcome.violations) == {*invariants.of_laws(drawn), "errors honoured by a finer solve"}
    assert max(outcome.violations.values()) <= 1.0
    found = invariants.solve(drawn.scene)
    warmer = replace(drawn.scene, boxes=tuple(replace(b, material=_raised(b.material)) for b in drawn.scene.boxes))
    assert invariants.honest(replace(drawn, scene=warmer), found) > 1.0


@pytest.mark.long
def test_some_scenes_with_laws_are_heated_over_time():
    drawn = random_laws.draw(2)
    assert not drawn.scene.steady
    assert random_laws.draw(4).scene.steady
    outcome = sweep.examine(2, kind="laws")
    assert (outcome.ended, set(outcome.violations)) == (
        "", {*invariants.of_laws(drawn), "traces honoured by a finer solve"}
    )  # fmt: skip
    assert max(outcome.violations.values()) <= 1.0
    warmer = replace(drawn.scene, boxes=tuple(replace(b, material=_raised(b.material)) for b in drawn.scene.boxes))
    assert invariants.honest(replace(drawn, scene=warmer), invariants.solve(drawn.scene)) > 1.0


def test_random_scenes_have_contacts_faces_that_radiate_and_given_currents():
    """A scene of all three keeps its balance, of which another current is no part."""
    drawn = random_effects.draw(17)
    scene, plus = drawn.scene, next(b for b in drawn.scene.boundaries if b.name == "plus")
    assert drawn == random_effects.draw(17)
    assert scene.contacts
    assert plus.key == "current"
    assert [b.kind for b in scene.boundaries if b.name == "radiant"] == ["radiation"]
    found = invariants.solve(scene)
    assert invariants.energy(drawn, found) <= 1
    volts = found.steady[random_scenes.AT_PLUS]
    stronger = {random_scenes.AT_PLUS: replace(volts, value=1.01 * volts.value)}
    assert invariants.energy(drawn, replace(found, steady=found.steady | stronger)) > 1


@pytest.mark.long
def test_a_plate_with_pads_holds_its_errors_and_a_pad_that_is_off_is_seen(monkeypatch):
    drawn = random_plates.draw(10, accuracy=8e-2)
    assert drawn == random_plates.draw(10, accuracy=8e-2)
    assert start(drawn.scene)[1].whole  # on tetrahedra
    monkeypatch.setattr(random_plates, "draw", lambda seed: drawn)
    outcome = sweep.examine(10, kind="plates")
    assert (outcome.ended, set(outcome.violations)) == (
        "", {*invariants.of_plates(drawn), "errors honoured by a finer solve"}
    )  # fmt: skip
    assert max(outcome.violations.values()) <= 1.0
    hotter = invariants.changed(drawn.scene, {"heat_source": 1.2})
    assert invariants.honest(replace(drawn, scene=hotter), invariants.solve(drawn.scene), times=1.0) > 1.0


def test_a_larger_scene_is_as_hot():
    scene = random_laws.draw_steady(4).scene
    one, two = invariants.solve(scene).steady, invariants.solve(random_effects.larger(scene, 100.0)).steady
    for name in (n for n in one if n.startswith("mean")):
        assert abs(one[name].value - two[name].value) < one[name].error


def _raised(material):
    """The material with 5 % more of a conductivity that follows the temperature."""
    k = material.thermal_conductivity
    if isinstance(k, laws.PowerLaw):
        return replace(material, thermal_conductivity=replace(k, value=1.05 * k.value))
    if isinstance(k, laws.Table):
        return replace(material, thermal_conductivity=replace(k, values=tuple(1.05 * v for v in k.values)))
    return material


@pytest.mark.long
def test_a_scene_that_takes_too_long_or_fails_is_an_outcome(monkeypatch):
    def slow(scene):
        while True:
            np.linalg.eigvalsh(np.eye(50))

    monkeypatch.setattr(invariants, "solve", slow)
    assert sweep.examine(1, limit=1).ended == "out of time"

    def broken(scene):
        raise ValueError("no luck")

    monkeypatch.setattr(invariants, "solve", broken)
    assert sweep.examine(1).said == "ValueError: no luck"
    outcomes = [sweep.Outcome(0, {"energy closes": 0.5}, padding=7.0),
                sweep.Outcome(1, ended="error", said="ValueError: no luck"),
                sweep.Outcome(2, {"energy closes": float("nan")}, padding=4.0), sweep.Outcome(3, padding=np.inf),
                sweep.Outcome(4, ended="refused by name", seconds=2.0)]  # fmt: skip
    found = {row.what: row for row in sweep.rows(outcomes)}
    assert found["energy closes"].verdict == "breaks"
    assert found["ended with an error"].verdict == "breaks"
    assert "no luck" in found["ended with an error"].said
    padding = found["stated over true error of the reading that is off most"]
    assert padding.worst == 0.0  # of two the middle may be anywhere
    assert padding.said.startswith("median 5.5,")
    assert found["refused after more than 1 s"].said == "seeds 4"


@pytest.mark.parametrize(("count", "surely"), [(1, 0.0), (3, 0.0), (4, 1.0), (100, 41.0)])
def test_a_median_is_more_than_what_its_count_makes_sure(count, surely):
    """Of 100 values the middle one is known to ten places, of fewer than four not at all."""
    outcomes = [sweep.Outcome(seed, padding=1.0 + seed) for seed in range(count)]
    found = {row.what: row.worst for row in sweep.rows(outcomes)}
    assert found["stated over true error of the reading that is off most"] == surely


def test_only_methods_that_are_not_l_stable_ring():
    verdicts = {row.what: row.verdict for row in steps.rows()}
    assert verdicts["exponential collocation"] == "holds"
    assert verdicts["SDIRK of order 3 (second path)"] == "holds"
    assert verdicts["Crank-Nicolson"] == "as predicted"


def test_the_predicted_limit_of_the_explicit_coupling_is_where_a_simulation_starts_to_grow():
    device = Device()
    limit, scheme = stability_limit(device), steps.PaperScheme()
    assert not steps.grows(lump(device), 0.98 * limit, scheme)
    assert steps.grows(lump(device), 1.02 * limit, scheme)


def test_the_table_names_what_breaks():
    rows = [Row("g", "a", "x", "m", 0.5, 1.0), Row("g", "b", "x", "m", 2.0, 1.0, said="at seed 3"),
            Row("g", "CN", "x", "m", 2.0, 1.0, ours=False), failed("g", "c", ValueError("no luck"))]  # fmt: skip
    assert [row.verdict for row in rows] == ["holds", "breaks", "as predicted", "failed"]
    text = report.TABLE.text(rows, Style())
    assert text.startswith("1 of 4 rows hold, 1 break as predicted, 2 break.")
    assert "at seed 3" in text
    assert "no luck" in text
    assert "| breaks | at seed 3 |" in report.TABLE.markdown(rows, {})
