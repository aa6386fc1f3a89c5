"""Random scenes, their invariants and bars of random laws; entries in processes of their own, and the programs that are
compared. Each invariant sees the fault that it is there for."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks import bars, bench, invariants, measure, programs, random_scenes, sdirk, stress
from benchmarks.measure import Entry
from benchmarks.random_scenes import ROOM
from fem3d.runs.scene import solve
from scenes.laws import PowerLaw, Table
from scenes.model import Boundary, Box, Material, Probe, Scene, Schedule
from scenes.sink import SILICON

METAL = Material("metal", 100.0, 1000.0, 1000.0, 1e-6, 1e-3)


def test_random_boxes_are_of_all_kinds_heated_cooled_and_reproducible():
    scenes = [random_scenes.boxes(seed) for seed in range(60)]
    assert scenes == [random_scenes.boxes(seed) for seed in range(60)]
    names = [{b.name for b in scene.boundaries} for scene in scenes]
    for scene, of in zip(scenes, names, strict=True):
        assert "cold" in of
        assert {"plus", "flux"} & of or any(box.heat_source for box in scene.boxes)
        for box in scene.boxes:
            assert all(low < high for low, high in zip(box.lower, box.upper, strict=True))
        for b in scene.boundaries:
            assert sum(low == high for low, high in zip(b.lower, b.upper, strict=True)) == 1
    assert sum(not scene.steady for scene in scenes) == 9
    assert {"film", "plus", "flux"} <= set.union(*names)
    inner = [scene for scene, of in zip(scenes, names, strict=True)
             if "plus" in of and "into plus" not in {p.name for p in scene.probes}]  # fmt: skip
    assert inner
    falling = [any(box.material.temperature_coefficient < 0 for box in scene.boxes) for scene in scenes]
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
    return replace(Scene("bar", (box,), boundaries, tuple(probes), ROOM, steady=True), **changes)


@pytest.mark.long
def test_a_bar_keeps_every_invariant():
    scene = bar()
    found = invariants.solve(scene)
    for name, test in (invariants.ALWAYS | invariants.IN_TURN).items():
        assert test(scene, found) <= 1.0, name
    violation, padding = invariants.compared(scene, found, 10.0)
    assert violation <= 1.0 < padding
    # Half of the error stated is half of the padding.
    less = replace(found, steady={n: replace(e, error=e.error / 2) for n, e in found.steady.items()})
    assert invariants.compared(scene, less, 10.0)[1] == pytest.approx(padding / 2)


def test_invariants_see_what_they_are_there_for():
    scene = bar()
    found = invariants.solve(scene)
    stronger = replace(scene, boxes=(replace(scene.boxes[0], heat_source=1.01e12),))
    # The results of another scene: neither the balance nor any comparison holds.
    assert invariants.energy(stronger, found) > 1
    assert invariants.mirrored(stronger, found) > 1
    assert invariants.compared(stronger, found, 10.0)[0] > 1
    cooled = replace(scene, boxes=(replace(scene.boxes[0], heat_source=-3e13),))
    assert invariants.never_colder(scene, invariants.solve(cooled)) > 1
    assert invariants.undershoot(scene, invariants.solve(cooled)) > 1


@pytest.mark.long
def test_invariants_over_time_see_what_they_are_there_for():
    """A step of the heating and of the cooling; the traces of another scene, and a balance with an error."""
    hot, cold = Schedule((0.0, 3e-6, 3e-6), (1e12, 1e12, -2e12)), Schedule((0.0, 5e-6, 5e-6), (ROOM, ROOM, ROOM + 5))
    steady = bar()
    boundaries = (replace(steady.boundaries[0], value=cold), steady.boundaries[3])
    scene = replace(
        steady, steady=False, accuracy=1e-2, end_time=1e-5, output_times=(2e-6, 6e-6, 1e-5), boundaries=boundaries,
        boxes=(replace(steady.boxes[0], heat_source=hot),), probes=(*steady.probes[:2], steady.probes[4]),
    )  # fmt: skip
    found = invariants.solve(scene)
    assert list(stress.KINDS["boxes"].tests(scene, 0)) == ["energy closes over time", "mirrored and turned"]
    assert invariants.energy(scene, found) <= 1
    assert invariants.compared(scene, found, 10.0)[0] <= 1
    later = replace(boundaries[0], value=replace(cold, times=(0.0, 5.5e-6, 5.5e-6)))
    assert invariants.compared(replace(scene, boundaries=(later, *boundaries[1:])), found, 10.0)[0] > 1
    off = replace(found, details=found.details | {"energy_imbalance": 0.2})
    assert invariants.energy(scene, off) > 1


@pytest.mark.long
def test_random_scenes_have_contacts_faces_that_radiate_and_given_currents():
    """A scene with all three keeps its balance; another current breaks it."""
    scene = random_scenes.laws(13)
    plus = next(b for b in scene.boundaries if b.name == "plus")
    assert scene == random_scenes.laws(13)
    assert scene.contacts
    assert plus.key == "current"
    assert [b.kind for b in scene.boundaries if b.name == "radiant"] == ["radiation"]
    found = invariants.solve(scene)
    assert invariants.energy(scene, found) <= 1
    volts = found.steady[random_scenes.AT_PLUS]
    stronger = {random_scenes.AT_PLUS: replace(volts, value=1.01 * volts.value)}
    assert invariants.energy(scene, replace(found, steady=found.steady | stronger)) > 1


@pytest.mark.long
def test_a_scene_that_takes_too_long_or_fails_is_an_outcome(monkeypatch):
    def slow(scene):
        while True:
            np.linalg.eigvalsh(np.eye(50))

    monkeypatch.setattr(invariants, "solve", slow)
    assert stress.examine(1, "boxes", limit=1).ended == "out of time"

    def broken(scene):
        raise ValueError("no luck")

    monkeypatch.setattr(invariants, "solve", broken)
    assert stress.examine(1, "boxes").why == "ValueError: no luck"
    outcomes = [stress.Outcome(0, {"energy closes": 0.5}, padding=7.0),
                stress.Outcome(1, ended="error", why="ValueError: no luck"),
                stress.Outcome(2, {"energy closes": float("nan")}, padding=4.0),
                stress.Outcome(4, ended="refused by name", seconds=2.0)]  # fmt: skip
    rows = list(stress.rows(outcomes, "a group", 5.0))
    (energy,) = [row for row in rows if row.case.startswith("energy closes")]
    (error,) = [row for row in rows if row.case.startswith("error,")]
    assert energy.verdict == error.verdict == "differs"
    assert energy.note == "violated by 1 of 2: seeds 2"
    assert "no luck" in error.note
    (padding,) = [row for row in rows if row.case.startswith("error bound over")]
    assert padding.found == 0.0  # of two the middle may be anywhere
    assert padding.note.startswith("median 5.5,")


@pytest.mark.parametrize("kind", stress.KINDS)
def test_a_scene_of_each_kind_keeps_its_invariants_and_its_errors_hold(kind):
    seed = {"boxes": 3, "laws": 4, "plates": 4, "meshes": 5}[kind]
    scene = stress.KINDS[kind].draw(seed)
    assert scene == stress.KINDS[kind].draw(seed)
    outcome = stress.examine(seed, kind)
    assert outcome.ended == ""
    assert {*stress.KINDS[kind].tests(scene, seed)} <= {*outcome.violations}
    assert any("honoured by a finer solve" in name for name in outcome.violations)
    assert max(outcome.violations.values()) <= 1.0


def test_scenes_of_the_hold_out_are_reported_apart(monkeypatch):
    monkeypatch.setattr(stress, "examine", lambda seed, kind: stress.Outcome(seed, {"energy closes": 0.5}))
    for part in ("extremes", "bars"):
        for name in ("rows", "families", "runaway", "drives"):
            monkeypatch.setattr(getattr(stress, part), name, lambda *_: iter(()), raising=False)
    rows = stress.run(True, 4, 0, 1, lambda _: None)
    cases = {row.group: row.case for row in rows if row.case.startswith("energy")}
    assert "seeds 0 to 1" in cases["random scenes"]
    assert "seeds 1000000 to 1000001" in cases["random scenes, hold-out"]


def test_a_worker_reports_its_time_and_numbers():
    answer = measure.once(Entry("1D", "", partial(programs.own, "paper", True)), 10.0)
    assert len(answer["seconds"]) == measure.MOST
    assert all(len(answer["values"][q]) == len(programs.TIMES) for q in programs.QUANTITIES)


def test_an_entry_that_fails_tells_which_and_why():
    with pytest.raises(measure.EntryError, match=r"a tool \(some settings\) failed: TypeError"):
        measure.once(Entry("a tool", "some settings", programs.own))


@pytest.mark.parametrize("transient", [False, pytest.param(True, marks=pytest.mark.long)])
def test_the_plain_program_converges_to_this_toolkit(transient):
    made = [programs.own("3d", transient, 1e-4), *(programs.plain(transient, first, 4, 2) for first in (3e-5, 8e-6))]
    ours, rough, fine = (read(solve()) for solve, read in made)
    errors = [bench.error_of(each["values"], ours["values"]) for each in (rough, fine)]
    assert errors[1] < errors[0] < 1e-2
    assert errors[1] < 1e-3
    assert ours["bound"] < 1e-4


class Forced:
    """y' = -y^2 + cos t from rest, and t' = 1."""

    mass, stiffness, size = np.eye(2), np.zeros((2, 2)), 2

    def load(self, state):
        return np.array([np.cos(state[1]) - state[0] ** 2, 1.0])

    def factors(self, mass, stiffness):
        return lambda load: load / mass


def test_the_method_in_time_has_its_order_and_a_wrong_weight_has_not(monkeypatch):
    exact = solve_ivp(lambda t, y: np.cos(t) - y**2, (0, 1), [0.0], "DOP853", rtol=1e-13, atol=1e-14).y[0, -1]

    def observed():
        ends = [list(sdirk.march(Forced(), np.linspace(0, 1, n + 1), 1e-14))[-1][0] for n in (20, 40)]
        coarse, fine = np.abs(np.array(ends) - exact)
        return np.log2(coarse / fine)

    assert abs(observed() - sdirk.ORDER) < 0.25
    *stages, (first, *rest) = sdirk.TABLEAU
    monkeypatch.setattr(sdirk, "TABLEAU", (*stages, (first + 1e-2, *rest)))
    assert observed() < 1.2


def test_the_peak_of_a_constant_and_of_an_inverse_square_is_known():
    """With rho_0 (T0/T)^2 the integral from T0 is rho_0 T0 (1 - T0/T): it ends at rho_0 T0."""
    constant = PowerLaw(6e-5, bars.ROOM, 0.0)
    assert bars.peak(constant, 130.0, 1.0) == pytest.approx(bars.ROOM + 1 / (8 * 130 * 6e-5), rel=1e-9)
    assert bars.limit(constant, 130.0) == np.inf
    falling = PowerLaw(6e-5, bars.ROOM, -2.0)
    most = bars.limit(falling, 130.0)
    assert most == pytest.approx((8 * 130 * 6e-5 * bars.ROOM) ** 0.5, rel=1e-12)
    assert bars.peak(falling, 130.0, 0.9 * most) == pytest.approx(bars.ROOM / (1 - 0.81), rel=1e-9)


def test_a_steady_bar_has_the_peak_of_the_closed_form():
    law = PowerLaw(6e-5, bars.ROOM, 1.0)
    exact = bars.peak(law, bars.CONDUCTIVITY, 5.0)
    scene = bars.bar(replace(SILICON, resistivity=law, temperature_coefficient=0.0), 5.0)
    found = solve(scene).steady["middle"]
    assert abs(found.value - exact) <= found.error < 1e-2 * (exact - bars.ROOM)
    assert abs(found.value - bars.peak(law, bars.CONDUCTIVITY, 5.05)) > found.error


@pytest.mark.long
def test_a_bar_of_a_steep_table_has_its_state_though_paths_on_coarse_meshes_turn_back():
    """Amorphous silicon of 0.3 eV, at 0.99 of the voltage that heats it to the last row of its table."""
    rows = np.linspace(bars.ROOM, 800.0, 8)
    law = Table(tuple(rows), tuple(6e-5 * np.exp(0.3 / 8.617e-5 * (1 / rows - 1 / bars.ROOM))))
    volts = 0.99 * (8 * bars.heat(law, bars.CONDUCTIVITY, 800.0)) ** 0.5
    peak = bars.peak(law, bars.CONDUCTIVITY, volts)
    found, error = bars.middle(bars.bar(replace(SILICON, resistivity=law, temperature_coefficient=0.0), volts), 0.0)
    assert abs(found - peak) <= error < 1e-3 * (peak - bars.ROOM)
