"""Command lines and files that a user or a careless colleague may give: each ends with its exit status, in a sentence
with the cure where it is refused, and leaves every file that was there as it was."""

import shlex
import sys
import warnings
from hashlib import sha256
from pathlib import Path

import pytest

from compare.processes import limited
from scenes.loading import builtin_text
from validate.cli import main

SECONDS = 60

RISES = ((0, 293), (1e-3, 303), (5e-3, 311), (0.02, 313))
ROWS = "".join(f"{t},{v}\n" for t, v in RISES)
SHORT = "".join(f"{t};{v}\n" for t, v in RISES)
LONG = "1" * 140_000
RAW = "Title: a\nPlotname: Transient\nNo. Points: {points}\nVariables:\n\t0\ttime\ttime\n"


TABLES: dict[str, tuple[str | bytes, int | str]] = {
    # output of loggers, spreadsheets and other programs
    "plain": ("time (s),peak (K)\n" + ROWS, 0), "bare": ("time,peak\n" + ROWS, 0),
    "empty rows": ("time;peak\n;;\n" + SHORT + ";;;\n\n;\n", 0),
    "no cell": ("time;peak (K);end (K)\n0;;1\n1;2;\n2;3;\n", "every row is empty in one of"),
    "empty time": ("time;peak\n;293\n;294\n;295\n", "no column is the time"),
    "thousands": ("time (us);peak (mK)\n" + 4 * "0,0;293.000,0\n" + "1.000,0;303.000,0\n", 2),
    "two heads": ("time,peak\n" + ROWS + "time,peak\n" + ROWS, 2),
    "falling": ("time,peak\n0.02,293\n0.01,294\n0,295\n", 2),
    "nan time": ("time,peak\n0,293\nnan,294\n2e-3,295\n", 2), "inf time": ("time,peak\n0,293\n1e-3,294\ninf,295\n", 2),
    "nan": ("time,peak\n0,293\n1e-3,nan\n2e-3,295\n", 2),
    "huge": ("time,peak\n0,293\n1e-3,1e999\n2e-3,295\n", 2),
    # not a table
    "nothing": ("", "no rows"), "blank": ("\n \n\t\n", 2), "head": ("time,peak\n", "no rows"),
    "one row": ("time,peak\n0,293\n", 2),
    "words": ("once upon a time\nthere was a beam\n", 2), "binary": (bytes(range(256)) * 9, "binary"),
    "zeros": (bytes(9999), 2),
    "workbook": (b"PK\3\4" + bytes(99), "save the table as text or CSV"),
    "numbers": ("1,2\n3,4\n5,6\n", '"column 2" is called as no'),
    "ragged": ("time,peak\n0,293\n1\n2,3,4\n", "columns"),
    "a word": ("time,peak\n0,293\n1e-3,29E\n2e-3,294\n", "row 3"),
    "long cell": (f'time,peak\n0,"{LONG}"\n', "is no table of numbers: field larger"),
    "long head": (f"time,peak{LONG}\n" + ROWS, 2), "quote": ('time,peak\n0,"293\n1e-3,294\n', 2),
    "nul": ("a\0b,c\n1,2\n", 2),
    "separators": (";;;;\n;;;;\n", 2), "carriage returns": ("time,peak\r" + ROWS.replace("\n", "\r"), 0),
    "hours": ("time (h),peak (K)\n" + ROWS, 2),
    "no time": ("x,peak (K)\n" + ROWS, "no column is the time"),
    "two rows": ("time (s),peak (K)\n0,293\n1e-3,294\n", "three"),
    # ngspice and COMSOL
    "raw square": (RAW.format(points="\N{SUPERSCRIPT TWO}") + "Values:\n", 2),
    "raw none": ("Title: a\nPlotname: Transient\nNo. Points: 3\nVariables:\nValues:\n0\t0\n", 2),
    "raw empty": (RAW.format(points=0) + "Values:\n", 2),
    "raw huge": (RAW.format(points="9" * 20) + "Binary:\n", 2),
    "raw cut": ("Title: a\nPlotname: Transient Analysis\n", 2),
    "comsol head": ("% Model: a\n", 2),
    "comsol names": ("% Model: a\n% Time (s)  T (K)\n0 1 2\n1 2 3\n2 3 4\n", "another number of columns"),
}  # fmt: skip

