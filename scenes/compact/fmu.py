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

from scenes.compact import names
from scenes.compact.python import as_python

MISSING = "no FMU, which takes pythonfmu: pip install 'heated-microstructure-validation[fmu]'"

_UNITS: dict[str, dict[str, int]] = {
    "K": {"K": 1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "A": {"A": 1},
    "W": {"kg": 1, "m": 2, "s": -3},
    "W/m2": {"kg": 1, "s": -3},
    "W/m3": {"kg": 1, "m": -1, "s": -3},
}
"""The exponents of SI's base units in those of inputs and outputs."""

_SLAVE = '''

from xml.etree.ElementTree import Element, SubElement

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class CompactSlave(Fmi2Slave):
    """The model with its inputs and outputs as variables."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.description = {description!r}
        self.g, self.b = model.inputs_at(None, 0.0), np.zeros(model.states)
        inputs, outputs = {names!r}
        for k, (variable, entry) in enumerate(zip(inputs, model.inputs.values())):
            self._register(variable, entry, Fmi2Causality.input, lambda k=k: float(self.g[k]), k)
        for variable, (name, entry) in zip(outputs, model.outputs.items()):
            self._register(variable, entry, Fmi2Causality.output, lambda name=name: self._read()[name], None)

    def _register(self, variable, entry, causality, getter, k):
        def setter(value):
            self.g[k] = value

        start = None if k is None else float(self.g[k])
        self.register_variable(Real(
            variable, start=start, causality=causality, getter=getter,
            setter=None if k is None else setter, description=f"{{entry['name']}} in {{entry['unit']}}",
            variability=Fmi2Variability.continuous,
        ))

    def to_xml(self, *args, **kwargs):
        """With the units of the variables, which pythonfmu leaves out."""
        root = super().to_xml(*args, **kwargs)
        entries = [*model.inputs.values(), *model.outputs.values()]
        units = Element("UnitDefinitions")
        for unit in dict.fromkeys(entry["unit"] for entry in entries):
            powers = {{base: str(power) for base, power in {units!r}.get(unit, {{}}).items()}}
            SubElement(SubElement(units, "Unit", name=unit), "BaseUnit", powers)
        root.insert([element.tag for element in root].index("CoSimulation") + 1, units)
        for variable, entry in zip(root.iter("ScalarVariable"), entries):
            variable.find("Real").set("unit", entry["unit"])
        return root

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
        slave = _SLAVE.format(description=description, names=names.fmu(document), units=_UNITS)
        text = as_python(document) + slave
        script.write_text(text, encoding="utf-8")
        try:
            FmuBuilder.build_FMU(script, dest=path)
        finally:
            sys.path[:] = before
            sys.modules.pop(script.stem, None)
