"""A material hotter than the range of its data is reported on the terminal, in the summary and in the report."""

import html
import json
import re
from pathlib import Path

import pytest

from validate.cli import main

RUNS = {
    "solve bridge": (
        ["material.polysilicon.valid_to=400K", "material.oxide.valid_to=400K"], "polysilicon reaches", "in the steady",
    ),  # 415 K and 321 K
    "solve hotplate": (["boundary.drive.voltage=3V", "run.accuracy=0.05"], "platinum reaches", " at "),
    "sink --steady": (["drive.voltage=15"], "silicon reaches", "in the steady state"),
    "sink --only 1d": (["drive.voltage=15"], "silicon reaches", "in the steady state"),
    "device --figure 9": (["control.set_temperature=200degC"], "pdms reaches", " at "),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("command", RUNS)
def test_it_is_said_everywhere_and_only_where_it_is_so(command, capsys):
    settings, said, when = RUNS[command]
    options = [part for setting in settings for part in ("--set", setting)]
    assert main([*command.split(), "--no-figures", "--out", "hot", *options]) == 0
    text = " ".join(capsys.readouterr().out.split())
    summary = json.loads(Path("hot/summary.json").read_text(encoding="utf-8"))
    (warning,) = [w for w in summary["warnings"] if said in w]
    assert when in warning
    assert "oxide reaches" not in str(summary["warnings"])
    report = html.unescape(re.sub(r"<[^>]+>", " ", Path("hot/report.html").read_text(encoding="utf-8"))).replace(
        "\xa0", " "
    )
    for place in (text, report):
        assert warning.partition(":")[0] in place
    # The same scene, cooler; how accurately it is solved stays.
    accuracy = [part for setting in settings[1:] for part in ("--set", setting)]
    assert main([*command.split(), "--no-figures", "--out", "cool", *accuracy]) == 0
    assert not [
        w for w in json.loads(Path("cool/summary.json").read_text(encoding="utf-8"))["warnings"] if "valid_to" in w
    ]
