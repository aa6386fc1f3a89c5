"""Two hundred command lines and files that a user or a careless colleague may give: each ends with its exit status, in
a sentence where it is refused, and leaves every file that was there as it was."""

import shlex
import sys
import warnings
from hashlib import sha256
from pathlib import Path

import pytest

from compare.processes import limited
from validate.cli import main

SECONDS = 60

RISES = ((0, 293), (1e-3, 303), (5e-3, 311), (0.02, 313))
ROWS = "".join(f"{t},{v}\n" for t, v in RISES)
SHORT = "".join(f"{t};{v}\n" for t, v in RISES)
LONG = "1" * 140_000
RAW = "Title: a\nPlotname: Transient\nNo. Points: {points}\nVariables:\n\t0\ttime\ttime\n"


def rows(form: str) -> str:
    """The rows of a trace in some form, by the time in s and ms, the temperature in K and degC, the rise."""
    return "".join(form.format(s=t, ms=1e3 * t, K=v, C=v - 273.15, rise=v - 293) for t, v in RISES)


TABLES: dict[str, tuple[str | bytes, int]] = {
    # output of loggers, spreadsheets and other programs
    "plain": ("time (s),peak (K)\n" + ROWS, 0), "bare": ("time,peak\n" + ROWS, 0),
    "bare rise": ("time,peak\n" + rows("{s},{rise}\n"), 0), "bare degrees": ("time,peak\n" + rows("{s},{C}\n"), 2),
    "trailing": ("time;peak;\n" + rows("{s};{K};\n"), 0), "half trailing": ("time;peak\n" + rows("{s};{K};\n"), 0),
    "empty rows": ("time;peak\n;;\n" + SHORT + ";;;\n\n;\n", 0),
    "empty column": ("time;peak;note\n" + rows("{s};{K};\n"), 0),
    "empty cells": ("time;peak\n0;293\n1e-4;\n2e-4;294\n;295\n5e-3;311\n", 0),
    "no cell": ("time;peak;end\n0;;1\n1;2;\n2;3;\n", 2), "empty time": ("time;peak\n;293\n;294\n;295\n", 2),
    "thousands": ("time (us);peak (mK)\n" + rows("{s:.0f},0;293.000,0\n") + "1.000,0;303.000,0\n", 2),
    "thousands too": ("time (us);peak (mK)\n0,0;293.000,0\n1.000,0;303.000,0\n20.000,0;313.000,5\n", 2),
    "decimal comma": ("t [ms];Tmax [degC]\n" + rows("{ms};{C}\n").replace(".", ","), 0),
    "tabs": ("t (ms)\tTmax (K)\r\n" + rows("{ms}\t{K}\r\n"), 0), "spaces": ("t(ms) Tmax(K)\n" + rows("{ms} {K}\n"), 0),
    "quoted": ('"t (ms)","Tmax (K)"\n' + rows('"{ms}","{K}"\n'), 0),
    "index": (",t (ms),Tmax (K)\n" + rows("1,{ms},{K}\n"), 0),
    "byte order": (("time,peak\n" + ROWS).encode("utf-8-sig"), 0),
    "utf-16": (("time,peak\n" + ROWS).encode("utf-16"), 0),
    "latin-1": ("t (ms);Tmax (\N{DEGREE SIGN}C)\n".encode("latin-1") + rows("{ms};{C}\n").encode(), 0),
    "remarks": ("# by hand\n# time (s) peak (K)\n" + rows("{s} {K}\n"), 0),
    "two runs": ("time,peak\n" + ROWS + ROWS, 2),
    "two heads": ("time,peak\n" + ROWS + "time,peak\n" + ROWS, 2),
    "falling": ("time,peak\n0.02,293\n0.01,294\n0,295\n", 2),
    "nan time": ("time,peak\n0,293\nnan,294\n2e-3,295\n", 2), "inf time": ("time,peak\n0,293\n1e-3,294\ninf,295\n", 2),
    "nan": ("time,peak\n0,293\n1e-3,nan\n2e-3,295\n", 2), "huge": ("time,peak\n0,293\n1e-3,1e999\n2e-3,295\n", 2),
    # not a table
    "nothing": ("", 2), "blank": ("\n \n\t\n", 2), "head": ("time,peak\n", 2), "one row": ("time,peak\n0,293\n", 2),
    "words": ("once upon a time\nthere was a beam\n", 2), "binary": (bytes(range(256)) * 9, 2),
    "zeros": (bytes(9999), 2),
    "workbook": (b"PK\3\4" + bytes(99), 2), "numbers": ("1,2\n3,4\n5,6\n", 2),
    "ragged": ("time,peak\n0,293\n1\n2,3,4\n", 2),
    "a word": ("time,peak\n0,293\n1e-3,hot\n2e-3,294\n", 2), "long cell": (f"time,peak\n0,293\n1e-3,{LONG}\n", 2),
    "long head": (f"time,peak{LONG}\n" + ROWS, 0), "quote": ('time,peak\n0,"293\n1e-3,294\n', 2),
    "nul": ("a\0b,c\n1,2\n", 2),
    "separators": (";;;;\n;;;;\n", 2), "carriage returns": ("time,peak\r" + ROWS.replace("\n", "\r"), 0),
    "hours": ("time (h),peak (K)\n" + ROWS, 2), "volts": ("time (s),peak (V)\n" + ROWS, 2),
    "no time": ("x,peak (K)\n" + ROWS, 2), "two times": ("t1 (s),t2 (s),peak (K)\n0,1,293\n1,2,294\n2,3,295\n", 2),
    # ngspice and COMSOL
    "raw": ("Title: a\nPlotname: Transient Analysis\nFlags: real\nNo. Variables: 2\nNo. Points: 3\nVariables:\n"
            "\t0\ttime\ttime\n\t1\tv(peak)\tvoltage\nValues:\n0\t0\n\t0\n1\t1e-3\n\t7\n2\t2e-3\n\t8\n", 0),
    "raw square": (RAW.format(points="\N{SUPERSCRIPT TWO}") + "Values:\n", 2),
    "raw none": ("Title: a\nPlotname: Transient\nNo. Points: 3\nVariables:\nValues:\n0\t0\n", 2),
    "raw empty": (RAW.format(points=0) + "Values:\n", 2),
    "raw huge": (RAW.format(points="9" * 20) + "Binary:\n", 2),
    "raw cut": ("Title: a\nPlotname: Transient Analysis\n", 2),
    "comsol": ("% Model: a\n% Time (s)  maxop1(T) (K)\n" + rows("{s}  {K}\n"), 0), "comsol head": ("% Model: a\n", 2),
    "comsol names": ("% Model: a\n% Time (s)  T (K)\n0 1 2\n1 2 3\n2 3 4\n", 2),
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


SCENES: dict[str, tuple[str | bytes, int]] = {
    "beam": (BEAM, 0), "marked": (BEAM.encode("utf-8-sig"), 0), "dos": (BEAM.replace("\n", "\r\n"), 0),
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
    "zero": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", "upper = [1e-4, 1e-5, 0]\n[[b"), 2),
    "turned": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", "upper = [-1e-4, 1e-5, 1e-6]\n[[b"), 2),
    "nan": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", "upper = [nan, 1e-5, 1e-6]\n[[b"), 2),
    "inf": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", "upper = [inf, 1e-5, 1e-6]\n[[b"), 2),
    "two": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", "upper = [1e-4, 1e-5]\n[[b"), 2),
    "words": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", 'upper = ["long", 1e-5, 1e-6]\n[[b'), 2),
    "divided": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", 'upper = ["1 um/0", 1e-5, 1e-6]\n[[b'), 2),
    "powers": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", 'upper = ["9**9**9**9 * 1 m", 1e-5, 1e-6]\n[[b'), 2),
    "brackets": (beam("upper = [1e-4, 1e-5, 1e-6]\n[[b", f'upper = ["{"(" * 9999}1", 1e-5, 1e-6]\n[[b'), 2),
    "circle": (BEAM + '[parameters]\na = "b"\nb = "a"\n', 2), "self": (BEAM + '[parameters]\na = "a + 1"\n', 2),
    "unit name": (BEAM + '[parameters]\num = "1 um"\n', 2), "missing": (beam('material = "m"\n', ""), 2),
    "unknown": (beam('material = "m"', 'material = "gold"'), 2), "negative": (beam("= 100", "= -100"), 2),
    "no conductivity": (beam("thermal_conductivity = 100\n", ""), 2), "true": (beam("= 100", "= true"), 2),
    "date": (beam("= 100", "= 2024-01-01"), 2), "enormous": (beam("= 100", "= 1e300"), 2), "tiny": (beam("= 100",
    "= 1e-300"), 2),
    "no units": (beam("= 100", '= "100 W/mK"'), 2), "no cold": (beam("temperature = 293", "heat_flux = 0"), 2),
    "no box": (BEAM.replace(BOX.format(upper="[1e-4, 1e-5, 1e-6]"), ""), 2), "no probe": (beam(PROBE, ""), 2),
    "outside": (beam("at = [1e-4", "at = [2e-4"), 2), "below zero": (beam("temperature = 293", "temperature = -5"), 2),
    "both": (beam("temperature = 293", "temperature = 293\nheat_flux = 1"), 2),
    "three names": (BEAM + PROBE, 2), "thick": (beam("lower = [1e-4, 0, 0]", "lower = [5e-5, 0, 0]"), 2),
    "floating": (BEAM + BOX.replace('"b"', '"c"').format(upper="[1, 1, 1]").replace("[0, 0, 0]", "[0.5, 0.5, 0.5]"), 2),
    "of mesh": ('[mesh]\nfile = "no.msh"\n' + BEAM.partition("[[box]]")[0] + "[run]\nsteady = true\n", 2),
    "mesh is text": ('[mesh]\nfile = "mine.txt"\n' + BEAM.partition("[[box]]")[0] + "[run]\nsteady = true\n", 2),
    "steady and end": (BEAM + "end_time = 1\n", 2), "no run": (beam("[run]\nsteady = true\n", ""), 2),
    "past": (beam("steady = true", "end_time = -1"), 2), "accurate": (BEAM + "accuracy = 1e-30\n", 0),
}  # fmt: skip

COMMANDS = {
    # names and places
    "solve 'a b.toml' --no-figures --quiet": 0, "solve ./-dash.toml --no-figures --quiet": 0, "solve -dash.toml": 2,
    "solve 'a b.toml' --no-figures --quiet --out 'my runs/the first'": 0, "solve mine": 2, "solve mine/": 2,
    "solve beam.toml --no-figures --quiet --out beam.toml": 2, "solve beam.toml --no-figures --out mine": 2,
    "solve beam.toml --no-figures --out .": 2, "solve beam.toml --no-figures --out ..": 2,
    "solve beam.toml --no-figures --out /": 2, "solve beam.toml --no-figures --out /proc/a": 2,
    "solve beam.toml --no-figures --out /dev/null": 2, "solve beam.toml --no-figures --out mine.txt/a": 2,
    "solve beam.toml --no-figures --out link": 2, "solve beam.toml --no-figures --quiet --out nowhere": 0,
    f"solve beam.toml --no-figures --out {'x' * 300}": 2,
    "solve beam.toml --no-figures --quiet --out '\N{HEBREW LETTER GIMEL}\n!'": 0, "solve ''": 2, "solve /": 2,
    "solve beam.toml beam.toml": 2, "sink --only 1d --no-figures --quiet --out 'a*b?'": 0, "solve /dev/null": 2,
    "sink --only 1d --no-figures --quiet --set 'scene.name=a b'": 0, "sink --only 1d --set 'scene.name=a/b'": 2,
    # values
    "sink --only 1d --no-figures --quiet --voltage 1e-4": 0, "sink --voltage 1e-5": 2, "sink --voltage 1e400": 2,
    "sink --voltage -- -1": 2, "sink --only 1d --no-figures --quiet --voltage -1": 0, "sink --voltage '1 V V'": 2,
    "sink --voltage \N{SUPERSCRIPT TWO}": 2, "sink --voltage \N{ARABIC-INDIC DIGIT ONE}": 2,
    "solve beam.toml --accuracy 1e-30": 2,
    "sink --only 1d --no-figures --quiet --voltage 0x10": 0,
    "sink --set sink.width=1um --set sink.width=2um --only 1d --no-figures --quiet": 0,
    "sink --set =1": 2, "sink --set ==": 2, "sink --set sink.width==1um": 2, "sink --set sink=5": 2,
    "sink --set sink.=1": 2,
    "sink --set .width=1": 2, "sink --set 'sink.width=[1]'": 2, "sink --set 'sink.width={a=1}'": 2,
    "sink --set sink.spans=2.5": 2,
    "sink --set sink.spans=1e30": 2, "sink --set sink.length=0.1nm": 2,
    "sink --steady --no-figures --set sink.length=1nm": 0,
    "sink --set checks.tolerances.eq99=1": 2,
    "sink --set materials.gold.density=1": 2, "sink --set drive.electrodes=": 2, f"sink --set sink.width={LONG}": 2,
    f"sink --set {'a.' * 5000}a=1": 2, "sink --set parameters.a=1um": 2,
    "sink --against plain.csv --column": 2, "sink --against plain.csv --column =": 2, "sink --against": 2,
    "sink --against plain.csv --column 'time (s)=9'": 2, "sink --against nowhere.csv": 2, "sink --against mine": 2,
    "sink --against /dev/null": 2, "sink --against plain.csv --data-uncertainty -1": 2, "sink --data-uncertainty 1K": 2,
    "sink --uncertain sink.width=-5%": 2, "sink --uncertain sink.width=nan": 2, "sink --correlated a=2": 2,
    "solve bridge --end-time -1": 2, "solve bridge --end-time 0": 2, "solve bridge --end-time forever": 2,
    "solve hotplate --set boundary.drive.voltage=": 2, "solve bridge --set run.steady=perhaps": 2,
    "solve bridge --export mine --no-figures --quiet": 2, "solve bridge --export mine.txt --no-figures": 2,
    # sweeps, maps, the viewer, others
    "sweep sink": 2, "sweep sink --vary sink.width": 2, "sweep sink --vary sink.width=": 2, "sweep sink --vary =1": 2,
    "sweep sink --vary sink.width=1um:2um:3:4:5": 2, "sweep sink --vary sink.width=nan:1um:3": 2,
    "sweep mine --vary a=1": 2,
    "sweep sink --vary sink.width=10um:20um:99999999999": 2, "sweep sink --vary sink.width=10um,20um --out mine": 2,
    "sweep sink --vary sink.width=10um,20um --out /": 2, "sweep sink --vary sink.width=10um,20um --out mine.txt": 2,
    "sweep sink --vary sink.width=10um,20um --workers \N{SUPERSCRIPT TWO}": 2,
    "sweep beam.toml --vary box.b.upper.q=1,2": 2,
    "sweep sink --sample 9 --vary sink.width=1um,2um --seed -1": 2, "map sink --vary sink.width=10um:20um": 2,
    "view": 2, "view mine --screenshot a.png": 2, "view mine.txt --screenshot a.png": 2, "view nowhere": 2,
    "view plain.csv --screenshot a.png": 2,
    "scene nothing": 2, "scene": 2, "completion tcsh": 2, "verify --jobs \N{SUPERSCRIPT TWO}": 2,
    "stress --scenes -1": 2,
    "bench --from mine.txt": 2, "frobnicate": 2, "-x": 2, "--version": 0, "--help": 0, "sink --help": 0,
    "device --set control.sample_time=0": 2, "device --figure 99": 2, "device mine.txt": 2, "device --dry-run": 0,
    "sink --dry-run": 0, "sink --dry-run --strict --steady": 0, "solve bridge --dry-run": 0,
    "solve beam.toml --dry-run": 0,
}  # fmt: skip

LINES = (
    {f"sink --dry-run --against '{name}.csv'": status for name, (_, status) in TABLES.items()}
    | {f"solve '{name}.toml' --accuracy 1e-2 --no-figures --quiet": status for name, (_, status) in SCENES.items()}
    | COMMANDS
)


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
    files = {f"{name}.csv": text for name, (text, _) in TABLES.items()}
    files |= {f"{name}.toml": text for name, (text, _) in SCENES.items()} | {"a b.toml": BEAM, "-dash.toml": BEAM}
    words = {word.removeprefix("./") for word in shlex.split(command)}
    for name in words & files.keys():
        content = files[name]
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())


@pytest.mark.parametrize("command", LINES, ids=lambda command: command[:60])
def test_no_fault_nothing_lost_in_time(command, mine, tmp_path, capsys):
    if (
        sys.getfilesystemencoding() != "utf-8"
        and LINES[command] == 0
        and ("hebrew" in command or not command.isascii())
    ):
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
    assert status == LINES[command], err
    assert err.count("\n") == (status != 0)
    assert len(err) < 2000
    assert before.items() <= contents(tmp_path).items()
    if status:
        assert not [name for name in contents(tmp_path) if name not in before]


def test_there_are_two_hundred():
    assert len(LINES) >= 200
