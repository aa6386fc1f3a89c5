"""Files as other programs and instruments write them, of a bar whose middle warms by a given course."""

import shlex
import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from compare.against import Data
from scenes import load
from scenes.errors import SceneError
from tests.compare.data import found
from validate.cli import main

SCENE = """
scene = {name = "bar", initial_temperature = "293.15 K"}
run.end_time = "1 ms"
parameters.Vapp = "0.1 V"
box = [{name = "bar", material = "m", lower = [0, 0, 0], upper = ["100 um", "10 um", "10 um"]}]
boundary = [
  {lower = [0, 0, 0], upper = [0, "10 um", "10 um"], temperature = "293.15 K"},
  {lower = [0, 0, 0], upper = [0, "10 um", "10 um"], voltage = "Vapp"},
  {lower = ["100 um", 0, 0], upper = ["100 um", "10 um", "10 um"], temperature = "293.15 K"},
  {lower = ["100 um", 0, 0], upper = ["100 um", "10 um", "10 um"], voltage = 0},
]
probe = [
  {name = "mid", at = ["50 um", "5 um", "5 um"]},
  {name = "quarter", at = ["25 um", "5 um", "5 um"]},
  {name = "I", quantity = "current", lower = [0, 0, 0], upper = [0, "10 um", "10 um"]},
  {name = "out", quantity = "current", lower = ["100 um", 0, 0], upper = ["100 um", "10 um", "10 um"]},
]
[[material]]
name = "m"
thermal_conductivity = 100
resistivity = "1e-6 ohm m"
temperature_coefficient = "1e-3 1/K"
reference_temperature = "293.15 K"
density = 5000
specific_heat = 500
"""
TIMES = np.array([0.0, 1e-6, 1e-5, 1e-4, 5e-4, 1e-3])
RISES = 12.4228 * (1 - np.exp(-TIMES / 3.5e-5))
MID = 293.15 + RISES


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "bar.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


def taken(scene: Path, content: str | bytes, *columns: str, settings: Sequence[str] = ()) -> Data:
    return found(scene.parent, content, *columns, scene=load(scene, settings))


def rows(form: str, *columns: np.ndarray, end: str = "\n") -> str:
    return "".join(form.format(*row) + end for row in zip(*columns, strict=True))


def comma(text: str) -> str:
    return text.replace(".", ",")


PAIRS = rows("{:.9g},{:.9g}", TIMES, MID)
CELSIUS = rows("{:.9g};{:.9g}", TIMES, MID - 273.15)
COMSOL = "% Model: bar.mph\n% Version: COMSOL 6.2.0.339\n% Length unit: m\n"

