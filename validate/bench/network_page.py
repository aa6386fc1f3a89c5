"""The network by hand against 3D: ``python -m validate.bench.network_page``.

Writes docs/network.md (``--out``), every number of which is found by the run: how far the network of lines is from 3D
for five structures, which joints are to blame, and one table as it is printed. Takes about a minute.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from compare.blame import Budget
from compare.network_blame import blame
from fem3d.runs.scene import solve as solve_3d
from reduced1d.network import solve
from reduced1d.network.lines import layout
from scenes.errors import NumericsError
from scenes.formats import percent, quantity, with_error
from scenes.loading import load
from scenes.model import UNITS, Probe, Scene
from scenes.result import Result
from scenes.sink import Sink, face
from validate.report.network import section
from validate.report.table import Style, Table

MOST = 6
"""Joints of a scene that its table has room for."""

HEAD = """\
# The network by hand, against 3D

Made by `python -m validate.bench.network_page`; every number here is that command's output.

`validate solve SCENE --model network` makes of any union of boxes the model that one makes by hand, and judges it
against 3D.

- Every box is a line along its longest side, its temperature one over the cross-section. What later boxes leave of an
  earlier one is cut into boxes, each a line.
- Two boxes that touch are joined over the interval of each line that the face covers: a face at a line's end with no
  resistance of its own, a face at its side with half the thickness, d/(2 k A), so that a slab crossed by heat has its
  whole thickness. Temperatures, films and electrodes likewise; fluxes, sources and Joule heat act per length.
- Lines that run alike and touch along their sides exchange heat point by point (a fin), others by the means over their
  intervals. Currents flow by the same lines, and resistances follow the local temperature.

It is solved with scikit-fem's line elements to far below what is judged. Along a line k A dT/ds is what flows, exactly,
for the mean temperature over the cross-section; so all that the network gets wrong is at its joints and conditions.
`--why` takes of each the resistance that 3D has there (the difference of the mean temperatures over the cross-sections
that it joins, over the flow), puts in one after the other, and charges each with what that changes. What then remains
is how flows spread over joints and how resistivities follow the local temperature, which lines cannot say.
"""


def scenes() -> dict[str, Any]:
    """The structures, in the steady state."""
    whole = Sink().scene()
    boxes = {box.name: box for box in whole.boxes}
    flow = Probe("heat to the substrate", *face(boxes["oxide-0"], 2, 0), "heat_flow")
    current = Probe("current", *face(boxes["beam"], 1, 0), "current")
    return {
        "The bridge (`validate solve bridge --model network --why`)": load("bridge"),
        "The plate, a problem in 2D (`validate solve plate ...`)": load("plate"),
        "The hot plate at 0.2 V (`--set boundary.drive.voltage=0.2V --steady`)":
            load("hotplate", ["boundary.drive.voltage=0.2V", "run.steady=true"]),
        "A micro hot plate on four arms with a meander (`validate/bench/microplate.toml`)":
            load(str(Path(__file__).with_name("microplate.toml"))),
        "The paper's sink as boxes": replace(whole, probes=(*whole.probes, flow, current), steady=True),
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--out", default="docs/network.md", help="the page (default docs/network.md)")
    arguments = parser.parse_args()
    parts = [HEAD]
    for title, scene in scenes().items():
        print(title, file=sys.stderr, flush=True)
        parts.append(told(title, scene))
    bridge = next(iter(scenes().values()))
    parts += ["## The bridge's network, to check by hand\n", "```text", *table_of(bridge), "```"]
    Path(arguments.out).write_text("\n".join(parts).rstrip("\n") + "\n", encoding="utf-8")


def told(title: str, scene: Scene) -> str:
    """The part of the page on one structure."""
    started = time.process_time()
    one = solve(scene)
    took = time.process_time() - started
    three = solve_3d(scene)
    shape = layout(scene)
    how = (
        f"{len(shape.lines)} lines, {len(shape.joints)} joints, solved in {quantity(took, 's', 2)} of processor time; "
        f"3D has {three.details['unknowns']} unknowns."
    )
    parts = [f"## {title}\n", how, "", *_compared(scene, one, three), ""]
    if title.endswith("sink as boxes"):
        by_hand, in_3d = (anchor(scene, result) for result in (one, three))
        parts += [f"Anchor resistance, end rise over heat: {by_hand:.1f} K/W by hand, {in_3d:.1f} K/W in 3D.", ""]
    try:
        why = blame(scene, three, one)
    except NumericsError as error:
        return "\n".join([*parts, f"Which joint is to blame is not known: {error}.", ""])
    parts += [*_blamed(why), "", f"{why.sentence[0].upper()}{why.sentence[1:]}.", ""]
    return "\n".join(parts)


def anchor(scene: Scene, result: Result) -> float:
    """The anchor resistance of the sink (K/W)."""
    rise = result.steady["end"].value - scene.initial_temperature
    return rise / -result.steady["heat to the substrate"].value


def _compared(scene: Scene, one: Result, three: Result) -> list[str]:
    rows = []
    for probe in scene.probes:
        unit = UNITS[probe.quantity]
        exact, hand = three.steady[probe.name], one.steady[probe.name]
        base = scene.initial_temperature if probe.quantity == "temperature" else 0.0
        value, error, shown, places, factor = with_error(exact.value - base, exact.error, unit)
        off = percent((hand.value - exact.value) / (exact.value - base), sign=True)
        rows.append(
            [probe.name, f"{(hand.value - base) * factor:.{places}f} {shown}", f"{value} ± {error} {shown}", off]
        )
    heads = ("probe (temperatures above the initial one)", "network", "3D", "difference")
    return Table(heads, rows, "<" * len(heads)).markdown()


def _blamed(why: Budget) -> list[str]:
    """The parts of the first probes' differences, the largest first."""
    splits = [split for split in why.steady if split.scale][:3]
    count = len(splits[0].parts)
    order = sorted(range(count - 1), key=lambda n: -max(abs(s.parts[n].value / s.scale) for s in splits))
    rows = [[splits[0].parts[n].blame, *(_cell(s.parts[n].value, s.scale) for s in splits)] for n in order[:MOST]]
    if order[MOST:]:
        sums = (sum(s.parts[n].value for n in order[MOST:]) for s in splits)
        rest = [_cell(value, s.scale) for value, s in zip(sums, splits, strict=True)]
        rows.append([f"{len(order) - MOST} more together", *rest])
    rows.append([splits[0].parts[-1].blame, *(_cell(s.parts[-1].value, s.scale) for s in splits)])
    rows.append(["in all", *(_cell(s.total, s.scale) for s in splits)])
    heads = ("3D's resistance put in at", *(split.quantity for split in splits))
    return Table(heads, rows, "<" * len(heads)).markdown()


def _cell(value: float, scale: float) -> str:
    return percent(value / scale, sign=True)


def table_of(scene: Scene) -> list[str]:
    """The table as a terminal prints it."""
    style = Style()
    return section(scene, style).text(style).splitlines()


if __name__ == "__main__":
    main()
