"""Extremes and means over several boxes, a material or the whole solid."""

from dataclasses import replace

import pytest

from fem3d.runs.scene import solve
from scenes.free import from_dict
from scenes.model import Probe, Scene

MATERIALS = [{"name": "metal", "thermal_conductivity": 100}, {"name": "oxide", "thermal_conductivity": 1}]


def stack(source: float = 1e9, **run: object) -> Scene:
    """Two posts of oxide under a bar of metal, symmetric but for the source in the right one."""
    box = {"left": ("oxide", [-3, 0, 0], [-2, 1, 2]), "right": ("oxide", [2, 0, 0], [3, 1, 2]),
           "bar": ("metal", [-3, 0, 2], [3, 1, 3])}  # fmt: skip
    um = [{"name": n, "material": m, "lower": [c * 1e-6 for c in a], "upper": [c * 1e-6 for c in b]}
          for n, (m, a, b) in box.items()]  # fmt: skip
    um[0]["heat_source"], um[1]["heat_source"] = 1e9, source
    scene = from_dict({
        "run": {"steady": True, "accuracy": 1e-3, **run}, "material": MATERIALS, "box": um,
        "boundary": [{"name": n, "lower": um[i]["lower"], "upper": [*um[i]["upper"][:2], 0], "temperature": 293}
                     for i, n in enumerate(("cold", "cool"))],
        "probe": [
            {"name": "all", "reduce": "max"}, {"name": "oxide", "reduce": "max", "material": "oxide"},
            {"name": "some", "reduce": "max", "boxes": ["bar", "right"]}, {"name": "mean", "boxes": ["left", "right"]},
            {"name": "one", "reduce": "max", "boxes": ["left"]},
        ],
    })  # fmt: skip
    return scene


@pytest.mark.parametrize("mesh", ["bricks", "tetrahedra"])
@pytest.mark.parametrize("source", [1e9, 4e9])
def test_a_region_reads_all_its_boxes(source, mesh):
    scene = stack(source, mesh=mesh)
    each = [Probe(f"{how} {b.name}", b.lower, b.upper, reduce=how) for b in scene.boxes for how in ("max", "mean")]
    found = solve(replace(scene, probes=(*scene.probes, *each))).steady

    def close(name: str, expected: float) -> None:
        rise = found[name].value - 293
        assert rise == pytest.approx(expected - 293, abs=2 * found[name].error + 1e-9 * rise)

    largest = {b.name: found[f"max {b.name}"].value for b in scene.boxes}
    close("all", max(largest.values()))
    close("oxide", max(largest["left"], largest["right"]))
    close("some", max(largest["bar"], largest["right"]))
    close("one", largest["left"])
    close("mean", (found["mean left"].value + found["mean right"].value) / 2)
