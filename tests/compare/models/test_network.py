"""The network as a model: judged like any other, with errors, and without code that a scene could bring."""

import json
from dataclasses import replace

import pytest

from compare import pipeline
from compare.blame import REST, network_budget
from compare.options import Options
from fem3d.runs.scene import solve as solve_3d
from reduced1d.network import solve
from reduced1d.network.lines import layout
from scenes.errors import RunawayError, SceneError
from scenes.model import MeshScene, Scene
from tests.reduced1d.network.scenes import COLD, at, box, flat, material, over, scene
from validate.cli import main


def test_a_network_without_an_answer_leaves_what_3d_found(steady, monkeypatch, capsys):
    def runs_away(*_: object, **__: object) -> None:
        raise RunawayError("the network runs away", 1.0)

    monkeypatch.setattr("compare.models.network.solve", runs_away)
    out = steady.parent / "run"
    assert main(["solve", str(steady), "--model", "network", "--no-figures", "--out", str(out)]) == 3
    said = capsys.readouterr()
    assert said.err.endswith("network has no answer: the network runs away; what 3D found is kept\n")
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["fem3d"]["steady"]["tip"]["value"] == pytest.approx(400.0)
    assert "reduced1d" not in summary


def test_why_of_a_drive_that_varies_is_said(transient, ran):
    source = 'heat_source = {times = [0, "0.2 ms"], values = [1e12, 2e12]}'
    transient.write_text(transient.read_text(encoding="utf-8").replace("heat_source = 1e12", source), encoding="utf-8")
    summary, _ = ran(f"solve {transient} --model network --why --accuracy 1e-2")
    assert any("--why is of the steady state" in text for text in summary["warnings"])


def test_a_network_of_a_mesh_is_refused_before_3d_is_solved():
    """The scene alone decides: the mesh file is not even read."""
    scene = MeshScene("plug", "none.msh", 1.0, (), (), (), ())
    for ask in (pipeline.plan, pipeline.solve):
        with pytest.raises(SceneError, match="is on a mesh file, and a network is made of boxes"):
            ask(scene, Options(model="network"))


def test_the_table_and_the_parts_of_the_differences_are_printed_and_kept(ran):
    summary, said = ran("solve bridge --model network --why --accuracy 1e-2")
    said = " ".join(said.split())
    assert "3.200 uW/K 200.0 ohm" in said
    assert "along y, 30 um long, 10 um x 2 um; alike: right foot" in said
    assert "y = 0 um to 30 um of beam; alike: right foot | beam" in said
    assert said.count("point by point") == 1
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


UM = 1e-6


def stepped() -> Scene:
    """A wide bar, then a narrow one that heat enters through a constriction, which lines know nothing of."""
    return scene(
        [box((0, 0, 0), (100 * UM, 40 * UM, 2 * UM), "wide"),
         box((100 * UM, 15 * UM, 0), (200 * UM, 25 * UM, 2 * UM), "narrow")],
        [flat("cold", (0, 0, 0), (0, 40 * UM, 2 * UM), temperature=COLD),
         flat("heat", (200 * UM, 15 * UM, 0), (200 * UM, 25 * UM, 2 * UM), heat_flux=1e8)],
        [at("tip", 200 * UM, 20 * UM, UM), over("through", (0, 0, 0), (0, 40 * UM, 2 * UM), quantity="heat_flow")],
        [material()], accuracy=1e-4,
    )  # fmt: skip


def test_a_constriction_is_all_there_is():
    given = stepped()
    three, one = solve_3d(given), solve(given)
    found = network_budget(given, three, one)
    tip = next(split for split in found.steady if split.quantity == "tip")
    names = [part.assumption for part in tip.parts]
    assert names == ["wide | narrow", REST]
    assert sum(part.value for part in tip.parts) == pytest.approx(tip.difference.value, rel=1e-9)
    # In series the flow is the same as in lines: 3D's resistance at the only joint leaves nothing.
    assert tip.parts[0].value < -10 * tip.parts[0].error
    assert abs(tip.parts[1].value) <= tip.parts[1].error
    # The accuracy of 3D is 3e-3 of the rise, a tenth of the total, and its bound a tenth of the accuracy.
    assert tip.parts[1].error < 0.02 * abs(tip.difference.value)
    assert "the joint wide | narrow" in found.sentence
    # The same by hand: that resistance gives 3D's tip, one a fifth larger does not.
    flow = 1e8 * 20 * UM**2
    shape, extra = layout(given), -tip.parts[0].value / flow
    for factor, near in ((1.0, True), (1.2, False)):
        put_in = solve(replace(shape, measured=((("heat", 0), factor * extra),)))
        assert (abs(put_in.steady["tip"].value - three.steady["tip"].value) <= tip.parts[1].error) is near
