"""A compact model, and the sampled controllers of a device, as FMUs (FMI 2.0, co-simulation), made by pythonfmu of
their own Python files.

Inputs hold from one communication point to the next. They run in any importer, with a Python that has numpy.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from statespace.document import fmu_names
from statespace.python import as_python, controllers_as_python

MISSING = "no FMU, which takes pythonfmu: pip install 'heated-microstructure-validation[fmu]'"

_UNITS: dict[str, dict[str, int]] = {
    "K": {"K": 1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "A": {"A": 1},
    "ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "W/m2": {"kg": 1, "s": -3},
    "W/m3": {"kg": 1, "m": -1, "s": -3},
}
"""The exponents of SI's base units in those of inputs and outputs."""

_SLAVE = '''

from xml.etree.ElementTree import Element, SubElement

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class {name}(Fmi2Slave):
    """Inputs and outputs as variables, of (name, description, unit) each."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.description = {description!r}
        self.given, self.units = [], []
        self.declare()

    def add(self, variable, read, start=None):
        """A variable that is an output as ``read`` () says, or with a start value the next input."""
        name, description, unit = variable
        number = len(self.given)

        def setter(value):
            self.given[number] = value

        if start is not None:
            self.given.append(start)
        causality = Fmi2Causality.output if start is None else Fmi2Causality.input
        self.units.append(unit)
        self.register_variable(Real(
            name, start=start, causality=causality, getter=read or (lambda: float(self.given[number])),
            setter=None if start is None else setter, description=f"{{description}} in {{unit}}",
            variability=Fmi2Variability.continuous,
        ))

    def to_xml(self, *args, **kwargs):
        """With the units of the variables, which pythonfmu leaves out."""
        root = super().to_xml(*args, **kwargs)
        units = Element("UnitDefinitions")
        for unit in dict.fromkeys(self.units):
            powers = {{base: str(power) for base, power in {units!r}.get(unit, {{}}).items()}}
            SubElement(SubElement(units, "Unit", name=unit), "BaseUnit", powers)
        root.insert([element.tag for element in root].index("CoSimulation") + 1, units)
        for variable, unit in zip(root.iter("ScalarVariable"), self.units):
            variable.find("Real").set("unit", unit)
        return root
'''

_MODEL = """
    def declare(self):
        self.b, inputs, outputs = np.zeros(model.states), *{names!r}
        self.known = None, None, None
        starts = model.inputs_at(None, 0.0)
        for variable, entry, start in zip(inputs, model.inputs.values(), starts):
            self.add((variable, entry["name"], entry["unit"]), None, float(start))
        for variable, (name, entry) in zip(outputs, model.outputs.items()):
            self.add((variable, name, entry["unit"]), lambda name=name: self._read()[name])

    def _read(self):
        # Outputs are computed once for inputs and states that stay as they are.
        given, b, outputs = self.known
        if given != self.given or b is not self.b:
            g = np.array(self.given)
            states = model.rest(g) if model.document["steady_only"] else self.b
            outputs = model.named(model.read(g, np.zeros_like(g), states))
            self.known = self.given.copy(), self.b, outputs
        return outputs

    def do_step(self, current_time, step_size):
        if not model.document["steady_only"]:
            self.b = model.step(self.b, np.array(self.given), step_size)
        return True
"""

_CONTROLLERS = """
    def declare(self):
        films = "sink", "sensor"
        for film, start in zip(films, controllers.resistance):
            self.add((film + "_ohm", "measured resistance of the " + film, "ohm"), None, float(start))
        for e, film in enumerate(films):
            self.add((film + "_V", "voltage of the " + film, "V"), lambda e=e: float(controllers.voltage[e]))

    def do_step(self, current_time, step_size):
        # A sample at the start of a step, or within it, takes the inputs of now.
        controllers.until(current_time + step_size, self.given)
        return True
"""


def available() -> bool:
    """Whether pythonfmu is installed."""
    return find_spec("pythonfmu") is not None


def write_fmu(document: Mapping[str, Any], path: Path) -> None:
    """Write the FMU of a model; raise OSError where that fails."""
    description = f'Compact model of "{document["scene"]}" of {document["states"]} states'
    _build("CompactSlave", as_python(document), description, _MODEL.format(names=fmu_names(document)), path)


def write_controllers(document: Mapping[str, Any], path: Path) -> None:
    """Write the FMU of the controllers of a device's model."""
    description = f'Sampled controllers of "{document["scene"]}"'
    _build("ControllersSlave", controllers_as_python(document), description, _CONTROLLERS, path)


def _build(name: str, code: str, description: str, methods: str, path: Path) -> None:
    from pythonfmu.builder import FmuBuilder

    before = sys.path.copy()
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / f"{path.stem}_slave.py"
        slave = _SLAVE.format(name=name, description=description, units=_UNITS)
        script.write_text(code + slave + methods, encoding="utf-8")
        try:
            FmuBuilder.build_FMU(script, dest=path)
        finally:
            sys.path[:] = before
            sys.modules.pop(script.stem, None)
