"""How far a 1D model is from 3D: the comparison, and what belongs to it.

    run = compare.run("sink", voltage=1)         # both models of a sink, and the checks; reduction="plate", why=True
    found = compare.solve("bridge")              # any scene of boxes or on a mesh, in 3D
    sensor = compare.device("device")            # the whole sensor in 1D
    table = compare.sweep("sink", {"sink.width": "10um:200um:20"})    # many designs, as an xarray.Dataset

The first three print as their answer and have .traces (named columns), .report() and .outcome, which holds everything.
Scenes are what ``scenes.load`` returns, or what it takes. ``compare.testing`` has assertions for tests of your own.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_FROM = {
    **dict.fromkeys(("DeviceRun", "Run", "Solution", "device", "run", "solve"), "validate.interface"),
    "sweep": "validate.sweep.run",
}
"""The modules of functions that also write files, imported at first use; their types are in ``__init__.pyi``."""


def __getattr__(name: str) -> Any:
    if name in _FROM:
        return getattr(import_module(_FROM[name]), name)
    if name == "testing":
        return import_module("compare.testing")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*_FROM, "testing"]