TRACES: dict[str, str | bytes] = {
    "comma separated": "time (s),mid (K)\n" + PAIRS,
    "COMSOL table": COMSOL + "% Time (ms)        mid (degC)\n" + rows("{:.9g}   {:.9g}", 1e3 * TIMES, MID - 273.15),
    "COMSOL table with commas": COMSOL
    + '% "Time (ms)","mid (degC)"\n' + rows("{:.9g},{:.9g}", 1e3 * TIMES, MID - 273.15),
    "names in a remark": "# mine\n# time_s mid_K\n" + rows("{:.9g} {:.9g}", TIMES, MID),
    "mark of the byte order and texts": "\N{ZERO WIDTH NO-BREAK SPACE}Time (s), mid (K), comment_x\n"
    + rows("{:.9g}, {:.9g}, 1", TIMES, MID),
    "this program's own": "time_s,mid,reduced1d mid\n" + rows("{:.9g},{:.9g},{:.9g}", TIMES, MID, MID + 1),
    "COMSOL table with NaN in a column": COMSOL + "% Time (s)  mid (K)  quarter (K)\n"
    + rows("{:.9g}  {:.9g}  NaN", TIMES, MID),
    "COMSOL point of the geometry": COMSOL + "% Time (s)  Temperature (K), Point: (50, 5, 5)\n"
    + rows("{:.9g}  {:.9g}", TIMES, MID),
    "MOOSE": "time,I,mid\n" + rows("{:.9g},0.1,{:.9g}", TIMES, MID),
    "numpy.savetxt": "# t, mid\n" + rows("{:.18e} {:.18e}", TIMES, MID),
    "two clocks": "CPU (s),time (s),mid (K)\n" + rows("{:.9g},{:.9g},{:.9g}", 9 * TIMES, TIMES, MID),
    "oscilloscope with metadata": "Model,DSO-X 3024\nSample Interval,1e-6,s\nSource,CH1\n\nTIME,mid\n" + PAIRS,
    "oscilloscope with words for units": "x-axis,mid\nsecond,Kelvin\n" + PAIRS,
    "row of units in brackets": "time;mid\n[ms];[°C]\n" + comma(rows("{:.9g};{:.9g}", 1e3 * TIMES, MID - 273.15)),
    "units between names and remarks": "time,mid,state\nms,K,\n,mean,\n" + rows("{:.9g},{:.9g},ok", 1e3 * TIMES, MID),
    "LabVIEW": "Y_Unit_Label\tDeg. C\nX_Dimension\tTime\nX_Value\tmid (Deg. C)\tComment\n"
    + rows("{:.9g}\t{:.9g}", TIMES, MID - 273.15),
    "LabVIEW with decimal commas": "X0\t0,0E+0\t0,0E+0\nDelta_X\t5,0E-5\t5,0E-5\nX_Value\tmid (K)\n"
    + comma(rows("{:.9f}\t{:.9f}", TIMES, MID)),
    "Fluent": '"report-file"\n"Time Step" "mid" "flow-time"\n("Time Step" "mid" "flow-time")\n'
    + rows("{:.0f} {:.9g} {:.9g}", np.arange(6), MID, TIMES),
    "metadata like a list": "DSO,1234,Waveform\nSegments,1,x\n#1,30-Nov-2026 10:00,0\ntime (s),mid (K)\n" + PAIRS,
    "hours and degrees Fahrenheit": "time (h),mid (degF)\n"
    + rows("{:.12g},{:.9g}", TIMES / 3600, (MID - 273.15) * 1.8 + 32),
    "complex numbers": COMSOL + "% Time (s)  mid (K)\n" + rows("{:.9g}  {:.9g}-1.2E-15i", TIMES, MID),
    "Excel's sep=;": "sep=;\r\nZeit (s);mid (°C)\r\n" + comma(CELSIUS).replace("\n", "\r\n"),
    "decimal commas in quotes": 'time (s),mid (K)\n' + comma(rows('"{:.9f}";"{:.9f}"', TIMES, MID)).replace(";", ","),
    "decimal commas and blanks": "time/s mid/K\n" + comma(rows("{:.9f} {:.9f}", TIMES, MID)),
    "Windows' code page": ("time (µs);mid (°C)\n" + rows("{:.9g};{:.9g}", 1e6 * TIMES, MID - 273.15)).encode("cp1252"),
    "UTF-16": ("time (s)\tmid (K)\r\n" + rows("{:.9g}\t{:.9g}", TIMES, MID)).encode("utf-16"),
    "minutes": "time (min),mid (K)\n" + rows("{:.12g},{:.9g}", TIMES / 60, MID),
    "Fortran": " time(s)   mid(K)\n" + rows("  {:.12e}  {:.10e}", TIMES, MID).replace("e", "D"),
    "Xyce": "Index   TIME    V(MID)   I(V1)\n" + rows("{:.0f} {:.9e} {:.9e} -1e-1", np.arange(6), TIMES, MID)
    + "End of Xyce(TM) Simulation\n",
    "column of texts": "date,time (s),mid (K),remark\n" + rows("2024-05-01 10:00,{:.9g},{:.9g},ok", TIMES, MID),
    "time of the day beside a clock": "Date;Time;Elapsed (s);mid (K)\n"
    + rows("14.03.2023;10:21:33;{:.9g};{:.9g}", TIMES, MID),
    "rise": "time (s),mid rise (K)\n" + rows("{:.9g},{:.9g}", TIMES, RISES),
    "commas before units": '"time, s","mid, K"\n' + rows("{:.9g},{:.9g}", TIMES, MID),
    "rise by its column": "time (s),mid (K)\n" + rows("{:.9g},{:.9g}", TIMES, RISES),
    "separators behind the last cell": "time (s);mid (K)\n" + rows("{:.9g};{:.9g};;", TIMES, MID) + ";;;\n",
    "quotes around numbers": '"time (s)","mid (K)"\n' + rows('"{:.9g}","{:.9g}"', TIMES, MID),
    "rule below the head": "time (s);mid (K)\n--------;-------\n" + rows("{:.9g};{:.9g}", TIMES, MID),
    "remark between rows": "time (s),mid (K)\n" + PAIRS.replace("\n", "\npower restored\n", 2),
    "UTF-16 without a mark": ("time (s)\tmid (K)\r\n" + rows("{:.9g}\t{:.9g}", TIMES, MID)).encode("utf-16-le"),
    "degrees behind a blank": "Time (s)\tmid °C\n" + rows("{:.9g}\t{:.9g}", TIMES, MID - 273.15),
    "units behind the word in": "Zeit in ms;mid in °C\n" + rows("{:.9g};{:.9g}", 1e3 * TIMES, MID - 273.15),
    "unit for a name": "Seconds,mid (K)\n" + PAIRS,
    "masculine ordinals for degrees": "Time [s],mid [ºC]\n" + rows("{:.9g},{:.9g}", TIMES, MID - 273.15),
    "units below all but the index, signs apart": "Number,Time,mid,\nNO.,s,degC,\n"
    + rows("{:.0f},{:.9g},+   {:.9g},", np.arange(6), TIMES, MID - 273.15),
    "Origin": "Time\tmid\nms\tK\nComments\tT1\nF(x)=\t\n" + rows("{:.9g}\t{:.9g}", 1e3 * TIMES, MID),
    "rows of statistics": "time (s);mid (K)\n" + rows("{:.9g};{:.9g}", TIMES, MID) + "\nMean;300.1\nMax;305.57\n",
    "metadata like rows": "Dimension1, 6, 6\nDimension2, 1, 1\nDataName, time, mid\n"
    + rows("DataValue, {:.9g}, {:.9g}", TIMES, MID),
    "another table whose first column goes on": "time (s),mid (K)\n" + PAIRS + "\nf (Hz),Z (ohm)\n1,9\n10,7\n",
    "rows without numbers": "time (s),mid (K)\nNaN,NaN\n" + PAIRS.replace("\n", "\nNaN,#N/A\n"),
    "types of thermocouples": "time (s),mid (degC)\nType,K\n" + CELSIUS.replace(";", ","),
    "types of thermocouples below units": "time;mid\ns;degC\nSensor type;TC-K\n" + CELSIUS,
    "units behind and below names": "time (s),mid (degC)\n,K\n" + CELSIUS.replace(";", ","),
    "a word before units": "time,mid\nUnit,K\n" + PAIRS,
    "factors of one": "Scale,1,1.0\ntime (s),mid (K)\n" + PAIRS,
    "numbered index": ",time (s),mid (K)\n" + rows("{:.0f},{:.9g},{:.9g}", np.arange(6), TIMES, MID),
}  # fmt: skip


