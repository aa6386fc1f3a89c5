"""What tells one kind of scene from another, a module for each, called as the scenes' ``kind``:

    PYTHON            the function that solves it from Python
    text(scene)       what figures call it
    plan, answer      what a run does (scene, request, data), and does (run, data)
    skipped_figures   the figures that a run doesn't draw, each with the reason
    exportable        refuses a scene that has no compact model; exported: the document of an outcome's
    quantities        of an outcome: what is followed and uncertain, by name what it is called and its unit; ``SHOWN``
    are those that a terminal has room for (empty: as many as fit)
    sensitivities     how the quantities follow the keys, or some of them; steady: their values in 3D and in 1D
    judged            the checks with what uncertain inputs make of them, and warnings
    models            of an outcome its results, by what they are called beside data; slopes: how each follows a key in
    the quantities' own units; beside: what 3D is with a key larger
    in_3d, checked    what a fit to data solves, and whether a scene can be built; fitted_model: the fit of a 1D model's
    own parameters

All that is done to a result is written once, for these. How a run is told and kept is in `validate.report`, a module of
the same name.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any


def of(scene: Any) -> Any:
    """The module of a scene's kind."""
    return import_module(f"validate.run.kinds.{scene.kind}")
