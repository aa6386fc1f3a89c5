"""How far a 1D model is from 3D: the comparison, and what belongs to it.

    run = compare.run("sink", voltage=1)         # both models of a sink, and the checks; reduction="plate", why=True
    found = compare.solve("bridge")              # any scene of boxes or on a mesh, in 3D
    sensor = compare.device("device")            # the whole sensor in 1D
    table = compare.sweep("sink", {"sink.width": "10um:200um:20"})    # many designs, as arrays by column

The first three print as their answer and have .fem3d, .reduced1d, .checks, .traces, .report() and .outcome.
Scenes are what ``scenes.load`` returns, or what it takes. ``compare.testing`` has assertions for tests of your own.
"""

from importlib import import_module
from typing import Any

_NAMES = ("Run", "device", "run", "solve")
"""Names of `compare.interface`, imported at first use; their types are in ``__init__.pyi``."""


def __getattr__(name: str) -> Any:
    if name in _NAMES:
        return getattr(import_module("compare.interface"), name)
    if name == "sweep":
        from compare.pipeline import plugin

        return plugin(name)
    if name == "testing":
        return import_module("compare.testing")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*_NAMES, "sweep", "testing"]