@pytest.mark.parametrize("kind", TRACES)
def test_kind_of_file_is_read(kind, scene):
    data = taken(scene, TRACES[kind])
    assert data.time == pytest.approx(TIMES, abs=1e-9)
    assert data.values["mid"] == pytest.approx(MID, abs=2e-5)


def test_metadata_beside_the_rows_are_no_column(scene):
    """As old oscilloscopes of Tektronix write them: times and values are the fourth and the fifth column."""
    beside = "Record Length,2500", "Source,CH1", "Scale,1e-3", *3 * [","]
    text = "".join(f"{b},,{t:.9g},{k:.9g},\n" for b, t, k in zip(beside, TIMES, MID, strict=True))
    data = taken(scene, text, "time (s)=4", "mid (K)=5")
    assert data.time == pytest.approx(TIMES)
    assert data.values["mid"] == pytest.approx(MID)
    # names like a row of the types of thermocouples
    assert taken(scene, "Typ,T\n" + PAIRS, "time (s)=Typ", "mid (K)=T").values["mid"] == pytest.approx(MID)
    assert taken(scene, "time;Type K\ns;degC\n" + CELSIUS, "mid=Type K").values["mid"] == pytest.approx(MID)


LTSPICE = "Title: * bar\nPlotname: Transient Analysis\nFlags: real forward\nNo. Variables: 3\nNo. Points: 6\n\
Command: Linear Technology Corporation LTspice XVII\nVariables:\n\t0\ttime\ttime\n\t1\tV(mid)\tvoltage\n\
\t2\tI(V1)\tdevice_current\n"
MARKED = TIMES * np.array([1, 1, -1, 1, -1, 1])