HEAD = '[scene]\nname = "{name}"\n[[material]]\nname = "m"\nthermal_conductivity = 100\nresistivity = 1e-4\n'
BOX = '[[box]]\nname = "b"\nmaterial = "m"\nlower = [0, 0, 0]\nupper = {upper}\n'
ENDS = "".join(
    f'[[boundary]]\nname = "{name}"\nlower = [{x}, 0, 0]\nupper = [{x}, 1e-5, 1e-6]\n{held}\n'
    for name, x, held in (("left", "0", "temperature = 293"), ("right", "1e-4", "heat_flux = 1e5"))
)
PROBE = '[[probe]]\nname = "end"\nquantity = "temperature"\nat = [1e-4, 5e-6, 5e-7]\n'
BEAM = HEAD.format(name="beam") + BOX.format(upper="[1e-4, 1e-5, 1e-6]") + ENDS + PROBE + "[run]\nsteady = true\n"


def beam(old: str, new: str) -> str:
    """The beam's file with a change."""
    assert old in BEAM
    return BEAM.replace(old, new)


SCENES: dict[str, tuple[str | bytes, int | str]] = {
    "beam": (BEAM, 0), "marked": (BEAM.encode("utf-8-sig"), 0), "dos": (BEAM.replace("\n", "\r\n"), 0),
    "electric": (BEAM.replace("temperature = 293", "voltage = 1").replace("heat_flux = 1e5", "voltage = 0").replace(
        'quantity = "temperature"', 'quantity = "potential"'), 0),
    "hebrew": (beam('name = "beam"', 'name = "\N{HEBREW LETTER GIMEL}"'), 0),
    "hebrew box": (beam('name = "b"', 'name = "\N{HEBREW LETTER GIMEL} 1"'), 0),
    "spaces in names": (beam('"end"', '"the  end"'), 0), "marks": (beam('"end"', '"the end; = all"'), 2),
    "quotes": (beam('"end"', "'a \"b\" <i>&c'"), 2),
    "line": (beam('name = "end"', 'name = "a\\nb"'), 2), "no name": (beam('name = "end"', 'name = ""'), 2),
    "bell": (beam('name = "end"', 'name = "a\\u0007"'), 2), "long name": (beam('"end"', f'"{"e" * 5000}"'), 2),
    "path": (beam('name = "beam"', 'name = "../../etc"'), 2), "number": (beam('name = "end"', "name = 5"), 2),
    "none": ("", 2), "latin": ("# \xe9\n".encode("latin-1") + BEAM.encode(), 2), "bytes": (bytes(range(256)), 2),
    "not toml": ("lower = [1, 2\n", 2), "twice": (BEAM + "[run]\nsteady = true\n", 2), "deep": ("a = " + "[" * 9999, 2),
    "many parts": (".".join("a" * 5000) + " = 1\n", 2), "json": ('{"scene": {"name": "a"}}', 2),
    "powers": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", 'upper = ["9**9**9**9 * 1 m", 1e-5, 1e-6]\n[[b'), 2),
    "brackets": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", f'upper = ["{"(" * 9999}1", 1e-5, 1e-6]\n[[b'), 2),
    "of mesh": ('[mesh]\nfile = "no.msh"\n' + BEAM.partition("[[box]]")[0] + "[run]\nsteady = true\n", 2),
    "mesh is text": ('[mesh]\nfile = "mine.txt"\n' + BEAM.partition("[[box]]")[0] + "[run]\nsteady = true\n", 2),
    "past": (beam("steady = true", "end_time = -1"), 2), "accurate": (BEAM + "accuracy = 1e-30\n", 0),
}  # fmt: skip

