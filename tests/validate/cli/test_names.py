"""Default folders differ where results differ; a run that replaces an earlier one reports it."""

from importlib import import_module
from pathlib import Path

import pytest

from tests.validate.cli import summary
from validate.cli import main

SAME = {"--help", "--out", "--no-figures", "--explain", "--dry-run", "--strict", "--quiet", "--json"}
"""The options that change no number and add nothing to the results."""

DIFFERENT = {
    "sink": [
        "", "--voltage 2", "--voltage -2V", "--voltage 0.002", "--set sink.width=20um",
        "--accuracy 1e-4", "--steady", "--only 3d", "--only 1d",
        "--reduction fin", "--reduction moments:3", "--why", "--sensitivities", "--uncertain materials",
        "--uncertain oxide_width=1% --uncertain pad_width=1%",
        "--uncertain oxide_width=1% --uncertain pad_width=1% --correlated oxide_width,pad_width=0.5",
        "--uncertain materials --monte-carlo 10", "--fields",
        "--fields --field-times 1ms",
        "--fields --field-times 2ms", "--against a.csv", "--against b.csv", "--against sub/a.csv", "--against ../a.csv",
        "--against a.csv --column mean=2", "--against a.csv --data-uncertainty 0.5K",
        "--against a.csv --data-uncertainty peak=1K --calibrate pad_width",
        "--set tolerances.eq14=0.4",
        "--set expect_differs=eq13", "--steady --why", "--set name=other", "--left-out",
    ],
    "device": [
        "", "--set control.sample_time=1ms", "--accuracy 1e-3", "--figure 9", "--figure 10", "--figure 9 --figure 10",
        "--scheme paper", "--meter PXI-4070", "--meter MAX1367", "--max-power 2mW", "--max-power 3mW",
        "--max-voltage 1", "--set tolerances.fig9_balance=0.5", "--sensitivities",
        "--uncertain materials",
        "--uncertain materials --correlated silicon.resistivity,oxide.thermal_conductivity=0.5",
        "--3d",
    ],
    "solve": [
        "bridge", "plate", "bridge --set run.accuracy=1e-4", "bridge --accuracy 1e-5", "bridge --fields",
        "bridge --set boundary.left~electrode.voltage=-2", "bridge --set boundary.left~electrode.voltage=2",
        "bridge --model model.csv", "bridge --model network", "bridge --model network --why",
        "bridge --steady", "bridge --memory 3GB", "hotplate", "hotplate --end-time 2ms", "hotplate --end-time 3ms",
        "bridge --sensitivities",
        "bridge --uncertain polysilicon.resistivity=1%",
        "bridge --uncertain polysilicon.resistivity=1% --uncertain oxide.thermal_conductivity=1% "
        "--correlated polysilicon.resistivity,oxide.thermal_conductivity=0.5",
        "bridge --against values.csv", "bridge --against others.csv",
        "bridge --against values.csv --column middle=middle",
        "bridge --against values.csv --data-uncertainty 0.5K --calibrate polysilicon.resistivity",
    ],
}  # fmt: skip


@pytest.fixture(autouse=True)
def _somewhere(tmp_path, monkeypatch):
    (tmp_path / "here" / "sub").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "here")
    for name in ("model.csv", "values.csv", "others.csv"):
        Path(name).write_text("probe,value\nmiddle,300\nbeam mean,290\n", encoding="utf-8")
    for name in ("a.csv", "b.csv", "sub/a.csv", "../a.csv"):
        Path(name).write_text("time (ms),peak (K)\n0,293\n1,294\n2,295\n3,296\n", encoding="utf-8")


def folder(command: str, arguments: str, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of a run without running it."""
    found: list[Path] = []

    def stop(scene: object, request: object, out: Path, *_: object) -> None:
        found.append(out)
        raise KeyboardInterrupt

    monkeypatch.setattr("validate.report.output.run", stop)
    assert main([command, *(part.replace("~", " ") for part in arguments.split())]) == 130
    return found[0]


@pytest.mark.parametrize("command", DIFFERENT)
def test_different_results_have_different_folders(command, monkeypatch):
    folders = [folder(command, arguments, monkeypatch) for arguments in DIFFERENT[command]]
    assert len(set(folders)) == len(folders), sorted(folders)
    assert all(found.parent == Path("results") for found in folders)
    plain = {"sink": "sink-1V", "device": "device-273K", "solve": "bridge"}[command]
    if command == "sink":
        names = ("sink-2V", "sink-minus2V", "sink-2mV", "sink-1V-width20um")
        assert [found.name for found in folders[1:5]] == list(names)
        assert folder(command, "--voltage 2mV", monkeypatch) == folders[3]
    assert folders[0].name == plain
    for option in SAME - {"--help", "--out"}:
        if (command, option) != ("solve", "--strict") and option != "--dry-run":
            assert folder(command, f"{DIFFERENT[command][0]} {option}", monkeypatch).name == plain


@pytest.mark.parametrize("command", DIFFERENT)
def test_every_option_is_one_or_the_other(command):
    """A new option is put into the folder's name, or into the list of options without effect."""
    options = import_module(f"validate.cli.{command}").OPTIONS
    known = {usage.split()[0] for usage in options if usage.startswith("--")}
    tried = {word for arguments in DIFFERENT[command] for word in arguments.split() if word.startswith("--")}
    # A model goes to a folder of its own.
    assert known - SAME - tried - {"--export", "--states", "--model-accuracy"} == set()


def test_long_commands_are_cut_and_still_told_apart(monkeypatch):
    long = " ".join(f"--set boundary.left~electrode.voltage={k}.000000001" for k in range(1, 9))
    one, other = (folder("solve", f"bridge {long} {more}", monkeypatch) for more in ("--fields", ""))
    assert one != other
    assert len(one.name) < 90


@pytest.mark.usefixtures("no_solver")
def test_what_replaces_an_earlier_run_says_so(capsys):
    first = ["sink", "--no-figures", "--out", "my run"]
    assert main(first) == 0
    assert "Replaces" not in capsys.readouterr().out
    assert summary("my run")["command"] == "validate sink --no-figures --out 'my run'"
    assert "validate sink --no-figures --out &#x27;my run&#x27;" in Path("my run/report.html").read_text(
        encoding="utf-8"
    )
    main([*first, "--steady"])
    said = " ".join(capsys.readouterr().out.split())
    assert "Replaces the earlier run (validate sink --no-figures --out 'my run')." in said
