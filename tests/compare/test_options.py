"""The options table: its treatment of values, and the Python interface made from the table."""

import inspect
import re

import pytest

import compare
from compare.options import check, folder_name, of_kind, read, settings
from scenes import load
from scenes.errors import SceneError


@pytest.mark.parametrize(("kind", "given", "said"), [
    ("sink", {"why": True, "only": "3d"}, "--why does not go with --only 3d: leave out --only 3d"),
    ("sink", {"fields": True, "only": "1d"}, "--fields does not go with --only 1d: leave out --only 1d"),
    ("sink", {"monte_carlo": "9"}, "--monte-carlo 9 needs --uncertain: give --uncertain, too"),
    ("device", {"about": ["9"], "largest_power": "1W"}, "does not go with --figure: leave out"),
    ("free", {"steady": True, "end_time": "1ms"}, "--end-time 1ms does not go with --steady"),
    ("free", {"modl": "x"}, 'there is no option "modl".*did you mean "model"'),
])  # fmt: skip
def test_options_that_exclude_each_other_are_refused(kind, given, said):
    with pytest.raises(SceneError, match=said):
        check(kind, given)


def test_an_option_and_an_override_of_one_key_are_refused():
    with pytest.raises(SceneError, match=r"--voltage 1 and --set voltage=2 both set drive\.voltage"):
        settings("sink", {"voltage": "1"}, ["voltage=2"])
    assert settings("sink", {"voltage": 2}, []) == ["drive.voltage=2.0"]
    assert settings("free", {"steady": True}, []) == ["run.steady=true"]


def test_values_are_read_with_the_scene():
    sink = load("sink")
    options = read("sink", {"reduction": "moments", "field_times": "1ms,2ms", "fields": True}, sink)
    assert options.reduction.startswith("moments:")
    assert options.field_times == (1e-3, 2e-3)
    assert (options.figures, options.uncertain, options.models) == (True, None, ("fem3d", "reduced1d"))
    with pytest.raises(SceneError, match="the end of the run"):
        read("sink", {"field_times": "1s", "fields": True}, sink)


def test_a_folder_is_named_by_its_options():
    sink = load("sink", ["voltage=2"])
    given = {"why": True, "steady": True, "reduction": "plate", "figures": True}
    assert folder_name("sink", given, read("sink", given, sink), sink, []).name == "sink-2V-plate-steady-why"


def test_the_python_interface_has_the_options_of_the_table():
    for kind, function in (("sink", compare.run), ("free", compare.solve), ("device", compare.device)):
        parameters = inspect.signature(function).parameters
        assert {option.key for option in of_kind(kind) if option.keyword != ""} <= set(parameters)
        assert "sensitivities : " in (function.__doc__ or "")
    assert {"steady", "why", "calibrate", "export"} <= set(inspect.signature(compare.solve).parameters)


def test_overrides_take_python_values():
    found = compare.solve("hotplate", overrides={"run.steady": True, "boundary.drive.voltage": 0.2}, accuracy=1e-2)
    assert found.steady.keys() == {probe.name for probe in found.scene.probes}
    with pytest.raises(SceneError, match="this run made none"):
        found.check("heater")


def test_impossible_temperatures_come_first():
    report = compare.solve("bridge", overrides={"boundary.left electrode.voltage": "100V"}, accuracy=1e-2).report()
    assert re.match(r"Warning: \S+ reaches [\d,]+ K", report)
