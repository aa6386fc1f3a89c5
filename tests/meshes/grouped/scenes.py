"""Scenes of boxes that the tests solve on meshes as well."""

from typing import Any


def bar(**run: Any) -> dict[str, Any]:
    """A conducting bar between two temperatures, with a resistivity that does not vary: rises are parabolas."""
    end = {"lower": [0, 0, 0], "upper": [0, 1e-5, 2e-5]}
    other = {"lower": [1e-4, 0, 0], "upper": [1e-4, 1e-5, 2e-5]}
    return {
        "scene": {"name": "bar", "initial_temperature": 300},
        "run": run or {"steady": True, "accuracy": 1e-3},
        "material": [
            {"name": "metal", "thermal_conductivity": 100, "density": 2000, "specific_heat": 500, "resistivity": 1e-5}
        ],
        "box": [{"name": "bar", "material": "metal", "lower": [0, 0, 0], "upper": [1e-4, 1e-5, 2e-5]}],
        "boundary": [
            {"name": "cold", **end, "temperature": 300},
            {"name": "warm", **other, "temperature": 310},
            {"name": "plus", **end, "voltage": 0.4},
            {"name": "minus", **other, "voltage": 0},
        ],
        "probe": [
            {"name": "middle", "at": [5e-5, 3e-6, 7e-6]},
            {"name": "volt", "quantity": "potential", "at": [2.5e-5, 3e-6, 7e-6]},
            {"name": "current", "quantity": "current", **end},
            {"name": "out", "quantity": "heat_flow", **other},
            {"name": "hottest", "lower": [0, 0, 0], "upper": [1e-4, 1e-5, 2e-5], "reduce": "max"},
            {"name": "half", "quantity": "current", "lower": [5e-5, 0, 0], "upper": [5e-5, 1e-5, 2e-5]},
        ],
    }


def bridge(**run: Any) -> dict[str, Any]:
    """A conductor whose resistivity follows the temperature, on an insulating foot, cooled by air at its other end."""
    return {
        "scene": {"name": "bridge", "initial_temperature": 300},
        "run": run or {"steady": True, "accuracy": 1e-2},
        "material": [
            {"name": "metal", "thermal_conductivity": 50, "density": 2000, "specific_heat": 700, "resistivity": 1e-5,
             "temperature_coefficient": 2e-3, "reference_temperature": 300},
            {"name": "oxide", "thermal_conductivity": 2, "density": 2200, "specific_heat": 700},
        ],
        "box": [
            {"name": "beam", "material": "metal", "lower": [0, 0, 2e-6], "upper": [2e-5, 4e-6, 4e-6]},
            {"name": "foot", "material": "oxide", "lower": [0, 0, 0], "upper": [5e-6, 4e-6, 2e-6]},
        ],
        "boundary": [
            {"name": "base", "lower": [0, 0, 0], "upper": [5e-6, 4e-6, 0], "temperature": 300},
            {"name": "air", "lower": [5e-6, 0, 4e-6], "upper": [2e-5, 4e-6, 4e-6],
             "convection": {"coefficient": 1e5, "ambient": 300}},
            {"name": "plus", "lower": [0, 0, 2e-6], "upper": [0, 4e-6, 4e-6], "voltage": 0.2},
            {"name": "minus", "lower": [2e-5, 0, 2e-6], "upper": [2e-5, 4e-6, 4e-6], "voltage": 0},
        ],
        "probe": [
            {"name": "tip", "at": [2e-5, 2e-6, 3e-6]},
            {"name": "mean", "lower": [0, 0, 2e-6], "upper": [2e-5, 4e-6, 4e-6]},
            {"name": "current", "quantity": "current", "lower": [0, 0, 2e-6], "upper": [0, 4e-6, 4e-6]},
            {"name": "to base", "quantity": "heat_flow", "lower": [0, 0, 0], "upper": [5e-6, 4e-6, 0]},
        ],
    }  # fmt: skip
