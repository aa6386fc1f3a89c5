"""A compact model as one Python file that needs numpy alone: its numbers, and the code that runs them here."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from scenes.compact.facts import facts

USE = """
Use: from model import model
     model.simulate([1e-3, 2e-3], {"NAME": 1.0, "OTHER": ([0, 1e-3], [0.0, 2.0])})   over time: arrays by output
     model.steady({"NAME": 1.0})                                                     in the steady state
An input is a number or (times, values), linear between; those not given are the scene's own.
"""


def as_python(document: Mapping[str, Any]) -> str:
    """The file's text."""
    code = files("scenes.compact").joinpath("runtime.py").read_text(encoding="utf-8")
    _, about, rest = code.split('"""', 2)
    head = "\n".join([*facts(document), USE, about.strip()]).replace("\\", "/").replace('"""', "'''")
    text = json.dumps(document, separators=(",", ":"), allow_nan=False)
    rest = rest.replace("import warnings\n", "import json\nimport warnings\n", 1)
    return f'"""{head}\n"""{rest}\n\nmodel = CompactModel(json.loads({text!r}))\n'
