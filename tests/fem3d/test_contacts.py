"""Contacts: exact slabs, steady and over time, and what each of them says of itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from fem3d.runs.scene import solve
from scenes.free import as_dict, from_dict
from validate.verify.series import Layer, step_response

LENGTH, SIDE, K, CAPACITY = 1e-3, 0.2e-3, 2.0, 3e6
RESISTANCE = 5e-4  # m2 K/W: as much as the length of a slab


def slab(*conditions: dict[str, Any], probes: Sequence[dict[str, Any]] = (), **run: Any) -> dict[str, Any]:
    """A slab along x with a condition at either end, and probes at both ends."""
    ends = [{"lower": [x, 0, 0], "upper": [x, SIDE, SIDE]} for x in (0.0, LENGTH)]
    return {
        "scene": {"name": "slab", "initial_temperature": 293.0},
        "material": [{"name": "a", "thermal_conductivity": K, "density": 1.0, "specific_heat": CAPACITY}],
        "box": [{"name": "slab", "material": "a", "lower": [0, 0, 0], "upper": [LENGTH, SIDE, SIDE]}],
        "boundary": [{"name": name, **at, **c} for name, at, c in zip(("near", "far"), ends, conditions, strict=True)],
        "probe": [{"name": "near", "at": [0, 0, 0]}, {"name": "far", "at": [LENGTH, SIDE, 0]}, *probes],
        "run": run or {"steady": True},
    }


def test_heat_that_leaves_through_a_contact_warms_the_face_by_its_resistance() -> None:
    flux = 1e4
    held = {"temperature": 300.0, "contact_resistance": RESISTANCE}
    result = solve(from_dict(slab(held, {"heat_flux": flux})))
    jump, across = flux * RESISTANCE, flux * LENGTH / K
    for name, exact in (("near", 300.0 + jump), ("far", 300.0 + jump + across)):
        found = result.steady[name]
        assert abs(found.value - exact) <= found.error < 1e-3 * (jump + across)
        # Of a contact one percent better the answer would be another one.
        assert abs(found.value - (exact - 0.01 * jump)) > 10 * found.error


def test_a_step_behind_a_contact_warms_the_slab_as_the_series_says() -> None:
    slow = LENGTH**2 * CAPACITY / K
    times = np.array([0.02, 0.1, 0.5, 2.0]) * slow
    document = slab(
        {"temperature": 303.0, "contact_resistance": RESISTANCE}, {"heat_flux": 0.0},
        end_time=float(times[-1]), output_times=times.tolist(), accuracy=1e-4,
    )  # fmt: skip
    traces = solve(from_dict(document)).traces
    assert traces is not None
    layers = [Layer(LENGTH, K, CAPACITY)]
    exact, worse = (
        step_response(layers, "film", 10.0, 0.0, times, coefficient=1 / r) for r in (RESISTANCE, 1.01 * RESISTANCE)
    )
    for face, name in enumerate(("near", "far")):
        found = np.interp(times, traces.time, traces.values[name]) - 293.0
        assert np.abs(found - exact[:, face]).max() <= traces.errors[name] < 1e-3 * 10.0
        assert np.abs(found - worse[:, face]).max() > 2 * traces.errors[name]


@pytest.mark.parametrize("resistance", [0.0, RESISTANCE])
def test_a_contact_of_a_boundary_comes_back_from_its_document(resistance: float) -> None:
    scene = from_dict(slab({"temperature": 300.0, "contact_resistance": resistance}, {"heat_flux": 1.0}))
    written = as_dict(scene)
    assert from_dict(written) == scene
    assert written["boundary"][0].get("contact_resistance", 0.0) == resistance
    assert scene.boundaries[0].kind == ("convection" if resistance else "temperature")
