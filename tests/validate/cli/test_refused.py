"""Bad input: one sentence with the cure, exit status 2, and nothing is printed or written."""

import shlex

import pytest

from scenes.loading import builtin_text
from validate.cli import main

VARIED = "--vary sink.width=10um:200um:3"
TWO = "--vary sink.width=10um:200um --vary sink.length=1mm:2mm"
BEAM = "--vary box.beam.upper.x=1um:2um:2"
NO_3D = "give another folder with --out"
REFUSED = {
    "": "no command is given", "devise": 'did you mean "device"', "snik": 'did you mean "sink"', "scene": "NAME",
    "scene snik": 'did you mean "sink"', "--help-me": "no command is given",
    # sink: values, options, files
    "sink --voltage abc": "drive.voltage", "sink --voltage 2um": "not a voltage", "sink --voltage nan": "drive.voltage",
    "sink --voltage": "expected one argument", "sink --volts 1": '"--voltage"', "sink --accuracy 2": "run.accuracy",
    "sink --accuracy 0": "run.accuracy", "sink --set run.end_time=0": "run.end_time",
    "sink --set sink.widht=1um": "sink.width", "sink --set sink.width": "KEY=VALUE", "sink --only 2d": "invalid choice",
    "sink nowhere.toml": "no file", "sink one two": "too many", "sink --out=": "--out",
    "sink --only 1d --no-figures --out .": "is where you are or a mount",
    "sink --out /dev/null/x": "output folder",
    "sink --fields --field-times abc": "--field-times", "sink --fields --field-times 1s": "--field-times",
    "sink --fields --field-times=-1ms": "--field-times", "sink --fields --field-times 1V": "--field-times",
    "sink --fields --field-times 0.1ms --steady": "--field-times",
    # reductions and models
    "sink --reduction plat": 'did you mean "plate"', "sink --reduction moments:0": "from 1 to 12",
    "sink --reduction fin:2": "no number of states", "sink --why --only 1d": "--only 1d",
    "sink --reduction fin --only 3d": "leave out --only 3d", "sink --export x --only 1d": "leave out --only 1d",
    "sink --export=": "--export",
    "sink --no-figures --export /dev/null/x": "cannot be written",
    "sink --states 3": "--states 3 needs --export",
    "device --states 3": "--states 3 needs --export",
    "device --export m --scheme paper": "leave out --scheme paper",
    "device --export m --meter MAX1367": "leave out --meter MAX1367",
    "device --export m --model-accuracy 1e-6": "known, 5e-06: give --accuracy",
    "device --3d --export m --model-accuracy 1e-4": "known, 0.001: give --accuracy",
    "solve bridge --states 3": "--states 3 needs --export",
    "solve bridge --export m --states 0": "--states is", "solve bridge --export ' '": "names no folder",
    "solve bridge --export m --model-accuracy 2": "--model-accuracy = ",
    "solve bridge --export m --model-accuracy 1e-3 --states 3": "leave out --model-accuracy",
    "solve bridge --no-figures --export file/m": "cannot be written",
    "solve bridge --no-figures --export m --set probe.quarter.reduce=max": "an extreme potential",
    # contradictions
    "sink --voltage 2 --set drive.voltage=3": "--voltage 2", "sink --voltage 2 --set voltage=3": "drive.voltage",
    "sink --voltage 2 --set drive={voltage=3}": "drive.voltage", "sink --accuracy 1e-2 --set accuracy=1e-3": "accuracy",
    "solve bridge --accuracy 1e-2 --set run.accuracy=1e-3": "run.accuracy", "sink --only 1d --fields": "--only 1d",
    "device --accuracy 1e-2 --set run.accuracy=1e-3": "run.accuracy", "sink --quiet --json": "leave out --json",
    "sink --explain --json": "leave out --json", "solve bridge --dry-run --quiet": "leave out --quiet",
    "device --figure 11 --scheme paper": "--figure 11", "device --max-power 2mW --figure 9": "--max-power",
    "device --max-voltage 1 --scheme paper": "--scheme paper",
    # device
    "device --set control.sampletime=1ms": 'did you mean "control.sample_time"',
    "device --set set_temperature=290": "control.set_temperature = 290 K asks for cooling",
    "device --set sample_time=1us --set end_time=2": "at most 1000000 samples",
    "device --set gold.temperature_coefficient=0": "without a signal",
    "device --set final_temperature=20": "external.final_temperature = 20.0 K",
    "device --set allow_negative_voltage=maybe": "neither true nor false", "device --max-power '1 V'": "--max-power",
    "device --figure 8": "invalid choice", "device --figur 9": 'did you mean "--figure"',
    "device none.toml": "the built-in device", "device --3d --accuracy 1e-9": "run.accuracy_3d",
    "device --no-figures --scheme paper --set sensor_thickness=50nm": "stable only up to 0.7",
    # sweeps and maps
    "sweep sink --vary sink.widht=10um:200um:3": 'did you mean "sink.width"?',
    "sweep sink --vary sink.width=1V:2V:3": "is a voltage, not a length",
    "sweep sink --vary sink.width=20um:10um:3": "from 20um to 10um is an empty range",
    "sweep sink --vary drive.voltage=1,2 --set drive.current=3mA": "give one of them",
    "sweep sink --vary drive.current=1mA,2mA --voltage 1": "give one of them",
    "sink --voltage 1 --set current=3mA": "give one of them", "device --set voltage=1": "controllers drive it",
    "sweep sink --vary sink.spans=1:5:3": "takes whole numbers",
    "sweep sink --vary sink.width=10um,20um --steady --check islands_mean": "one of several spans",
    "sweep sink --vary environment.convection_coefficient=0:10:3:log": "has no logarithm",
    "sweep sink --vary sink.width=10um:20um:0": 'the count of sink.width, "0"',
    "sweep sink --vary sink.width=10um:20um:1000001": "from 1 to 1000000",
    "sweep sink --vary sink.width=10um:20um:2000 --vary sink.length=1mm:2mm:2000": "4000000 points",
    "sweep sink --vary sink.width=10um:20um": "has no count", "sweep sink": "nothing is varied",
    f"sweep sink {VARIED} {VARIED}": "sink.width is varied twice",
    f"sweep sink {VARIED} --set width=20um": "sink.width is varied and set",
    f"sweep sink {VARIED} --check fig44": 'did you mean "fig4"?',
    f"sweep sink {VARIED} --check fig6_end --steady": "they need the transient",
    f"sweep sink {VARIED} --reduction fn": "there is no reduction",
    f"sweep sink {VARIED} --point-timeout '1 m'": "is a length, not a time",
    f"sweep sink {VARIED} --workers 0": "from 1 to 256", f"sweep sink {VARIED} --sample 0": "from 1 to 1000000",
    f"sweep sink {VARIED} --seed 1": "give --sample N too",
    f"sweep sink {VARIED} --workers 1 --scheduler tcp://x:1": "give one of the two",
    f"sweep device {VARIED}": "has no 3D model to sweep",
    "sweep bridge --vary box.bem.upper.x=1um:2um:2": 'the scene has no box "bem"',
    "sweep bridge --vary box.beam.upper.x=1V:2V:2": "is a voltage, not a length",
    f"sweep bridge {BEAM} --check midle": 'did you mean "middle"?',
    f"sweep bridge {BEAM} --voltage 2": "--voltage is for a sink", f"map sink {TWO}": "--check",
    "map sink --vary sink.width=10um:200um --check fig4": "a map is over two keys, and 1 are varied",
    f"map sink {TWO} --check fig9": "is no check",
    f"map sink {TWO} --check eq14 --reduction plate": "plate makes no use of: give fig4, fig6_peak",
    f"map sink {TWO} --check fig4 --tolerance 5V": "is a voltage, not a plain number",
    f"map sink {TWO} --check fig4 --cells 1": "from 2 to 1000",
    f"map sink {VARIED} --vary sink.length=1mm:2mm --check fig4": "--cells says how many",
    f"map bridge {TWO} --check middle": "has no 1D model",
    # free scenes
    "solve nowhere.toml": "no file", "solve bridgee": 'did you mean "bridge"?', "solve": "SCENE.toml",
    "solve bridge --set boundary.left.voltage=1": 'no boundary "left"',
    "solve hotplate --set run.end_time=14.0375ms --set run.output_times=[0.01,0.0140376]":
        "run.end_time = 0.0140375 s is before the last of run.output_times, 0.0140376 s",
    "solve bridge --set box.beam.material=gold": 'is no material of the scene: "gold"',
    "solve bridge --accuracy 2": "run.accuracy", "sink --air": "unknown option",
    # another command's scene, another key's name, another spelling of a unit
    "solve sink": "another command: validate sink", "sink bridge": "another command: validate solve bridge",
    "device hotplate": "another command: validate solve hotplate", "solve device": "another command: validate device",
    "solve sink.toml": "is a sink's scene: validate sink sink.toml",
    "sink 'my bridge.toml'": "is a free scene: validate solve 'my bridge.toml'",
    "device 'my bridge.toml'": "is a free scene: validate solve",
    "solve device.toml": "is a device's scene: validate device", "sink device.toml": "is a device's scene: validate",
    "solve bridge --set voltage=1": '"boundary.left electrode.voltage" or "boundary.right electrode.voltage"',
    "solve bridge --set bx.beam.upper.x=1um": 'did you mean "box.beam.upper"?',
    "solve bridge --set box.bem.upper.x=1um": '"left foot", "right foot", did you mean "beam"',
    "solve bridge --set material.polysilicon.thermal_conductivity='200 W/mK'": "not a thermal conductivity",
    "solve bridge --set material.polysilicon.sigma=1": "electrical_conductivity, ",
    "sink --set materials.silicon.sigma=1": "electrical_conductivity, ",
    "sink --set materials.silicon.specific_heat='700 J/kgK'": 'did you mean "(kg K)"',
    "sink --set materials.silicon.resistivity='1 S/m'": 'is an electrical conductivity, not a resistivity',
    "sink --set sink.width='300 mu'": 'unknown unit "mu", did you mean "um"',
    # studies
    "verify --jobs 0": "--jobs", "verify --jobs two": "--jobs", "verify --only all": "invalid choice",
    "stress --quick --scenes 0": "--scenes", "stress --quick --seed x": "--seed", "stress --quick --jobs -1": "--jobs",
    "bench --rounds 0": '--rounds is "0"', "bench --part sink": "invalid choice",
    "bench --json nowhere/a.json": 'there is no folder "nowhere"', "bench --from missing.json": "could not be read",
    "sink --states -1": "--states -1 needs --export",
    # the viewer
    "view nowhere --screenshot a.png": "does not exist", "view . --screenshot a.png": "no fields",
    "view . --off-screen": "--screenshot", "view . --screenshot a.txt": ".png",
    "view . --screenshot no/where.png": "does not exist", "view . --movie a.avi": ".gif",
    "view . --clip w --screenshot a.png": "x, y or z", "view . --clip y=2 --screenshot a.png": "--clip",
    "view . --size 9 --screenshot a.png": "1400x800", "view . --exaggerate none --screenshot a.png": "--exaggerate",
    "view . --time 3V --screenshot a.png": "--time",
    "view empty.toml --screenshot a.png": "has no [[box]], so there is nothing to draw",
}  # fmt: skip


@pytest.mark.parametrize("command", REFUSED)
def test_bad_input_is_one_sentence(command, tmp_path, capsys):
    scenes = {f"{name}.toml": builtin_text(name.rpartition(" ")[2]) for name in ("my bridge", "sink", "device")}
    scenes["empty.toml"] = '[scene]\nname = "nothing"\n'
    (tmp_path / "file").write_text("", encoding="utf-8")
    for name in (name for name in scenes if name in command):
        (tmp_path / name).write_text(scenes[name], encoding="utf-8")
    names = {path.name for path in tmp_path.iterdir()}
    assert main(shlex.split(command)) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("validate: ")
    assert err.count("\n") == 1
    assert REFUSED[command] in err
    assert {path.name for path in tmp_path.iterdir()} == names
