"""A material hotter than the range of its data is reported on the terminal, in the summary and in the report."""

import html
import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from compare import hottest
from scenes.model import Material
from validate.cli import main
from validate.report.output import farthest

RUNS = {
    "solve bridge": (["boundary.left electrode.voltage=100V"], "polysilicon reaches", "in the steady state"),
    "solve hotplate": (["boundary.drive.voltage=3V", "run.accuracy=0.05"], "platinum reaches", " at "),
    "sink --steady": (["drive.voltage=15"], "silicon reaches", "in the steady state"),
    "sink --only 1d": (["drive.voltage=15"], "silicon reaches", "in the steady state"),
    "device --figure 9": (["control.set_temperature=200degC"], "pdms reaches", " at "),
}


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
    report = html.unescape(re.sub(r"<[^>]+>", " ", Path("hot/report.html").read_text(encoding="utf-8"))).replace(
        "\xa0", " "
    )
    for place in (text, report):
        assert warning.partition(":")[0] in place
    # The same scene, cooler; how accurately it is solved stays.
    accuracy = [part for setting in settings[1:] for part in ("--set", setting)]
    assert main([*command.split(), "--no-figures", "--out", "cool", *accuracy]) == 0
    summary = json.loads(Path("cool/summary.json").read_text(encoding="utf-8"))
    assert not [warning for warning in summary["warnings"] if "valid_to" in warning]


def test_the_hottest_place_and_moment_of_each_material():
    """Two cells: one holds its steady 400 K, the other is hottest in between."""
    fields = SimpleNamespace(
        cells=np.arange(16).reshape(2, 8), material=np.array([0, 1]), material_names=["a", "b"], has_steady=True,
        steady=np.repeat([400.0, 300.0], 8),
        at=lambda times: np.stack([np.repeat([350.0, 300 + 1000 * t * (1 - t)], 8) for t in times]),
    )  # fmt: skip
    hot = [Material(name, 1, 1, 1, valid_to=limit) for name, limit in (("a", 399.0), ("b", 551.0), ("c", 1.0))]
    reached = hottest.of_fields(hot, fields, np.linspace(0, 1, 41), 600.0)
    assert reached == [(hot[0], 400.0, None), (hot[1], 550.0, 0.5)]
    (said,) = hottest.warnings(reached)
    assert said.startswith("a reaches 400 K in the steady state, past the 399 K")
    assert farthest(fields, np.linspace(0, 1, 41), 300.0) == (0.5, True)
    assert farthest(fields, np.array([0.0, 1.0]), 500.0) == (0.0, False)