@pytest.mark.parametrize("kind", ["text", "UTF-16", "single", "double"])
def test_raw_file_of_ltspice(kind, scene):
    """Minus signs of times are LTspice's marks; binary files have single precision unless marked "double"."""
    values = rows("0\t{:.15e}\n\t{:.15e}\n\t-1e-1", MARKED, MID)
    point = "<dff" if kind == "single" else "<ddd"
    binary = b"".join(struct.pack(point, t, v, -0.1) for t, v in zip(MARKED, MID, strict=True))
    header = LTSPICE.replace("forward", "forward double") if kind == "double" else LTSPICE
    content = {
        "text": (header + "Values:\n" + values).encode(), "UTF-16": (header + "Values:\n" + values).encode("utf-16-le"),
        "single": (header + "Binary:\n").encode("utf-16-le") + binary,
        "double": (header + "Binary:\n").encode() + binary,
    }  # fmt: skip
    data = taken(scene, content[kind], "I=I(V1)")
    assert data.time == pytest.approx(TIMES)
    assert data.values["mid"] == pytest.approx(MID, abs=1e-4)
    assert data.values["I"] == pytest.approx(np.full(6, 0.1))
    assert "sign turned" in data.said


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("forward", "forward FastAccess", "LTspice's fast access format: simulate again without it"),
        ("Command", "Offset: 5.0e-3\nCommand", "its times count from 5.0e-3 s .Offset.*: save from 0 on"),
    ],
)
def test_raw_file_of_ltspice_is_refused(before, after, said, scene):
    text = LTSPICE.replace(before, after) + "Values:\n" + rows("0\t{:.9e}\n\t{:.9e}\n\t-1e-1", TIMES, MID)
    with pytest.raises(SceneError, match=said):
        taken(scene, text)


@pytest.mark.parametrize(("drive", "probe", "value", "turned"), [
    ("voltage", "I", -0.1, True), ("voltage", "I", 0.1, False), ("voltage", "out", 0.1, True),
    ("current", "I", -0.1, True), ("current", "I", 0.1, False), ("current", "out", -0.1, False),
])  # fmt: skip
def test_current_has_the_sign_that_the_drive_gives(drive, probe, value, turned, scene):
    """A current enters the bar at the electrode of the larger voltage and leaves at the other, or where it is given;
    the voltage of the electrode beside a given current gives no sign."""
    if drive == "current":
        given = put(SCENE, ('voltage = "Vapp"', 'current = "0.1 A"'), ("voltage = 0}", 'voltage = "5 V"}'))
        scene.write_text(given, encoding="utf-8")
    data = taken(scene, f"time (s),{probe} (mA)\n" + rows("{:.9g}," + str(1e3 * value), TIMES))
    assert data.values[probe] == pytest.approx(np.full(6, -value if turned else value))
    assert ("sign turned to that of the voltage" in data.said) == turned


