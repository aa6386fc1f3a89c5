"""Which column is which quantity: ordinary headers, --column, ngspice's tables, and columns of another scene."""

import numpy as np
import pytest

from scenes.errors import SceneError
from tests.compare.data import found

TIMES = np.array([0.0, 1.0, 5.0, 20.0])
RISES = np.array([0.0, 10.0, 18.0, 20.0])


def table(*columns: tuple[str, np.ndarray], separator: str = ",") -> str:
    names = separator.join(f'"{name}"' if separator in name else name for name, _ in columns)
    rows = (separator.join(f"{value:.9g}" for value in row) for row in zip(*(v for _, v in columns), strict=True))
    return names + "\n" + "\n".join(rows) + "\n"


MILLISECONDS = ("Time (ms)", TIMES)


@pytest.mark.parametrize(
    ("header", "key", "values"),
    [
        ("peak / °C", "peak_K", 19.85 + RISES), ("Peak [degC]", "peak_K", 19.85 + RISES),
        ("peak(K)", "peak_K", 293 + RISES), ("fem3d_peak_K", "peak_K", 293 + RISES), ("v(end)", "end_K", RISES),
        ("peak rise (degC)", "peak_K", RISES), ("mean_rise_mK", "mean_K", 1e3 * RISES),
    ],
)  # fmt: skip
def test_ordinary_headers(header, key, values, tmp_path):
    """Kelvins, degrees and rises, a rise in degrees among them; and one in kelvins that is not called so."""
    for separator in (",", "  "):
        data = found(tmp_path, table(MILLISECONDS, (header, values), separator=separator))
        assert list(data.values) == [key]
        assert data.values[key] == pytest.approx(293 + RISES)
        assert data.time == pytest.approx(1e-3 * TIMES)


POINTS = (("T (K), Point 1", 293 + RISES), ("T (K), Point 2", 293 + RISES / 4))


def test_column_settles_what_cannot_be_told(tmp_path):
    text = table(MILLISECONDS, *POINTS)
    with pytest.raises(SceneError, match='--column "peak'):
        found(tmp_path, text)
    for peak, end in (("T (K), Point 1", "T (K), Point 2"), ("t (k), point 1", "3")):
        data = found(tmp_path, text, f"peak={peak}", f"end={end}")
        assert data.values["peak_K"] == pytest.approx(293 + RISES)
        assert data.values["end_K"] == pytest.approx(293 + RISES / 4)
        assert list(data.report["columns"].values()) == ["Time (ms)", "T (K), Point 1", "T (K), Point 2"]
    both = table(MILLISECONDS, ("peak (K)", 293 + RISES), ("peak rise (K)", RISES / 4))
    with pytest.raises(SceneError, match=r'both "peak .*--column peak='):
        found(tmp_path, both)
    data = found(tmp_path, both, "peak=peak rise (K)")
    assert data.values["peak_K"][-1] == pytest.approx(298.0)
    assert "peak (K)" in data.report["left_out"]


def test_names_that_stand_twice_are_told_apart_by_numbers(tmp_path):
    text = table(MILLISECONDS, ("T (K)", 293 + RISES), ("T (K)", 293 + RISES / 4))
    data = found(tmp_path, text, "peak=2", "end=3")
    assert [data.values[key][-1] for key in ("peak_K", "end_K")] == pytest.approx([313.0, 298.0])
    with pytest.raises(SceneError, match=r'both "T .*by name or number, --column peak='):
        found(tmp_path, text, "peak=T (K)")


def test_a_column_that_is_in_the_way_is_left_out(tmp_path):
    """Called like a key of the scene, and not meant for it."""
    text = table(MILLISECONDS, ("peak (K)", 293 + RISES), ("width (mm)", np.full(4, 3.0)))
    with pytest.raises(SceneError, match="no run of this scene"):
        found(tmp_path, text)
    for name in ("width (mm)", "width"):
        assert found(tmp_path, text, f"ignore={name}").report["left_out"] == {"width (mm)": "is left out by --column"}


def test_column_gives_units_and_rises(tmp_path):
    text = table(("Time", TIMES), ("sensor", RISES), ("A", 19.85 + RISES))
    numbered = "0,1,2\n" + text.split("\n", 2)[2]  # as pandas writes columns without names
    for each, *told in ((text, "time (ms)=Time", "peak rise (K)=sensor"), (numbered, "time (ms)=1", "peak (degC)=3")):
        data = found(tmp_path, each, *told)
        assert data.time == pytest.approx(1e-3 * TIMES[len(TIMES) - len(data.time) :])
        assert data.values["peak_K"] == pytest.approx((293 + RISES)[len(RISES) - len(data.time) :])


def wrdata(names: bool, single: bool) -> str:
    """The output of ngspice 39: numbers with a sign or a space before and a space behind, names padded to 15."""
    vectors = {"v(peak)": RISES, "v(end)": RISES / 4, "vdrive#branch": -3.3e-3 + 1e-6 * RISES}
    columns: list[tuple[str, np.ndarray]] = [("time", 1e-3 * TIMES)] if single else []
    for name, values in vectors.items():
        columns += [(name, values)] if single else [("time", 1e-3 * TIMES), (name, values)]
    head = " " + " ".join(f"{name:<15}" for name, _ in columns) + "\n" if names else ""
    return head + "".join(
        "".join(f"{v: .8e} " for v in row) + "\n" for row in zip(*(v for _, v in columns), strict=True)
    )