COMMANDS: dict[str, int | str] = {
    # names and places
    "solve 'a b.toml' --no-figures --quiet": 0, "solve ./-dash.toml --no-figures --quiet": 0, "solve -dash.toml": 2,
    "solve 'a b.toml' --no-figures --quiet --out 'my runs/the first'": 0, "solve mine": 2, "solve mine/": 2,
    "solve beam.toml --no-figures --quiet --out beam.toml": 2, "solve beam.toml --no-figures --out mine": 2,
    "solve beam.toml --no-figures --out .": 2,
    "solve beam.toml --no-figures --out /": 2, "solve beam.toml --no-figures --out /proc/a": 2,
    "solve beam.toml --no-figures --out /dev/null": 2,
    "solve beam.toml --no-figures --out link": 2, "solve beam.toml --no-figures --quiet --out nowhere": 0,
    f"solve beam.toml --no-figures --out {'x' * 300}": 2,
    "solve beam.toml --no-figures --quiet --out '\N{HEBREW LETTER GIMEL}\n!'": 0, "solve ''": 2,
    "solve beam.toml beam.toml": 2, "sink --only 1d --no-figures --quiet --out 'a*b?'": 0, "solve /dev/null": 2,
    "sink --only 1d --no-figures --quiet --set 'scene.name=a b'": 0, "sink --only 1d --set 'scene.name=a/b'": 2,
    # values
    "sink --only 1d --no-figures --quiet --voltage 1e-4": 0, "sink --voltage 1e400": 2,
    "sink --voltage -- -1": 2, "sink --only 1d --no-figures --quiet --voltage -1": 0, "sink --voltage '1 V V'": 2,
    "sink --voltage \N{SUPERSCRIPT TWO}": 2, "sink --voltage \N{ARABIC-INDIC DIGIT ONE}": 2,
    "sink --only 1d --no-figures --quiet --voltage 0x10": 0,
    "sink --set sink.width=1um --set sink.width=2um --only 1d --no-figures --quiet": 0,
    f"sink --set sink.width={LONG[:9999]}": 2,
    f"sink --set {'a.' * 5000}a=1": 2, "sink --set parameters.a=1um": 2,
    "sink --against plain.csv --column": 2, "sink --against plain.csv --column =": 2, "sink --against": 2,
    "sink --against plain.csv --column 'time (s)=9'": 2, "sink --against nowhere.csv": "cannot be read",
    "sink --against /dev/null": 2, "sink --against plain.csv --data-uncertainty -1": 2, "sink --data-uncertainty 1K": 2,
    "solve bridge --end-time -1": 2, "solve bridge --end-time forever": 2,
    "solve bridge --export mine --no-figures --quiet": 2, "solve bridge --export mine.txt --no-figures": 2,
    # sweeps, maps, the viewer, others
    "sweep sink --vary sink.width": 2,
    "sweep sink --vary sink.width=1um:2um:3:4:5": 2, "sweep sink --vary sink.width=nan:1um:3": 2,
    "sweep mine --vary a=1": 2,
    "sweep sink --vary sink.width=10um:20um:99999999999": 2,
    "sweep sink --vary sink.width=10um,20um --out mine": "not a sweep",
    "sweep sink --vary sink.width=10um,20um --out /": 2,
    "sweep sink --vary sink.width=10um,20um --workers \N{SUPERSCRIPT TWO}": 2,
    "sweep beam.toml --vary box.b.upper.q=1,2": 2,
    "sweep sink --sample 9 --vary sink.width=1um,2um --seed -1": 2,
    "view": 2, "view nowhere": 2,
    "scene nothing": 2, "completion tcsh": 2, "verify --jobs \N{SUPERSCRIPT TWO}": 2,
    "frobnicate": 2, "-x": 2, "--version": 0, "--help": 0,
    "device --set control.sample_time=0": 2, "device mine.txt": 2,
    "sink --dry-run --strict --steady": 0,
    "solve beam.toml --dry-run": 0,
}  # fmt: skip