def put(text: str, *changes: tuple[str, str]) -> str:
    for before, after in changes:
        assert before in text
        text = text.replace(before, after, 1)
    return text


FIRST, THIRD = PAIRS.splitlines()[0], PAIRS.splitlines()[2]


@pytest.mark.parametrize(("unit", "first"), [("K", 0), ("degC", 3)])
def test_temperatures_of_a_scene_that_cools_are_absolute(unit, first, scene):
    """The last ones are below half of the initial temperature; what starts there, or has degrees, is no rise."""
    cooling = 293.15 + 506.85 * np.exp(-TIMES / 3.5e-5)
    written = rows("{:.9g},{:.9g}", TIMES[first:], cooling[first:] - 273.15 * (unit == "degC"))
    data = taken(scene, f"time (s),mid ({unit})\n{written}", settings=["scene.initial_temperature=800"])
    assert data.values["mid"] == pytest.approx(cooling[first:], abs=2e-5)


LEFT_OUT = {
    "#N/A": (THIRD, "1e-05,#N/A"), "NaN": (THIRD, "1e-05,NaN"), "overload": (FIRST, "0,OVLD"),
    "NaN of SCPI": (FIRST, "0,+9.91E37"), "word": (FIRST, "0,OPEN"), "infinity": (THIRD, "1e-05,-\N{INFINITY}"),
    "placeholder": (FIRST, "0,0"), "below 0 K": (FIRST, "0,-999"), "event": (THIRD, f"{THIRD}\n{THIRD}"),
    "jump at an event": (THIRD, f"1e-05,293.15\n{THIRD}"),
}  # fmt: skip


@pytest.mark.parametrize("kind", LEFT_OUT)
def test_rows_that_are_left_out(kind, scene):
    row, written = LEFT_OUT[kind]
    data = taken(scene, put("time (s),mid (K)\n" + PAIRS, (row, written)))
    twice = THIRD in written
    kept = np.arange(6) if twice else np.delete(np.arange(6), 0 if row == FIRST else 2)
    assert data.time == pytest.approx(TIMES[kept])
    assert data.values["mid"] == pytest.approx(MID[kept])
    said = "1 placeholder rows of zeros" if kind == "placeholder" else "1 of 6 rows are left out"
    assert ("1 of them twice, the second row is taken" if twice else said) in data.said


def test_zeros_in_degrees_before_the_start_are_placeholders(scene):
    data = taken(scene, "time (s),mid (degC)\n0,0\n" + rows("{:.9g},{:.9g}", TIMES[1:], MID[1:] - 273.15))
    assert data.values["mid"] == pytest.approx(MID[1:])
    assert "1 placeholder rows of zeros" in data.said


