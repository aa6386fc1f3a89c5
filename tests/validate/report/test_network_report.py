"""Text, files and figures of a run with the network."""

import json

import pytest

from compare.options import Options
from compare.outcome import Outcome
from reduced1d.network.lines import layout
from scenes.loading import load
from statespace.runtime import CompactModel
from validate.cli import main
from validate.report.figures.scene_figures import network as draw


@pytest.mark.long
def test_the_table_is_printed_and_kept(tmp_path, capsys):
    out = tmp_path / "run"
    assert main(["solve", "bridge", "--model", "network", "--why", "--out", str(out)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "32 W/(m K) x 20 um2 / 200 um = 3.200 uW/K; 2e-05 ohm m x 200 um / 20 um2 = 200.0 ohm" in said
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    network = summary["reduced1d"]["network"]
    assert [row["what"] for row in network["joints"]] == ["left foot | beam", "right foot | beam"]
    assert network["lines"][0]["W/K"]["value"] == pytest.approx(32 * 20e-12 / 200e-6)
    middle = summary["why"]["steady"]["middle"]
    assert sum(part["value"] for part in middle["parts"]) == pytest.approx(middle["difference"]["value"], rel=1e-9)
    assert middle["parts"][-1]["assumption"] == "what lines cannot say"
    # Joints by their whole names, and shares of the same sign as the checks' differences, also of heat that leaves.
    assert "left foot | beam" in [part["assumption"] for part in middle["parts"]]
    for check in summary["checks"]:
        why = summary["why"]["steady"][check["id"]]
        assert why["difference"]["value"] / why["scale"] == pytest.approx(check["difference"], rel=1e-9)


def test_why_is_of_the_network(tmp_path, capsys):
    assert main(["solve", "bridge", "--why", "--out", str(tmp_path / "run")]) == 2
    assert "give --model network with it" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_the_picture_has_every_line_and_joint():
    scene = load("bridge")
    axes = draw(Outcome(scene, Options())).axes
    shape = layout(scene)
    assert len(axes) == 2
    for ax in axes:
        assert len(ax.patches) == len(shape.lines)
        lines, (joints, conditions) = ax.lines[: len(shape.lines)], ax.lines[len(shape.lines) :]
        assert len(joints.get_xdata()) == sum(link.other is not None for link in shape.heat)
        assert len(conditions.get_xdata()) == sum(not link.other for link in (*shape.heat, *shape.current))
        assert len(lines) == len(shape.lines)
    beam = axes[0].lines[0]
    assert [float(x) for x in beam.get_xdata()] == pytest.approx([0, 200])


@pytest.mark.parametrize(("name", "tallest"), [("bridge", 0.6), ("plate", 1.0)])
def test_the_view_from_above_is_in_true_proportions(name, tallest):
    """And no taller than its content, also for a long bridge."""
    figure = draw(Outcome(load(name), Options()))
    box = figure.axes[0].get_position()
    wide, tall = figure.get_size_inches() * (box.width, box.height)
    (left, right), (low, high) = figure.axes[0].get_xlim(), figure.axes[0].get_ylim()
    assert (right - left) / wide == pytest.approx((high - low) / tall, rel=1e-9)
    assert figure.get_figheight() <= tallest * figure.get_figwidth() + 0.1


@pytest.mark.long
def test_the_network_is_exported(tmp_path, ran):
    """As JSON, Python and SPICE, by the export of compact models."""
    folder = tmp_path / "few"
    summary, _ = ran(f"solve plate --model network --export {folder}")
    assert {"model.json", "model.py", "model.cir"} <= {entry.name for entry in folder.iterdir()}
    document = json.loads((folder / "model.json").read_text(encoding="utf-8"))
    one = summary["reduced1d"]["steady"]["E"]["value"]
    assert CompactModel(document).steady()["E"] == pytest.approx(one, rel=1e-7)
    assert "the network of its boxes" in (folder / "model.cir").read_text(encoding="utf-8")