VARIED = "--vary sink.width=10um:200um:3"
TWO = "--vary sink.width=10um:200um --vary sink.length=1mm:2mm"
MOVED = "--vary box.beam.upper.x=1um:2um:2"
REFUSED = {
    "": "no command is given", "devise": 'did you mean "device"', "scene": "NAME",
    "--help-me": "no command is given",
    # sink: values, options, files
    "sink --voltage": "expected one argument", "sink --accuracy 2": "run.accuracy",
    "sink --set sink.spans=3 --set gap_gas_conductivity=0.026": "is not solved beside sink.spans = 3",
    "sink --set sink.widht=1um": "sink.width", "sink --only 2d": "invalid choice",
    "sink --out /dev/null/x": "cannot be written",
    "sink --fields --field-times abc": "--field-times", "sink --fields --field-times 1s": "--field-times",
    "sink --fields --field-times 0.1ms --steady": "--field-times",
    # reductions and models
    "sink --no-figures --export /dev/null/x": "cannot be written", "solve bridge --export m --states 0": "--states is",
    "device --export m --model-accuracy 1e-6": "solution's, 5e-06: give --accuracy",
    "device --3d --export m --model-accuracy 1e-4": "solution's, 0.001: give --accuracy",
    "solve bridge --export m --model-accuracy 2": "--model-accuracy = ",
    "solve bridge --export m --model-accuracy 1e-3 --states 3": "leave out --model-accuracy",
    "solve bridge --no-figures --export m --set probe.quarter.reduce=max": "an extreme potential",
    # contradictions
    "sink --voltage 2 --set drive.voltage=3": "--voltage 2", "sink --voltage 2 --set drive={voltage=3}": "--voltage 2",
    "sink --accuracy 1e-2 --set accuracy=1e-3": "accuracy", "device --max-voltage 1 --scheme paper": "--scheme paper",
    "sink --explain --json": "leave out --json", "solve bridge --dry-run --quiet": "leave out --quiet",
    # device
    "device --set sample_time=1us --set end_time=2": "at most 1000000 samples",
    "device --set gold.temperature_coefficient=0": "without a signal",
    "device --set final_temperature=20": "external.final_temperature = 20.0 K",
    "device --set allow_negative_voltage=maybe": "neither true nor false", "device --max-power '1 V'": "--max-power",
    "device --figur 9": 'did you mean "--figure"',
    "device nothing.toml": "the built-in device", "device --3d --accuracy 1e-9": "run.accuracy_3d",
    # sweeps and maps
    "sweep sink --vary sink.widht=10um:200um:3": 'did you mean "sink.width"?',
    "sweep sink --vary sink.width=20um:10um:3": "from 20um to 10um is no range",
    "sweep sink --vary drive.voltage=1,2 --set drive.current=3mA": "give one of them",
    "sink --voltage 1 --set current=3mA": "give one of them", "device --set voltage=1": "controllers drive it",
    "sweep sink --vary sink.width=10um,20um --steady --check islands_mean": "give \"eq12\"",
    "sweep sink --vary environment.convection_coefficient=0:10:3:log": "above zero for :log",
    "sweep sink --vary sink.width=10um:20um:0": 'the count of sink.width is "0"',
    "sweep sink --vary sink.width=10um:20um:1000001": "from 1 to 1000000",
    "sweep sink --vary sink.width=10um:20um:2000 --vary sink.length=1mm:2mm:2000": "4000000 points",
    "sweep sink --vary sink.width=10um:20um": "give KEY=FROM:TO:COUNT", "sweep sink": "nothing is varied",
    f"sweep sink {VARIED} {VARIED}": "sink.width is varied twice",
    f"sweep sink {VARIED} --set width=20um": "sink.width is varied and set",
    f"sweep sink {VARIED} --check fig44": 'did you mean "fig4"?',
    f"sweep sink {VARIED} --check fig6_end --steady": "only the steady state was asked for",
    f"sweep sink {VARIED} --reduction fn": "there is no reduction",
    f"sweep sink {VARIED} --sample 0": "from 1 to 1000000",
    f"sweep sink {VARIED} --point-timeout '1 m'": "is a length, not a time",
    f"sweep sink {VARIED} --seed 1": "give --sample N too",
    f"sweep sink {VARIED} --workers 1 --scheduler tcp://x:1": "give one of the two",
    f"sweep device {VARIED}": "has no 3D model to sweep",
    "sweep bridge --vary box.bem.upper.x=1um:2um:2": 'the scene has no box "bem"',
    "sweep bridge --vary box.beam.upper.x=1V:2V:2": "is a voltage, not a length",
    f"sweep bridge {MOVED} --check midle": 'did you mean "middle"?',
    f"sweep bridge {MOVED} --voltage 2": "--voltage is for a sink", f"map sink {TWO}": "--check",
    "map sink --vary sink.width=10um:200um --check fig4": "a map is over two keys, and 1 are varied",
    f"map sink {TWO} --check fig9": "there is no check",
    f"map sink {TWO} --check eq14 --reduction plate": 'give "fig4"',
    f"map sink {TWO} --check fig4 --tolerance 5V": "is a voltage, not a plain number",
    f"map sink {TWO} --check fig4 --cells 1": "from 2 to 1000",
    f"map sink {VARIED} --vary sink.length=1mm:2mm --check fig4": "give KEY=FROM:TO",
    f"map bridge {TWO} --check middle": "has no 1D model",
    # free scenes
    "solve nowhere.toml": "no file", "solve": "SCENE.toml",
    "solve hotplate --set run.end_time=14.0375ms --set run.output_times=[0.01,0.0140376]":
        "run.end_time = 0.0140375 s is before the last of run.output_times, 0.0140376 s",
    "sink --air": "unknown option",
    # another command's scene, another key's name, another spelling of a unit
    "solve sink": "another command: validate sink", "sink bridge": "another command: validate solve bridge",
    "device hotplate": "another command: validate solve hotplate", "solve device": "another command: validate device",
    "solve sink.toml": "is a sink's scene: validate sink sink.toml",
    "sink 'my bridge.toml'": "is a free scene: validate solve 'my bridge.toml'",
    "device 'my bridge.toml'": "is a free scene: validate solve",
    "solve device.toml": "is a device's scene: validate device",
    "solve bridge --set voltage=1": '"boundary.left electrode.voltage" or "boundary.right electrode.voltage"',
    "solve bridge --set material.polysilicon.thermal_conductivity='200 W/mK'": "not a thermal conductivity",
    "solve bridge --set material.polysilicon.sigma=1": "electrical_conductivity, ",
    "sink --set materials.silicon.specific_heat='700 J/kgK'": 'did you mean "(kg K)"',
    "sink --set sink.width='300 mu'": 'unknown unit "mu", did you mean "um"',
    # studies
    "verify --jobs 0": "--jobs", "verify --only all": "invalid choice",
    "stress --quick --scenes 0": "--scenes", "stress --quick --seed x": "--seed",
    "bench --rounds 0": '--rounds is "0"',
    "bench --json nowhere/a.json": 'there is no folder "nowhere"',
    # the viewer
    "view nowhere --screenshot a.png": "does not exist", "view . --screenshot a.png": "no fields",
    "view . --screenshot a.txt": ".png",
    "view . --screenshot no/where.png": "does not exist", "view . --movie a.avi": ".gif",
    "view . --movie a.gif --time 1ms": "--movie shows all times: leave out --time",
    "view . --clip w --screenshot a.png": "x, y or z", "view . --clip y=2 --screenshot a.png": "--clip",
    "view . --size 9 --screenshot a.png": "1400x800", "view . --exaggerate none --screenshot a.png": "--exaggerate",
    "view . --time 3V --screenshot a.png": "--time",
    "view empty.toml --screenshot a.png": "has no [[box]], so there is nothing to draw",
    "view bridge --time 3ms": "--time is for fields",
    "view nothing.toml": "is no file",
    "view bridge --set parameters.x=3": 'have no "x"',
    "view mine --set a=b": "--set is for a scene",
    # parameters and uncertain inputs
    "sink --uncertain materials --monte-carlo 3": "--monte-carlo",
    "sink --uncertain materials --monte-carlo 10 --only 1d": "--only 1d",
    "sink --uncertain materials --correlated sink.width,pad_width=2": "--correlated",
    "solve bridge --uncertain box.beam.upper.w=1um": "box.beam.upper.w",
    "solve bridge --uncertain 'boundary.right electrode.voltage=1%'": "boundary.right electrode.voltage",
    "solve bridge --uncertain beam.upper.z=1V": "neither in percent nor",
    # models of one's own
    "sweep bridge --model own.py:tip --check midle --vary parameters.w=8um,9um": 'did you mean "middle"',
    "sink --reduction own.py:tip --only 1d": "leave out --only 1d",
    "sink --reduction own.py:tip --monte-carlo 20 --uncertain width=1%": "leave out --monte-carlo",
    "sink --reduction network --set spans=3": "sink.spans is 3",
    "sink --reduction plate --set spans=3": "made for one span",
    **{f"sink --reduction {model} --set emissivity=0.7": "radiates" for model in ("fin-massless", "fin", "moments:3")},
    "sink --reduction plate --set 'silicon.thermal_conductivity={value=130, at=293, exponent=-1.3}'": "by a law",
    "sink --reduction network --set emissivity=0.7": "radiates",
    "sweep sink --model own.py:tip --vary sink.width=10um,20um": "--reduction",
    "sweep sink --reduction paper,own.py:tip --vary sink.width=10um,20um": "is judged alone",
    "sweep sink --reduction network --check eq14 --vary sink.width=10um": 'give "fig4", "fig6_peak"',
}  # fmt: skip

