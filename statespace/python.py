"""A compact model as one Python file that needs numpy alone: its numbers, and the code that runs them here."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from statespace.document import facts

USE = """
Use: from model import model
     model.simulate([1e-3, 2e-3], {"NAME": 1.0, "OTHER": ([0, 1e-3], [0.0, 2.0])})   over time: arrays by output
     model.steady({"NAME": 1.0})                                                     in the steady state
An input is a number or (times, values), linear between; those not given are the scene's own.
"""


CONTROLLERS = """
Use: from controllers import controllers
     controllers.sample([300.1, 1.12])    the next sample: both voltages of both measured resistances (sink, sensor)
"""


def as_python(document: Mapping[str, Any]) -> str:
    """The model's file, its text."""
    code = _code("runtime.py", [*facts(document), USE]).replace("import warnings", "import json\nimport warnings", 1)
    return f"{code}\n\nmodel = CompactModel(json.loads({_text(document)!r}))\n"


def controllers_as_python(document: Mapping[str, Any]) -> str:
    """The file of a device's controllers, its text."""
    head = [f'Sampled controllers of "{document["scene"]}".', CONTROLLERS]
    code = _code("controllers.py", head).replace("from collections.abc", "import json\nfrom collections.abc", 1)
    return f"{code}\n\ncontrollers = Controllers(json.loads({_text(document['controllers'])!r}))\n"


def _code(module: str, head: list[str]) -> str:
    """The code of a module here, with a head on its own docstring."""
    code = files("statespace").joinpath(module).read_text(encoding="utf-8")
    _, about, rest = code.split('"""', 2)
    said = "\n".join([*head, about.strip()]).replace("\\", "/").replace('"""', "'''")
    return f'"""{said}\n"""{rest}'


def _text(document: Mapping[str, Any]) -> str:
    return json.dumps(document, separators=(",", ":"), allow_nan=False)
