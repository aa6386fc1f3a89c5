"""1D and lumped models that a user brings: a Python function, an ngspice netlist, an FMU, a table of values; and the
network of a scene's boxes. All answer the same `Question`.

A netlist that could do more than describe a circuit is refused. A Python file and an FMU are programs, which run only
where the command line names them.
"""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from compare.data.columns import refusing
from compare.models.function import of_callable
from compare.models.model import Model
from reduced1d.ladder import canonical
from scenes.errors import SceneError, quoted

_KINDS = {".cir": "netlist", ".net": "netlist", ".sp": "netlist", ".fmu": "fmu", ".csv": "table"}


def open_model(given: str | Callable[..., object], folder: str = "") -> Model:
    """Return the model of a name, a file (relative to ``folder``) or a Python callable. Raises SceneError."""
    if callable(given):
        return of_callable(given)
    module = import_module(f"compare.models.{_kind(given)}")
    with refusing(f"the model {quoted(given)}"):
        model: Model = module.open_model(given, folder)
    return model


def chosen_model(scene: Any, given: str | Callable[..., object]) -> tuple[str | Callable[..., object], str] | None:
    """Return the user's own model and the folder of its file: the given one, or the scene's where that is no program,
    which never runs because a scene that somebody sent names it.

    Raises SceneError where "scene" is given and the scene has no model.
    """
    if given and given != "scene":
        return given, ""
    model = getattr(scene, "model", None)
    if model is None or not model.file:
        if given:
            raise SceneError(f"--model scene: {quoted(scene.name)} has no [model] with a file: name one there, or here")
        return None
    return None if not given and _kind(model.file) in ("function", "netlist", "fmu") else (model.file, model.folder)


def parse_reduction(given: str | Callable[..., object]) -> tuple[str, str | Callable[..., object]]:
    """Return the name of a sink's reduction, and the user's own model that it is, "" for one of this program's."""
    if callable(given):
        return getattr(given, "__name__", type(given).__name__), given
    if given != "network" and not Path(given.partition(":")[0]).suffix:
        return canonical(given), ""
    _kind(given)
    return Path(given).name, given


def _kind(given: str) -> str:
    """Return the module of this package that opens a model. Raises SceneError where none does."""
    file, _, function = given.rpartition(":")
    if given == "network":
        return given
    if file.endswith(".py") and function.strip():
        return "function"
    if (kind := _KINDS.get(Path(given).suffix.lower())) is None:
        form = "give FILE.py:FUNCTION, FILE.cir, FILE.fmu, FILE.csv, network, or scene for the scene's own [model]"
        raise SceneError(f"{quoted(given)} is no model: {form}")
    return kind
