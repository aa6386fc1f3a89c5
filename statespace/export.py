"""The files of a compact model and of a device's controllers: JSON, a SPICE subcircuit, Python files that need numpy
alone, and FMUs (FMI 2.0, co-simulation) that pythonfmu makes of these.

A Python file is the code that runs the model here, with its numbers. Inputs of an FMU hold from one communication point
to the next; FMUs run in any importer, with a Python that has numpy.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Mapping
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from statespace.document import facts, fmu_names, names
from statespace.spice import as_spice

MISSING = "no FMU, which takes pythonfmu: pip install 'heated-microstructure-validation[fmu]'"

_USE = """
Use: from model import model
     model.simulate([1e-3, 2e-3], {"NAME": 1.0, "OTHER": ([0, 1e-3], [0.0, 2.0])})   over time: arrays by output
     model.steady({"NAME": 1.0})                                                     in the steady state
An input is a number or (times, values), linear between; those not given are the scene's own.
"""

_USE_CONTROLLERS = """
Use: from controllers import controllers
     controllers.sample([300.1, 1.12])    the next sample: both voltages of both measured resistances (sink, sensor)
"""

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


def fmu_available() -> bool:
    """Whether pythonfmu is installed."""
    return find_spec("pythonfmu") is not None


def write(document: Mapping[str, Any], folder: Path) -> None:
    """Write the files of a compact model, and of a device its controllers; no FMU without pythonfmu.

    Parameters
    ----------
    document : Mapping
        The document of the model.
    folder : Path
        A folder, which is made where it does not exist.

    Raises
    ------
    OSError
        Where a file cannot be written.
    """
    document, scene = {**document, "names": names(document)}, document["scene"]
    each = (f"{json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in document.items())
    texts = {
        "model.json": "{\n" + ",\n".join(each) + "\n}\n",
        "model.cir": as_spice(document),
        "model.py": as_python("CompactModel", "model", document, [*facts(document), _USE]),
    }
    about = f'Compact model of "{scene}" of {document["states"]} states'
    units = {"model": ("CompactSlave", about, _MODEL.format(names=fmu_names(document)))}
    if "controllers" in document:
        about = f'Sampled controllers of "{scene}"'
        head = [f"{about}.", _USE_CONTROLLERS]
        texts["controllers.py"] = as_python("Controllers", "controllers", document["controllers"], head)
        units["controllers"] = "ControllersSlave", about, _CONTROLLERS
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    for name, (slave, about, methods) in units.items() if fmu_available() else ():
        importer = _SLAVE.format(name=slave, description=about, units=_UNITS)
        _build_fmu(texts[f"{name}.py"] + importer + methods, folder / f"{name}.fmu")


def as_python(kind: str, name: str, document: Mapping[str, Any], head: list[str]) -> str:
    """The text of a Python file that makes an object ``name`` of a class here (``kind``) from its document, with a head
    on the docstring of the class's module."""
    module = {"CompactModel": "runtime.py", "Controllers": "controllers.py"}[kind]
    code = files("statespace").joinpath(module).read_text(encoding="utf-8")
    _, about, rest = code.split('"""', 2)
    text = "\n".join([*head, about.strip()]).replace("\\", "/").replace('"""', "'''")
    numbers = json.dumps(document, separators=(",", ":"), allow_nan=False)
    return f'"""{text}\n"""{rest}\n\nimport json\n\n{name} = {kind}(json.loads({numbers!r}))\n'


def _build_fmu(code: str, path: Path) -> None:
    from pythonfmu.builder import FmuBuilder

    before = sys.path.copy()
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / f"{path.stem}_slave.py"
        script.write_text(code, encoding="utf-8")
        try:
            FmuBuilder.build_FMU(script, dest=path)
        finally:
            sys.path[:] = before
            sys.modules.pop(script.stem, None)
