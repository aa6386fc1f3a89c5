"""The comparison of a reduction with the 3D model: checks, figures, reports; the `validate` command.

From Python: ``run = compare.run(scenes.load("sink"), voltage=1)``, then ``run.check("eq13")``. Imported when used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import compare.sweep as sweep
    from compare.interface import Run as Run
    from compare.interface import run as run

__all__ = ["Run", "run", "sweep"]


def __getattr__(name: str) -> Any:
    if name == "sweep":
        from importlib import import_module

        # A package that can be called: compare.sweep(scene, vary={...}).
        return import_module("compare.sweep")
    if name in __all__:
        from compare import interface

        return getattr(interface, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
