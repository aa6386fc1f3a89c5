"""How far a 1D model is from 3D: the comparison, and what belongs to it.

    run = compare.run("sink", voltage=1)         # both models of a sink, and the checks; reduction="plate", why=True
    found = compare.solve("bridge")              # any scene of boxes or on a mesh, in 3D
    sensor = compare.device("device")            # the whole sensor in 1D
    table = compare.sweep("sink", {"sink.width": "10um:200um:20"})    # many designs, as an xarray.Dataset

The first three print as their answer and have .traces (named columns), .report() and .outcome, which holds everything.
Scenes are what ``scenes.load`` returns, or what it takes. ``compare.testing`` has assertions for tests of your own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.interface import DeviceRun as DeviceRun
    from compare.interface import Run as Run
    from compare.interface import Solution as Solution
    from compare.interface import device as device
    from compare.interface import run as run
    from compare.interface import solve as solve
    from validate.sweep.interface import sweep as sweep

__all__ = ["DeviceRun", "Run", "Solution", "device", "run", "solve", "sweep", "testing"]


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name in ("device", "solve", "testing"):
        return import_module(f"compare.{name}")
    if name == "sweep":
        from validate.sweep.interface import sweep

        return sweep
    if name in __all__:
        return getattr(import_module("compare.interface"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(__all__)
