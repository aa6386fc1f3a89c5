"""Several sensors on one substrate: what goes into the plate, what it does to them, and what is told and kept."""

from __future__ import annotations

import contextlib
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem3d.device.array import Known, Solved, footprint, solve, together
from fem3d.device.array_time import over_time, paths
from fem3d.device.solve import Model, model
from fem3d.runs.array import coupling
from scenes.array import DeviceArray
from scenes.errors import SceneError
from scenes.keys import DEVICE
from scenes.loading import load
from scenes.loop.array import after, answers, course, times
from scenes.loop.march import Resolution
from scenes.loop.shielding import without_sink
from scenes.loop.stability import state_of
from tests.fem3d.device.pair_in_one_mesh import Pair
from tests.validate.cli import summary
from validate.cli import main
from validate.run.kinds.device_array import warnings_of as told_of

SETTINGS = ("substrate.thickness=0.5mm", "array.columns=3", "array.driven=[1,2]", "run.end_time=0.28")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Solved, str, dict[str, Any], Path]:
    """The array as it is solved, what a run prints, and its summary and folder."""
    kept: list[Solved] = []

    def keeping(array: DeviceArray, say: Any) -> Solved:
        kept.append(solve(array, say))
        return kept[-1]

    folder, printed = tmp_path_factory.mktemp("array") / "one", io.StringIO()
    words = [word for setting in SETTINGS for word in ("--set", setting)]
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        patch.setattr("fem3d.device.array.solve", keeping)
        assert main(["device", *words, "--accuracy", "3e-2", "--out", str(folder)]) == 0
    return kept[0], printed.getvalue(), summary(folder), folder


@pytest.mark.long
def test_what_the_films_take_goes_into_the_plate_or_outside(run: Any) -> None:
    solved = run[0]
    device, modal = solved.array.element, solved.model.fine.with_heat_below()
    for outer, warmer in ((-20.0, 0.0), (5.0, 2.0)):
        state = state_of(modal.above_substrate(outer), device, 293.0 + warmer)
        # A hundredth of the heat follows local departures, which are followed to a tenth of the accuracy, 3e-2.
        assert state.flow[-1] == pytest.approx(state.power.sum() - state.flow[0], rel=3e-5)


@pytest.mark.long
def test_the_sinks_make_the_sensors_blind_to_their_neighbours(run: Any) -> None:
    solved = run[0]
    closed, off = solved.closed, solved.sinks_off
    # By the plate's rise, the elements' sum of heat by heat, and the slope of the shielding, -214 uW/K without sinks.
    heat = np.array([solved.slopes["sinks_off"].heat] * 2 + [0.0])
    rise = solved.plate.value @ heat
    # What comes back from a warmer plate is its rise per watt by the conductance, 2e-4.
    assert off.plate_rise.value == pytest.approx(rise, rel=1e-3)
    assert off.power_change.value[:2] == pytest.approx(-213.7e-6 * rise[:2], rel=2e-2)
    assert off.power_change.value[2] == 0.0
    assert (
        np.abs(closed.power_change.value) + closed.power_change.error < 1e-4 * np.abs(off.power_change.value).max()
    ).all()
    assert (closed.plate_rise.value > off.plate_rise.value).all()
    # A sensor that is held sends as much into the plate whatever is outside; an idle element's outside is felt.
    assert abs(off.per_outside.value[0, 1]) < 1e-2 * abs(off.per_outside.value[1, 2])
    assert off.per_outside.value[1, 2] < -1e-9


@pytest.mark.long
def test_over_time_it_comes_to_what_is_at_rest(run: Any) -> None:
    solved = run[0]
    for each, over in zip((solved.closed, solved.sinks_off), solved.over_time, strict=True):
        at_rest = each.per_outside.value[over.read, over.stepped]
        assert abs(over.sensor_power[-1] - at_rest) <= over.error
    off = solved.over_time[1]
    # The polymer's slowest mode, 43 per second, has a quarter left after the 30 ms of the run; the steps' sum has all.
    assert off.sensor_power[-1] == pytest.approx(solved.sinks_off.per_outside.value[off.read, off.stepped], rel=0.25)
    # Heat needs r^2/(4 a), half a millisecond, to the neighbour.
    early = off.time_s < 0.2e-3
    assert np.abs(off.plate_rise[early]).max() < 1e-3 * np.abs(off.plate_rise).max()


