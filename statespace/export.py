"""The files of a compact model and of a device's controllers: JSON, Python files that need numpy alone, FMUs, SPICE.

A Python file is the code that runs the model here, with its numbers, and pythonfmu makes an FMU (FMI 2.0,
co-simulation) of it, whose inputs hold from one communication point to the next. In the SPICE subcircuit every state is
an RC pair: temperatures are rises above the initial one in volts, heat in watts is a current in amperes, and the terms
of z are node voltages. Constants of given temperatures are folded into constants of rises, so that nothing large
cancels out.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from collections.abc import Mapping
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from scenes.units import parse_unit
from statespace.document import facts, names
from statespace.runtime import CompactModel

PINS = {
    "voltage": "an electrode: V against node 0, A into it",
    "temperature": "a boundary: its rise in K, the heat in W that enters there",
    "ambient": "a boundary's surroundings: their rise in K, the heat in W that enters from there",
    "heat_flux": "a boundary: heat in W into the pin enters there; its mean rise in K",
    "heat_source": "a heat source: heat in W into the pin; the mean rise in K of where it is",
}


def as_spice(document: Mapping[str, Any]) -> str:
    """The subcircuit's text: a pin for every input, in their order, and one for every output that is read."""
    return _Netlist(document).text()


class _Netlist:
    def __init__(self, document: Mapping[str, Any]) -> None:
        self.document, self.model = document, CompactModel(document)
        start = document["initial_temperature_K"]
        self.inputs = document["inputs"]
        self.kelvin = np.array([entry["unit"] == "K" for entry in self.inputs])
        at_start = np.concatenate([[1.0], np.where(self.kelvin, start, 0.0), np.zeros(self.model.states)])
        for name in ("A", "S", "F", "Q", "Y", "U", "P"):
            matrix = getattr(self.model, name)
            matrix[..., 0] = matrix @ at_start
        warm = [o["rows"] for o in document["outputs"] if o["unit"] == "K"]
        warm += [[entry["port"]["row"]] for entry in self.inputs if entry["port"]["unit"] == "K"]
        self.model.Y[[row for rows in warm for row in rows], 0] -= start
        nodes, count = [entry["spice"] for entry in names(document)], len(self.inputs)
        self.pins, self.reads = nodes[:count], nodes[count:]
        sources = [entry["kind"] in ("heat_flux", "heat_source") for entry in self.inputs]
        given = [
            f"(I(Vin{k + 1})/{_number(entry['port']['size'])})" if is_source else f"V({pin})"
            for k, (entry, pin, is_source) in enumerate(zip(self.inputs, self.pins, sources, strict=True))
        ]
        self.sources = sources
        self.z = ["", *given, *(f"V(b{k + 1})" for k in range(self.model.states))]
        self.lines: list[str] = []

    def text(self) -> str:
        m = self.model
        self._pins()
        self._currents()
        for k in range(m.states):
            rate = m.decay[k] or 1.0
            heat = m.F[k].copy()
            heat[1 + len(self.inputs) + k] += m.decay[k]
            self.lines.append(f"Cb{k + 1} b{k + 1} 0 {_number(1 / rate)}" if not self.document["steady_only"] else "")
            self.lines.append(f"Rb{k + 1} b{k + 1} 0 1" if m.decay[k] > 0 else "")
            terms = self._sum(heat / rate) + self._paired(m.Q[:, k] / rate)
            self.lines.append(f"Bb{k + 1} 0 b{k + 1} I = {terms or '0'}")
        for node, entry in zip(self.reads, self.document["outputs"], strict=True):
            self.lines.append(f"B{node} {node} 0 V = {self._reduced(entry)}")
        heads = ["* " + line for line in facts(self.document)]
        heads += ["* Pins (temperatures are rises above the initial one, V for K and A for W):"]
        heads += [f"*   {pin}: {entry['name']}; {PINS[entry['kind']]}"
                  for pin, entry in zip(self.pins, self.inputs, strict=True)]  # fmt: skip
        heads += [f"*   {node}: {entry['name']} ({entry['unit']}), an ideal source"
                  for node, entry in zip(self.reads, self.document["outputs"], strict=True)]  # fmt: skip
        heads += [
            "* For ngspice and other simulators with behavioural (B) sources. From rest: 0 V before a step, or uic."
        ]
        body = [f".subckt compact_model {' '.join([*self.pins, *self.reads])}", *filter(None, self.lines),
                ".ends compact_model"]  # fmt: skip
        return "\n".join([*heads, *(_wrapped(line) for line in body)]) + "\n"

    def _pins(self) -> None:
        """The current at each pin, or its rise where heat is given; and the rates of inputs that are used."""
        moves = self.model.W.any(axis=0) & (not self.document["steady_only"])
        for k in np.flatnonzero(moves).tolist():
            self.lines += [f"Ecopy{k + 1} copy{k + 1} 0 {self.pins[k]} 0 1", f"Crate{k + 1} copy{k + 1} rate{k + 1} 1",
                           f"Vrate{k + 1} rate{k + 1} 0 0"]  # fmt: skip
        for k, (pin, entry) in enumerate(zip(self.pins, self.inputs, strict=True)):
            value = self._row(entry["port"]["row"])
            if self.sources[k]:
                self.lines += [f"Vin{k + 1} {pin} in{k + 1} 0", f"Bin{k + 1} in{k + 1} 0 V = {value}"]
            else:
                self.lines.append(f"Bin{k + 1} {pin} 0 I = {value}")

    def _currents(self) -> None:
        """A node for each current field, at which its residual must vanish."""
        m = self.model
        for i in range(len(m.S)):
            size = m.A[i, i, 0]
            taken = "".join(_times(f"-V(c{j + 1})", self._sum(m.A[i, j] / size)) for j in range(len(m.S)))
            self.lines.append(f"Bc{i + 1} 0 c{i + 1} I = {self._sum(m.S[i] / size)}{taken}")

    def _reduced(self, entry: Mapping[str, Any]) -> str:
        rows = [self._row(row) for row in entry["rows"]]
        if entry["reduce"] == "measured":
            series, drop, current, voltage = rows
            return f"{series}+(({current})*({voltage}) > 0 ? ({drop})*({current})/max(({current})**2, 1e-40) : 0)"
        expression = rows[0]
        for other in rows[1:]:
            expression = f"{entry['reduce']}({expression}, {other})"
        return expression

    def _row(self, row: int) -> str:
        m = self.model
        terms = self._sum(m.Y[row])
        terms += "".join(_times(f"+V(c{i + 1})", self._sum(m.U[i, row])) for i in range(len(m.S)))
        terms += self._paired(m.P[:, row])
        if not self.document["steady_only"]:
            terms += "".join(f" {w:+.12g}*I(Vrate{k + 1})" for k, w in enumerate(m.W[row]) if w)
        return terms or "0"

    def _paired(self, each: np.ndarray) -> str:
        """The sum over pairs of current fields of their product times a sum."""
        pairs = zip(self.model.first, self.model.second, each, strict=True)
        return "".join(_times(f"+{1 if i == j else 2}*V(c{i + 1})*V(c{j + 1})", self._sum(row)) for i, j, row in pairs)

    def _sum(self, row: np.ndarray) -> str:
        """The terms of z with some factors (z,)."""
        least = 1e-15 * float(np.abs(row).max(initial=0.0))
        kept = ((factor, name) for factor, name in zip(row.tolist(), self.z, strict=True) if abs(factor) > least)
        return "".join(f" {factor:+.12g}*{name}" if name else f" {factor:+.12g}" for factor, name in kept)