LINES: dict[str, int | str] = (
    {f"sink --dry-run --against '{name}.csv'": expected for name, (_, expected) in TABLES.items()}
    | {f"solve '{name}.toml' --accuracy 1e-2 --no-figures --quiet": expected for name, (_, expected) in SCENES.items()}
    | COMMANDS
    | REFUSED
)
"""The exit status of each command line, or a part of the sentence that refuses it with status 2."""
FILES = {f"{name}.csv": text for name, (text, _) in TABLES.items()}
FILES |= {f"{name}.toml": text for name, (text, _) in SCENES.items()}
FILES |= {f"{name}.toml": builtin_text(name.rpartition(" ")[2]) for name in ("my bridge", "sink", "device")}
FILES |= {"a b.toml": BEAM, "-dash.toml": BEAM, "empty.toml": '[scene]\nname = "nothing"\n'}
FILES |= {"own.py": "def tip(scene, times):\n    return {'middle': 300.0}\n"}


@pytest.fixture
def mine(tmp_path):
    """Return the files of a folder and their content."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    for name in ("model.py", "summary.json", "notes.txt"):
        (tmp_path / "mine" / name).write_text("mine", encoding="utf-8")
    (tmp_path / "link").symlink_to("mine")
    return contents(tmp_path)


def contents(folder: Path) -> dict[str, str]:
    """The checksum of each file below a folder."""
    return {str(path.relative_to(folder)): sha256(path.read_bytes()).hexdigest()
            for path in folder.rglob("*") if path.is_file()}  # fmt: skip


def write(folder: Path, command: str) -> None:
    """The files that a command names."""
    words = {part for word in shlex.split(command) for part in (word.removeprefix("./"), word.partition(":")[0])}
    words |= {word.rpartition(",")[2] for word in words}
    for name in words & FILES.keys():
        content = FILES[name]
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())


@pytest.mark.parametrize("command", LINES, ids=lambda command: command[:60])
def test_no_fault_nothing_lost_in_time(command, mine, tmp_path, capsys):
    expected = LINES[command]
    if sys.getfilesystemencoding() != "utf-8" and expected == 0 and ("hebrew" in command or not command.isascii()):
        pytest.skip("names of files have ASCII letters only here")
    write(tmp_path, command)
    before = contents(tmp_path)
    assert mine.items() <= before.items()
    with limited(SECONDS), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        status = main(shlex.split(command))
    out, err = capsys.readouterr()
    assert "a fault of this program" not in err
    assert "Traceback" not in out + err
    assert status == (2 if isinstance(expected, str) else expected), err
    assert err.count("\n") == (status != 0)
    assert len(err) < 2000
    assert before.items() <= contents(tmp_path).items()
    if status:
        # Python itself keeps the bytecode of a user's module.
        assert not [name for name in contents(tmp_path) if name not in before and not name.startswith("__pycache__")]
    if isinstance(expected, str):
        assert out == ""
        assert err.startswith("validate: ")
        assert expected in err