STEADY = {
    "COMSOL table": COMSOL + "% mid (K)   quarter (K)   I (mA)\n305.5728   302.4623   99.17895\n",
    "COMSOL sweep": COMSOL + "% Vapp (V)  mid (K)  quarter (K)  I (mA)\n0.05 296 295 50\n"
    "0.1 305.5728 302.4623 99.17895\n",
    "MOOSE": "time,mid,quarter,I\n0,293.15,293.15,0\n1,305.5728,302.4623,0.09917895\n",
    "MOOSE with an empty last row": "time,mid,quarter,I\n0,293.15,293.15,0\n1,305.5728,302.4623,0.09917895\n2,,,\n",
    "table with an empty last row": "mid (K),quarter (K),I (mA)\n305.5728,302.4623,99.17895\n,,\n",
    "list": "mid, 305.5728 K\nquarter, 302.4623 K\nI, 99.17895 mA\n",
    "list of a circuit": "mid = 305.5728 K\nquarter = 302.4623 K\ni(I) = 9.917895e-02\n",
    "operating point of LTspice": "  --- Operating Point ---\n\nV(mid):\t 305.5728\t voltage\n"
    "V(quarter):\t 302.4623\t voltage\nI(I):\t -0.09917895\t device_current\n",
    "operating point of ngspice": "\tNode      Voltage\n\t----      -------\n\t----\t-------\n\tmid  3.055728e+02\n"
    "\tquarter  3.024623e+02\n\n\tSource\tCurrent\n\t------\t-------\n\n\tI#branch   -9.917895e-02\n",
    "list with blanks": "mid 305.5728 K\nquarter 302.4623 K\nI 99.17895 mA\n",
    "list with remarks": "Probe\tValue\tUnit\tRemark\nmid\t32.4228\t°C\tcentre\nquarter\t29.3123\t°C\t\n",
    "list with units": "probe,value,unit\nmid,32.4228,degC\nquarter,29.3123,degC\nI,99.17895,mA\n",
    "list with decimal commas": "Probe;Wert;Einheit\nmid;32,4228;°C\nquarter;29,3123;°C\nI;99,17895;mA\n",
    "list with its unit in the head": "Probe;T [°C]\nmid;32,4228\nquarter;29,3123\n",
    "list with a gap": "mid: 305.5728 K\nquarter: 302.4623 K\nI: n/a\n",
    "table of one row": "mid (K),quarter (K),I (mA)\n305.5728,302.4623,99.17895\n",
}  # fmt: skip


REST = ["run.steady=true"]


@pytest.mark.parametrize("kind", STEADY)
def test_steady_values(kind, scene):
    data = taken(scene, STEADY[kind], settings=REST)
    assert data.at_rest
    assert data.values["mid"] == pytest.approx([305.5728])
    assert data.values["quarter"] == pytest.approx([302.4623])
    assert data.values.get("I", np.array([0.09917895])) == pytest.approx([0.09917895])


