"""The table of a network: its formulas give its values, and its values are the parts of the network."""

import re
from typing import Any

import numpy as np
import pytest

from reduced1d.network import solve
from reduced1d.network.model import Model, table
from scenes.loading import load

UNITS = {
    "um2": "*1e-12", "um": "*1e-6", "W/(m2 K)": "", "W/(m K)": "", "W/m3": "", "W/m2": "", "kg/m3": "", "J/(kg K)": "",
    "ohm m": "",
}  # fmt: skip


def worked_out(formula: str) -> float:
    """Return the value of a formula in SI units."""
    for unit in sorted(UNITS, key=len, reverse=True):
        formula = re.sub(rf"([\d.e+-]+) {re.escape(unit)}(?![\w(])", rf"(\1{UNITS[unit]})", formula)
    return float(eval(formula.replace(" x ", " * "), {"__builtins__": {}}))


@pytest.mark.parametrize("name", ["bridge", "plate", "hotplate"])
def test_formulas_give_the_values_that_the_network_has(name):
    scene = load(name)
    model: Model = solve(scene).details["model"]
    made, layout = table(model.layout), model.layout
    rows: list[dict[str, Any]] = [row for part in made.values() for row in part]
    cells = [cell for row in rows for key, cell in row.items() if key not in ("what", "how")]
    assert len(cells) > len(layout.lines)
    for cell in cells:
        # Formulas show six digits of each number.
        assert worked_out(cell["formula"]) == pytest.approx(cell["value"], rel=1e-5), cell
    branches = {key: model.conduction[at] for key, at in model.heat.rows.items()}
    for part, joint in (("joints", True), ("conditions", False)):
        numbers = [n for n, link in enumerate(layout.heat) if (link.other is not None) == joint]
        for row, number in zip(made[part], numbers, strict=False):
            if ("link", number) in branches:
                assert row["W/K"]["value"] == pytest.approx(branches["link", number].sum(), rel=1e-12)
    for i, line in enumerate(layout.lines):
        # Of a line's branches, each k A dx for a gradient, the sum is k A L.
        assert made["lines"][i]["W/K"]["value"] == pytest.approx(branches["line", i].sum() / line.length**2, rel=1e-12)
        if "J/K" in made["lines"][i]:
            unit = np.zeros(model.elements.size)
            unit[model.elements.dofs[:2, model.elements.first[i] : model.elements.first[i + 1]]] = 1.0
            assert made["lines"][i]["J/K"]["value"] == pytest.approx(unit @ model.capacity @ unit, rel=1e-12)
    if model.current is not None:
        resistances = 1 / model.resistances(np.zeros(model.elements.size))[1]
        for i, line in enumerate(layout.lines):
            if "ohm" in made["lines"][i]:
                along = resistances[model.current.rows["line", i]].sum() / line.length**2
                assert made["lines"][i]["ohm"]["value"] == pytest.approx(1 / along, rel=1e-12)


def test_the_sinks_anchor_by_hand():
    """The numbers that make 1282 and 958 K/W, as one reads them."""
    from dataclasses import replace

    scene = load("sink").scene()
    made = table(solve(replace(scene, steady=True)).details["model"].layout)
    joints = {row["what"]: row for row in made["joints"]}
    assert joints["pad-0 | beam"]["how"] == "ends meet, nothing between"
    down = joints["oxide-0 | pad-0"]
    assert down["how"] == "point by point, y = -100 um to -50 um of oxide-0 and y = -100 um to -50 um of pad-0"
    assert down["W/K"]["formula"] == "2500 um2 / (1 um/1.38 W/(m K) + 1 um/130 W/(m K))"
    beam = next(row for row in made["lines"] if row["what"] == "beam")
    assert beam["W/K"]["formula"] == "130 W/(m K) x 200 um2 / 1000 um"
    assert beam["W/K"]["value"] == pytest.approx(26e-6)
    assert beam["ohm"]["formula"] == "6e-05 ohm m x 1000 um / 200 um2"
    assert beam["ohm"]["value"] == pytest.approx(300)
