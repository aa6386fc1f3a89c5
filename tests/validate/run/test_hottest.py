"""A material hotter than the range of its data is reported on the terminal, in the summary and in the report."""

import pytest

from tests.validate.cli import page_text

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
def test_it_is_said_everywhere_and_only_where_it_is_so(command, ran, tmp_path):
    settings, said, when = RUNS[command]
    options = [part for setting in settings for part in ("--set", setting)]
    summary, text = ran(command, *options)
    (warning,) = [w for w in summary["warnings"] if said in w]
    assert when in warning
    assert "oxide reaches" not in str(summary["warnings"])
    for place in (" ".join(text.split()), page_text(tmp_path / "run")):
        assert warning.partition(":")[0] in place
    # The same scene, cooler; how accurately it is solved stays.
    summary, _ = ran(command, *options[2:])
    assert not [w for w in summary["warnings"] if "valid_to" in w]