DC = "Title: bar\nPlotname: {}\nFlags: real\nNo. Variables: 3\nNo. Points: {}\nVariables:\n\t0\tv(v-sweep)\tvoltage\n\
\t1\tv(mid)\tvoltage\n\t2\ti(v1)\tcurrent\nValues:\n0 0.1\n305.5728\n-0.09917895\n"
CURVES = {
    "one value": (COMSOL + "% Temperature (K), Point: (50, 5, 5)\n305.5728\n", [], [305.5728]),
    "gaps": ("U (V),mid (K)\nNaN,305\n0.1,305.5728\n0.05,#N/A\n", ["Vapp curve=U (V)"], [305.5728]),
    "operating point of ngspice": (DC.format("Operating Point", 1), ["I=i(v1)"], [305.5728]),
    "DC analysis of ngspice": (
        DC.format("DC transfer characteristic", 2) + "1 0.2\n340\n-0.18\n", ["Vapp curve=v(v-sweep)"], [305.5728, 340],
    ),
    "wrdata of a DC analysis": (
        "v-sweep v(mid) v-sweep i(v1)\n0.1 305.5728 0.1 -0.09917895\n0.2 340 0.2 -0.18\n", ["Vapp curve=v-sweep"],
        [305.5728, 340],
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", CURVES)
def test_steady_values_and_curves_by_column(kind, scene):
    text, columns, mid = CURVES[kind]
    data = taken(scene, text, *columns, settings=REST)
    assert data.values["mid"] == pytest.approx(mid)
    assert data.values.get("I", np.array([0.09917895])) == pytest.approx([0.09917895])


def test_steady_rows_of_unknown_states_are_refused(scene):
    text = "U (V),mid (K)\n0.05,296\n0.1,305.6\n"
    with pytest.raises(SceneError, match=r"2 rows where the scene has one steady state.*KEY=COLUMN"):
        taken(scene, text, settings=REST)
    assert taken(scene, text, "Vapp=U (V)", settings=REST).values["mid"] == pytest.approx([305.6])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time (s);mid (K)\n" + rows("{:.9g};1.293,5", TIMES), '"mid .K." has no numbers'),
        (COMSOL + "% Grid\n0 1\n% Data\n1 2\n", r"grid.*: export a table of point evaluations"),
        (COMSOL + "% X\n5E-5\n% T (K) @ t=0\n293\n", "sectionwise.*: export a table"),
        (COMSOL + "% x  y  z  T (K) @ t=0  T (K) @ t=1\n0 0 0 293 294\n", "spreadsheet.*: export a table"),
        (COMSOL + "% Time (s)  mid (K) @ V0=1  mid (K) @ V0=2\n0 293 294\n", "runs beside one another"),
        ('time (ms),mid (K)\n"0.0",293\n"1,000.0",294\n"2,000.0",295\n', "not 00:01:30 or .1,234.5.*: there are"),
        ("time (hh:mm:ss),mid (K)\n00:00:01,293\n00:00:02,300\n00:00:03,305\n", "not 00:01:30"),
        ("time (s),mid (K)\n00:00:01,293\n00:00:02,300\n00:00:03,305\n", "not 00:01:30"),
        ("time\tV(mid)\nStep Information: V=50m  (Step: 1/2)\n0\t293\n1e-6\t294\n", "several runs, from .step"),
        ("a, b\nc, d\n", "has no rows of numbers"),
        ('"time (s)","T (K), Point: (1.2.3, 0, 0)"\n' + PAIRS, r'Point: \(1.2.3, 0, 0\)" is called as no quantity'),
        ("mid,305 parsec\n", "unknown unit"),
        ("time,I\ns,A\nScale,1e-3\n" + PAIRS, "Scale,1e-3. may be factors of its columns: multiply by them"),
        ("time/s mid/K\n0 293\n1e-6 294\n2e-6 295+0.2i\n3e-6 296\n", "row 4: .* is not 2 columns of numbers"),
        ("time (s),mid (parsec)\n" + PAIRS, "unknown unit"),
        ("Time,mid\n10:21:33 AM,293\n10:21:34 AM,294\n", "no column is the time"),
        ("2026-11-30T10:00:00Z,293\n2026-11-30T10:00:01Z,294\n", "no column is the time"),
    ],
)
def test_cause_and_cure_of_what_cannot_be_read(text, said, scene):
    with pytest.raises(SceneError, match=said) as caught:
        taken(scene, text, settings=REST * ("parsec" in text))
    assert "\n" not in str(caught.value)


def test_curve_over_a_parameter_is_solved_row_by_row(scene, ran):
    """Both ends of the bar are held at T0 and its conductivity is constant: the integral of rho from T0 to the peak
    is V^2/(8 k)."""
    volts = np.array([0.0, 0.05, 0.1, 0.2])
    k, rho, tcr = 100.0, 1e-6, 1e-3
    rise = (np.sqrt(1 + 2 * tcr * volts**2 / (8 * k * rho)) - 1) / tcr
    path = scene.with_name("curve.csv")
    command = f"solve {scene} --steady --against {path} --column 'Vapp curve=Vapp (V)'"
    for off in (0.0, 5.0):
        text = "Vapp (V),mid (K)\n" + rows("{:.9g},{:.9g}", volts, 293.15 + rise + off * (volts == 0.05))
        path.write_text(text, encoding="utf-8")
        summary, _ = ran(command)
        (check,) = [check for check in summary["checks"] if check["id"] == "against_mid"]
        assert check["difference"] == pytest.approx(off / rise.max(), abs=1e-3)
    assert main([*shlex.split(command), "--data-uncertainty", "1K"]) == 2


@pytest.mark.parametrize("sign", [1, -1])
def test_curve_of_currents_has_the_sign_of_each_voltage(sign, scene):
    text = f"V (V),I (A)\n-0.2,{-0.2 * sign}\n-0.1,{-0.1 * sign}\n0.1,{0.1 * sign}\n"
    data = taken(scene, text, "Vapp curve=V (V)", settings=REST)
    assert data.values["I"] == pytest.approx([-0.2, -0.1, 0.1])
    assert ("sign turned" in data.said) == (sign < 0)