@pytest.mark.long
def test_what_acts_on_the_plates_top_comes_through_the_plate_from_its_bottom(run: Any) -> None:
    """A slab whose bottom steps by 1 K has on its top 1 - 4/pi sum (-1)^n/(2 n + 1) exp(-(2 n + 1)^2 t/T); what a step
    below does is that of one on top after the slab, and what leaves the bottom is what the top takes in after it."""
    solved = run[0]
    device, states = without_sink(solved.array.element), solved.model
    sink, time = device.sink, times(device)
    diffusivity = sink.substrate.thermal_conductivity / sink.substrate.heat_capacity
    odd = 2 * np.arange(200) + 1
    slowest = (np.pi / (2 * sink.substrate_thickness)) ** 2 * diffusivity
    slab = 1 - 4 / np.pi * np.exp(-np.outer(time, odd**2) * slowest) @ ((-1.0) ** np.arange(200) / odd)
    top, bottom = (Resolution(modal, states.nodes) for modal in (states.fine.on_top_of_plate(), states.fine))
    for outside, kind in ((True, 0), (False, 1)):
        above, below = (answers(each, device, outside)[kind] for each in (top, bottom))
        size = np.abs(below).max()
        # Sums over samples leave 1e-3; without the slab between them the two are 0.4 and 0.7 of their size apart.
        assert np.abs(after(above, slab) - below).max() < 3e-3 * size
        assert np.abs(above - below).max() > 0.3 * size


@pytest.fixture(scope="module")
def two() -> tuple[DeviceArray, Pair, Model]:
    """A pair of devices, both in one mesh, and the few states of one."""
    pair = load("device", (SETTINGS[0], "array.columns=2", "array.pitch=200um"), scene_type=DEVICE)
    assert isinstance(pair, DeviceArray)
    return pair, Pair(pair), model(pair.element, 1e-2)


@pytest.mark.long
def test_over_time_a_neighbour_is_that_of_one_mesh(two: Any) -> None:
    """10 ms after a step outside of an idle element the other's sensor has half of what it comes to, sinks off,
    2e-9 W/K; with half its steps the mesh gives 1e-12 more, with intervals half as long along z 4e-11."""
    pair, mesh, states = two
    array = replace(pair, sink=replace(pair.sink, driven=(1,)))
    plate = coupling(array.sink, footprint(states)).per_heat.mean(axis=(2, 3))
    through = paths(array, plate)
    assert through is not None
    assert (through.stepped, through.read) == (1, 0)
    expected = mesh.after_a_step([(0, 1)], 100)[:, 0, 1]
    over = over_time(array, states, through, plate, 0.0)[1]
    assert np.abs(over.sensor_power[:100] - expected).max() < over.error + 4e-11
    assert over.error < 0.1 * np.abs(over.sensor_power).max()
    # As if what warms the plate came from its bottom, and counted where it leaves that.
    late = course(array, Resolution(states.fine, states.nodes), without_sink(pair.element), through, plate)
    assert np.abs(late.sensor_power[:100] - expected).max() > 3 * over.error


@pytest.mark.long
def test_two_coupled_devices_are_those_of_one_mesh(two: Any) -> None:
    """What a neighbour at work changes of a sensor's power, and what a kelvin outside of it does, idle or at work.

    With intervals half as long the other mesh gives 9e-4 more along x and 3e-4 along z; the model of 1e-2 is 5e-4 from
    that. Elements 2 % further apart, by the same coupling, are 2.5 % off.
    """
    pair, mesh, states = two
    element, foot = pair.element, footprint(states)

    def by_plate(pitch: float) -> dict[str, tuple[float, float]]:
        """Of the first element's sensor by the second, with errors: in W, W/K, W/K; and with the loops closed in W."""
        both = replace(pair, sink=replace(pair.sink, pitch=pitch))
        one = replace(both, sink=replace(both.sink, driven=(1,)))
        rise, rough = (coupling(both.sink, f).per_heat.mean(axis=(2, 3)) for f in (foot, foot.middle))
        plate = Known(rise, np.abs(rise - rough))
        off, alone, closed, first = (
            together(array, states, device, plate)
            for device in (without_sink(element), element) for array in (both, one)
        )  # fmt: skip

        def apart(a: Any, b: Any) -> tuple[float, float]:
            return a.power_change.value[0] - b.power_change.value[0], a.power_change.error[0]

        outside = [(each.per_outside.value[0, 1], each.per_outside.error[0, 1]) for each in (alone, off)]
        return dict(
            zip(("off", "idle", "at work", "closed"), (apart(off, alone), *outside, apart(closed, first)), strict=True)
        )

    sensors, cold = [(0, 1), (1, 1)], (0.0, 0.0)
    both, one = mesh.powers(sensors, cold), mesh.powers(sensors[:1], cold)
    everything = [(e, film) for e in (0, 1) for film in (0, 1)]
    closed = mesh.powers(everything, cold) - mesh.powers(everything[:2], cold)
    expected = {
        "off": both - one, "idle": mesh.powers(sensors[:1], (0.0, 1.0)) - one,
        "at work": mesh.powers(sensors, (0.0, 1.0)) - both,
    }  # fmt: skip
    coupled, further = by_plate(pair.sink.pitch), by_plate(1.02 * pair.sink.pitch)
    for name, powers in expected.items():
        value, error = coupled[name]
        assert value == pytest.approx(powers[0, 1], rel=4e-3)
        assert abs(value - powers[0, 1]) < error + 1.5e-3 * abs(value)
        assert further[name][0] != pytest.approx(powers[0, 1], rel=4e-3)
    # Closed, both are some 1e-7 of that, and the mesh is known to 3e-13 W.
    assert abs(closed[0, 1]) < 1e-6 * abs(expected["off"][0, 1])
    assert abs(coupled["closed"][0] - closed[0, 1]) < coupled["closed"][1] + 3e-13