def _times(factor: str, terms: str) -> str:
    return f" {factor}*({terms})" if terms else ""


def _number(value: float) -> str:
    return f"{value:.12g}"


def _wrapped(line: str) -> str:
    """A line without leading signs, which not every simulator reads, broken before terms after 100 characters."""
    plain = re.sub(r"([(=]) *\+", r"\1 ", line)
    return "\n+ ".join(wrap(plain, 100, break_long_words=False, break_on_hyphens=False))


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
            powers = {{base: str(power) for base, power in {units!r}.get(unit, {{}}).items() if power}}
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
    variables, count = [entry["fmu"] for entry in document["names"]], len(document["inputs"])
    units = {"model": ("CompactSlave", about, _MODEL.format(names=(variables[:count], variables[count:])))}
    if "controllers" in document:
        about = f'Sampled controllers of "{scene}"'
        head = [f"{about}.", _USE_CONTROLLERS]
        texts["controllers.py"] = as_python("Controllers", "controllers", document["controllers"], head)
        units["controllers"] = "ControllersSlave", about, _CONTROLLERS
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    # The exponents of SI's base units.
    base = {unit: dict(zip(("m", "kg", "s", "A", "K"), parse_unit(unit).powers, strict=True))
            for unit in ("K", "V", "A", "ohm", "W", "W/m2", "W/m3")}  # fmt: skip
    for name, (slave, about, methods) in units.items() if fmu_available() else ():
        importer = _SLAVE.format(name=slave, description=about, units=base)
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