@pytest.mark.parametrize("names", [True, False])
@pytest.mark.parametrize("single", [True, False])
def test_wrdata(names, single, tmp_path):
    """With and without wr_vecnames and wr_singlescale; columns without names are assigned by number, never guessed."""
    told: tuple[str, ...] = ("current=vdrive#branch",)
    if not names:
        with pytest.raises(SceneError, match='"column 2" is called as no quantity'):
            found(tmp_path, wrdata(names, single))
        told = ("peak=2", "end=3", "current=4") if single else ("peak=2", "end=4", "current=6")
    data = found(tmp_path, wrdata(names, single), *told)
    assert data.time == pytest.approx(1e-3 * TIMES)
    assert np.stack([data.values["peak_K"], data.values["end_K"]]) == pytest.approx(293 + np.stack([RISES, RISES / 4]))
    assert data.values["current_A"] == pytest.approx(3.3e-3 - 1e-6 * RISES)
    assert "rise" in data.report["read_as"]["peak_K"]
    assert "volts" not in data.report["read_as"]["current_A"]


def test_wrdata_of_several_times_is_refused(tmp_path):
    unequal = wrdata(True, False).replace(" 1.00000000e-03  2.5", " 1.10000000e-03  2.5")
    with pytest.raises(SceneError, match="several columns are the time"):
        found(tmp_path, unequal)


def test_what_may_be_of_another_scene_is_warned_of(tmp_path):
    """COMSOL's own room temperature is 293.15 K; the paper's is 293 K."""
    assert found(tmp_path, table(MILLISECONDS, ("peak (K)", 293.05 + RISES))).warnings == ()
    (said,) = found(tmp_path, table(MILLISECONDS, ("peak (K)", 293.15 + RISES))).warnings
    assert "0.15 K above" in said
    assert "--set room_temperature=293.15" in said
    (said,) = found(tmp_path, table(("Time (us)", TIMES), ("peak (K)", 293 + RISES))).warnings
    assert "only what both cover is compared" in said


def test_rows_with_an_empty_cell_are_left_out_and_counted(tmp_path):
    """Rows of the compared columns; a column that is left out, or unknown, costs no row."""
    text = "t (ms);peak [K];end [K];remark\n0;293;293;\n1;;294;1\n5;311;;2\n;312;296;3\n17;313;297;\n18;314;298;4\n"
    data = found(tmp_path, text)
    assert data.time == pytest.approx([0.0, 0.017, 0.018])
    assert data.values["end_K"] == pytest.approx([293.0, 297.0, 298.0])
    assert '2 of 5 rows are left out, for "peak [K]", "end [K]" has no number there' in data.said
    assert "1 rows without one are left out" in data.said
    data = found(tmp_path, text, "ignore=end [K]")
    assert data.time == pytest.approx([0.0, 5e-3, 0.017, 0.018])
    assert data.values["peak_K"] == pytest.approx([293.0, 311.0, 313.0, 314.0])


TWICE = (MILLISECONDS, *POINTS)
REFUSED = {
    # by --column
    "no pair": (TWICE, ["peak"], "NAME=COLUMN"), "no quantity": (TWICE, ["top=T (K), Point 1"], "no quantity"),
    "no such name": (TWICE, ["peak=T (K), Point 3"], 'mean "T'), "no such number": (TWICE, ["peak=9"], "no column"),
    "a quantity twice": (TWICE, ["peak=2", "peak=3"], "already"),
    "a column twice": (TWICE, ["peak=2", "end=2"], "already"),
    "no current": (TWICE, ["current=2"], "can't be \"current\""),
    "no volts": (TWICE, ["peak (V)=2"], "can't be \"peak .V.\""),
    "no time": (TWICE, ["time=2"], "can't be \"time\""),
    "time as peak": (TWICE, ["peak=Time (ms)"], "is a time, not a temperature"),
    # of another scene: each would otherwise come out as a difference of the models
    "rises in degrees": ((MILLISECONDS, ("peak (degC)", RISES)), (),
                         r'19\.85 K below .* --column "peak rise=peak \(degC\)"'),
    "a rise of kelvins": ((MILLISECONDS, ("peak rise (K)", 293 + RISES)), (), "293 K above"),
    "a warmer room": ((MILLISECONDS, ("peak (K)", 300 + RISES)), (), "7 K above .* --set room_temperature=300"),
    "seconds": ((("Time (s)", TIMES), ("peak (K)", 293 + RISES)), (), r"1 of its times.* --column \"time \(ms\)="),
    # without a unit
    "degrees": ((MILLISECONDS, ("peak", 19.85 + RISES)), (), r"19\.85 K above .*--column"),
    "a stress": ((MILLISECONDS, ("max stress", RISES)), (), '"max stress" is called as no quantity'),
    "a voltage": ((MILLISECONDS, ("peak (mV)", RISES)), (), "is a voltage, not a temperature"),
    "an absolute rise": ((MILLISECONDS, ("peak rise", 293 + RISES)), (), "293 K above"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_columns_are_refused_in_a_sentence(case, tmp_path):
    columns, told, said = REFUSED[case]
    with pytest.raises(SceneError, match=said) as caught:
        found(tmp_path, table(*columns), *told)
    assert "\n" not in str(caught.value)
