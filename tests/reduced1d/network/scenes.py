"""Small scenes of bars, as documents."""

from typing import Any

from scenes.free import from_dict
from scenes.model import AnyScene

K, C, RHO = 100.0, 700.0, 2000.0
LONG, WIDE, THICK = 100e-6, 10e-6, 2e-6
COLD = 293.0


def material(name: str = "m", **more: float) -> dict[str, Any]:
    return {"name": name, "thermal_conductivity": K, "density": RHO, "specific_heat": C} | more


def box(lower: tuple[float, ...], upper: tuple[float, ...], name: str = "bar", **more: Any) -> dict[str, Any]:
    return {"name": name, "material": "m", "lower": list(lower), "upper": list(upper)} | more


def flat(name: str, lower: tuple[float, ...], upper: tuple[float, ...], **condition: Any) -> dict[str, Any]:
    return {"name": name, "lower": list(lower), "upper": list(upper)} | condition


def at(name: str, *point: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "at": list(point)} | more


def over(name: str, lower: tuple[float, ...], upper: tuple[float, ...], **more: Any) -> dict[str, Any]:
    return {"name": name, "lower": list(lower), "upper": list(upper)} | more


def scene(
    boxes: list[dict[str, Any]],
    boundaries: list[dict[str, Any]],
    probes: list[dict[str, Any]],
    materials: list[dict[str, Any]] | None = None,
    end_time: float | None = None,
    accuracy: float = 1e-5,
    contact: list[dict[str, Any]] | None = None,
) -> AnyScene:
    run: dict[str, Any] = {"accuracy": accuracy} | ({"steady": True} if end_time is None else {"end_time": end_time})
    document = {
        "scene": {"name": "test", "initial_temperature": COLD}, "material": materials or [material()], "box": boxes,
        "boundary": boundaries, "probe": probes, "run": run, "contact": contact or [],
    }  # fmt: skip
    return from_dict(document)