@pytest.mark.long
def test_it_is_told_and_kept(run: Any) -> None:
    _, text, found, folder = run
    assert max(map(len, text.splitlines())) <= 80
    said = " ".join(text.split())
    assert "the others make the plate under element 1" in said
    assert "3, idle" in said
    assert "in 1D" in text
    # Rounding of what a sensor takes, some microwatts, is left of it on some machines.
    assert found["reduced1d"]["array"]["closed"]["sensor_power_change_W"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-18)
    off = found["array"]["sinks_off"]["sensor_power_change_W"]["value"]
    # 1D has no pads in the film's way to the plate and no way along the layers: its shielding is 5 % less in both.
    assert found["reduced1d"]["array"]["sinks_off"]["sensor_power_change_W"] == pytest.approx(off, rel=0.1)
    assert {"array.png", "array.svg", "report.html"} <= {entry.name for entry in folder.iterdir()}
    assert [check["verdict"] for check in found["checks"] if check["id"] == "dev3d_array"] == ["agrees"]
    assert found["array"]["at_work"] == [1, 2]
    assert set(found["fem3d"]["steady"]) == {f"plate{k}_rise_K" for k in (1, 2, 3)} | {
        "sensor1_power_W", "sensor2_power_W",
    }  # fmt: skip
    matrix = np.array(found["array"]["sinks_off"]["sensor_power_per_outside_W_per_K"]["value"])
    assert matrix.shape == (3, 3)


@pytest.mark.long
def test_what_is_no_settled_array_is_warned_of(run: Any) -> None:
    solved = run[0]

    def said(**changes: Any) -> tuple[str, ...]:
        return told_of(replace(solved, array=replace(solved.array, **changes)))

    assert said() == ()
    (unstable,) = said(control=replace(solved.array.control, sink_gain=100.0))
    assert "the loop of an element is unstable" in unstable
    (without,) = said(external=replace(solved.array.external, initial_temperature=320.0))
    assert "at 320 K outside, about which all is told, the sensor of an element has no power" in without


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (("array.columns=2", "array.pitch=100um"), "lets pads touch"),
        (("array.columns=0",), "must be a whole number from 1 to 100"),
        (("array.columns=20",), "is smaller than the array on it"),
        (("array.columns=5", "array.driven=[7]"), "names element 7, and the array has 5"),
        (("array.columns=2", "substrate.thickness=none"), "stand on one substrate"),
    ],
)
def test_what_is_no_array_is_refused(settings: tuple[str, ...], said: str) -> None:
    with pytest.raises(SceneError, match=said):
        load(
            "device",
            ("substrate.thickness=0.5mm", *settings) if "none" not in settings[-1] else settings,
            scene_type=DEVICE,
        )


@pytest.mark.parametrize("option", [("--export", "m"), ("--left-out",), ("--sensitivities",), ("--figure", "9")])
def test_what_is_of_one_device_says_so(option: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["device", "--set", "substrate.thickness=0.5mm", "--set", "array.columns=2", *option]) == 2
    assert "array.columns = 2" in capsys.readouterr().err
