"""Which joint of a network is to blame: parts that add up, and a joint that is all there is."""

from dataclasses import replace

import pytest

from compare.blame import REST, network_budget
from fem3d.runs.scene import solve as solve_3d
from reduced1d.network import solve
from reduced1d.network.lines import layout
from scenes.model import Scene
from tests.reduced1d.network.scenes import COLD, at, box, flat, material, over, scene

UM = 1e-6


def stepped() -> Scene:
    """A wide bar, then a narrow one that heat enters through a constriction, which lines know nothing of."""
    found = scene(
        [box((0, 0, 0), (100 * UM, 40 * UM, 2 * UM), "wide"),
         box((100 * UM, 15 * UM, 0), (200 * UM, 25 * UM, 2 * UM), "narrow")],
        [flat("cold", (0, 0, 0), (0, 40 * UM, 2 * UM), temperature=COLD),
         flat("heat", (200 * UM, 15 * UM, 0), (200 * UM, 25 * UM, 2 * UM), heat_flux=1e8)],
        [at("tip", 200 * UM, 20 * UM, UM), over("through", (0, 0, 0), (0, 40 * UM, 2 * UM), quantity="heat_flow")],
        [material()], accuracy=1e-4,
    )  # fmt: skip
    return found


def test_a_constriction_is_all_there_is():
    given = stepped()
    three, one = solve_3d(given), solve(given)
    found = network_budget(given, three, one)
    tip = next(split for split in found.steady if split.quantity == "tip")
    names = [part.blame for part in tip.parts]
    assert names == ["wide | narrow", REST]
    assert sum(part.value for part in tip.parts) == pytest.approx(tip.total, rel=1e-9)
    # In series the flow is the same as in lines: 3D's resistance at the only joint leaves nothing.
    assert tip.parts[0].value < -10 * tip.parts[0].error
    assert abs(tip.parts[1].value) <= tip.parts[1].error
    # The accuracy of 3D is 3e-3 of the rise, a tenth of the total, and its bound a tenth of the accuracy.
    assert tip.parts[1].error < 0.02 * abs(tip.total)
    assert "the joint wide | narrow" in found.sentence
    # The same by hand: that resistance gives 3D's tip, one a fifth larger does not.
    flow = 1e8 * 20 * UM**2
    shape, extra = layout(given), -tip.parts[0].value / flow
    for factor, near in ((1.0, True), (1.2, False)):
        put_in = solve(replace(shape, measured=((("heat", 0), factor * extra),)))
        assert (abs(put_in.steady["tip"].value - three.steady["tip"].value) <= tip.parts[1].error) is near
