"""A platinum meander on a membrane, with pads of gold at random places beside it that align with nothing."""

import numpy as np

from scenes.free import check
from scenes.model import Boundary, Box, Material, Probe, Scene

UM = 1e-6
SIDE, WIDTH, LOW, HIGH = 200 * UM, 8 * UM, 60 * UM, 140 * UM
PLATINUM = Material("platinum", 71.0, 21450.0, 133.0, 1.06e-7, 3.9e-3)
GOLD, NITRIDE = Material("gold", 317.0, 19300.0, 129.0), Material("nitride", 20.0, 3100.0, 700.0)


def meander(pads: int, accuracy: float) -> Scene:
    """Four legs of 0.2 um on 1 um of nitride, the rim of which is held; pads of 0.5 um stay 1 um apart."""
    low, high, columns = 1 * UM, 1.2 * UM, [(60 + 20 * i) * UM for i in range(4)]
    boxes = [Box("membrane", NITRIDE, (0.0, 0.0, 0.0), (SIDE, SIDE, low))]
    for i, x in enumerate(columns):
        boxes.append(Box(f"leg {i}", PLATINUM, (x, 0.0 if i in (0, 3) else LOW, low), (x + WIDTH, HIGH, high)))
    for i, y in enumerate((HIGH - WIDTH, LOW, HIGH - WIDTH)):
        boxes.append(Box(f"turn {i}", PLATINUM, (columns[i] + WIDTH, y, low), (columns[i + 1], y + WIDTH, high)))
    draw, places, gap = np.random.default_rng(0), [(55 * UM, 0.0, 135 * UM, 145 * UM)], 1 * UM
    while len(places) <= pads:
        x, y = (draw.uniform(5, 185, 2) * UM).tolist()
        far_x, far_y = x + draw.uniform(5, 15) * UM, y + draw.uniform(5, 15) * UM
        apart = all(x > c + gap or far_x < a - gap or y > d + gap or far_y < b - gap for a, b, c, d in places)
        if max(far_x, far_y) < SIDE - 5 * UM and apart:
            places.append((x, y, far_x, far_y))
            boxes.append(Box(f"pad {len(places)}", GOLD, (x, y, low), (far_x, far_y, 1.5 * UM)))
    sides = (((0, 0), (0, 1), low), ((1, 0), (1, 1), low), ((0, 0), (1, 0), high), ((0, 1), (1, 1), low))
    ends = [
        Boundary(f"rim {i}", "temperature", (a * SIDE, b * SIDE, 0.0), (c * SIDE, d * SIDE, top), 293.0)
        for i, ((a, b), (c, d), top) in enumerate(sides)
    ]
    faces = [((x, 0.0, low), (x + WIDTH, 0.0, high)) for x in (columns[0], columns[3])]
    electrodes = [Boundary(n, "voltage", *f, u) for n, f, u in zip(("plus", "minus"), faces, (1.0, 0.0), strict=True)]
    probes = (
        Probe("peak", (0.0, 0.0, 0.0), (SIDE, SIDE, low), "temperature", "max"),
        Probe("mean", (0.0, 0.0, 0.0), (SIDE, SIDE, low)),
        Probe("current", *faces[0], "current"),
    )
    return check(Scene("meander", tuple(boxes), (*ends, *electrodes), probes, 293.0, accuracy=accuracy, steady=True))
