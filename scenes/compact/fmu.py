"""A compact model as an FMU (FMI 2.0, co-simulation), made by pythonfmu of the model's own Python file.

Inputs hold from one communication point to the next. It runs in any importer, with a Python that has numpy.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from scenes.compact.python import as_python

MISSING = "no FMU, which takes pythonfmu: pip install 'heated-microstructure-validation[fmu]'"

_SLAVE = '''

import re

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class CompactSlave(Fmi2Slave):
    """The model with its inputs and outputs as variables, their names as in model.json but for signs and spaces."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.description = {description!r}
        self.g, self.b = model.inputs_at(None, 0.0), np.zeros(model.states)
        for k, entry in enumerate(model.inputs.values()):
            self._register(entry, Fmi2Causality.input, lambda k=k: float(self.g[k]), k)
        for name, entry in model.outputs.items():
            self._register(entry, Fmi2Causality.output, lambda name=name: self._read()[name], None)

    def _register(self, entry, causality, getter, k):
        def setter(value):
            self.g[k] = value

        start = None if k is None else float(self.g[k])
        self.register_variable(Real(
            re.sub(r"\\W+", "_", entry["name"]), start=start, causality=causality, getter=getter,
            setter=None if k is None else setter, description=f"{{entry['name']}} in {{entry['unit']}}",
            variability=Fmi2Variability.continuous,
        ))

    def _read(self):
        states = model.rest(self.g) if model.document["steady_only"] else self.b
        return model.named(model.read(self.g, np.zeros_like(self.g), states))

    def do_step(self, current_time, step_size):
        if not model.document["steady_only"]:
            self.b = model.step(self.b, self.g, step_size)
        return True
'''


def available() -> bool:
    """Whether pythonfmu is installed."""
    return find_spec("pythonfmu") is not None


def write_fmu(document: Mapping[str, Any], path: Path) -> None:
    """Writes the FMU. Raises OSError where that can't be done."""
    from pythonfmu.builder import FmuBuilder

    before = sys.path.copy()
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "compact_model_slave.py"
        description = f'Compact model of "{document["scene"]}" of {document["states"]} states'
        text = as_python(document) + _SLAVE.format(description=description)
        script.write_text(text, encoding="utf-8")
        try:
            FmuBuilder.build_FMU(script, dest=path)
        finally:
            sys.path[:] = before
            sys.modules.pop(script.stem, None)
