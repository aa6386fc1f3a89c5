"""A model that is a netlist, run by ngspice: kelvins are volts, watts amperes, as in any thermal network.

The scene's values are put in by `.param`, the steady state is `.op`, over time it is `.tran` at two tolerances, whose
difference is the error. The netlist's own analyses and output commands are left out, and what could do more than
describe a circuit is refused: control blocks, which run shell commands, other files, and code models that start
programs. No start-up file of ngspice's is read.
"""

import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from compare.data import raw
from compare.data.columns import Column
from compare.data.match import Target
from compare.models.model import LONGEST, Model, Question, find_file, match_outputs, run_twice
from compare.quantities import AT_REST
from scenes.errors import SceneError, printable, quoted, unknown
from scenes.result import Traces

_REFUSED = re.compile(
    r"^\.(control|endc|exec|inc|lib|csparam|codemodel|osdi|pre_osdi)|`"
    r"|\b(d_process|d_cosim|filesource|d_source|d_state)\b|(\b|_|raw)file\s*=",
    re.IGNORECASE,
)
"""Statements that run commands, start programs, or read or write files."""
_PARAM = re.compile(r"([A-Za-z_]\w*)\s*=(?!=)")
_VARYING = re.compile(r"[vi]\S*(\s+\S+){2}\s+(pulse|pwl|sin|exp|sffm|am|tr\w+)\b", re.IGNORECASE)
"""Sources without a dc value, of which `.op` takes the value at the start."""
_OWN = (".op", ".tran", ".dc", ".ac", ".noise", ".tf", ".pz", ".disto", ".sens", ".sp", ".pss", ".print", ".plot",
        ".probe", ".save", ".width", ".meas", ".measure", ".four", ".backanno", ".end")  # fmt: skip
"""Analyses and output commands, which are replaced."""


def open_model(given: str, folder: str) -> Model:
    """Return the netlist of a file. Raises SceneError for more than a circuit, and where there is no ngspice."""
    path = find_file(given, folder, "an ngspice netlist, such as bridge.cir")
    text = path.read_bytes()[:10_000_000].decode("utf-8", "replace").replace("\r", "\n")
    # The first line is the title, whatever stands there.
    whole: list[str] = []
    for line in text.split("\n")[1:]:
        bare = "".join(c if c.isprintable() else " " for c in line).strip()
        if bare.startswith("+") and whole:
            whole[-1] += f" {bare[1:]}"
        elif bare and not bare.startswith(("*", "$", "#", ";", "//")):
            whole.append(bare)
    kept = [_circuit(line) for line in whole if line.split()[0].lower() not in _OWN]
    if shutil.which("ngspice") is None:
        raise SceneError("it is run by ngspice, which is not on the path: install ngspice")
    # Over time it starts from the initial values that it states, or else from its operating point.
    from_ic = any(re.search(r"^\.tran\b.*\buic\b|\bic\s*=", line, re.IGNORECASE) for line in whole)
    return Model(path.name, partial(_answer, kept, " uic" * from_ic))


def _answer(lines: Sequence[str], uic: str, question: Question) -> Traces:
    if question.times is not None:
        return run_twice(partial(_run, lines, uic, question))
    if varying := next(filter(_VARYING.match, lines), ""):
        raise SceneError(f'{quoted(varying.split()[0])} varies in time: give "dc VALUE" too, for the steady state')
    return _run(lines, uic, question)


def _run(lines: Sequence[str], uic: str, question: Question, steps: int = 0) -> Traces:
    """Return the rows (s) of a run of so many steps, or of the operating point, and the quantities there."""
    analysis, plot, tolerance = ".op", "operating point", 1e-6
    if question.times is not None:
        end, plot, tolerance = float(question.times[-1]), "transient", 1e-2 / steps
        analysis = f".tran {end / steps:.17g} {end:.17g} 0 {end / steps:.17g}{uic}"
    params = (line for line in lines if line.lower().startswith(".param"))
    names = {name.lower() for line in params for name in _PARAM.findall(line)}
    lower = {name.lower(): value for name, value in question.parameters.items()}
    for name in lower:
        if name not in names:
            raise unknown("it has no .param", name, names)
    lines = [*lines, *(f".param {name}={value:.17g}" for name, value in lower.items())]
    nodes = dict[str, str]()
    for n, name in enumerate(name for name in question.units if name in question.outputs):
        own = re.sub(r"([\w.]+)#branch", r"i(\1)", question.outputs[name].strip().lower())
        nodes[name] = own if own in names else re.sub(r"^([a-z_][\w.]*)$", r"v(\1)", own)
        if not re.fullmatch(r"v\([\w.]+\)|i\(v[\w.]*\)", nodes[name]):
            nodes[name] = f"v(model_output_{n})"
            lines.append(f"B{n}_output model_output_{n} 0 V={_circuit(own)}")
    options = f".options reltol={tolerance:g} abstol={tolerance * 1e-9:g} vntol={tolerance * 1e-3:g}"
    text = "\n".join(["a model", *lines, options, analysis, ".end", ""])
    vectors = _solve(text, plot)
    clock = vectors.pop("time", None)
    values = {n: vectors[o].values for n, o in match_outputs("node", nodes, question.units, vectors).items()}
    for name, own in question.outputs.items():
        # The current of a source counts as negative where the source delivers: it gets the sign of the drive.
        if question.units.get(name) == "A" and re.fullmatch(r"(?i)i\([\w.]+\)|[\w.]+#branch", own.strip()):
            sign = Target(question.scene).sign(name)
            values[name] = values[name] * (-1 if (values[name] * abs(values[name])).sum() * sign < 0 else 1)
    return Traces(AT_REST if clock is None else clock.values, values, {})


def _circuit(line: str) -> str:
    """A line, if it does no more than describe a circuit. Raises SceneError."""
    if not line.isprintable():
        raise SceneError(f"{quoted(line)} is no expression of one line")
    if refused := _REFUSED.search(line):
        raise SceneError(f"omit {quoted(refused[0])}: it runs commands, starts programs or reads files (paste these)")
    return line


def _solve(text: str, plot: str) -> dict[str, Column]:
    """Return the vectors of an analysis by their nodes, without units: volts stand for kelvins."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.raw"
        (Path(folder) / "model.cir").write_text(text, encoding="utf-8")
        try:
            ran = subprocess.run(
                ["ngspice", "-n", "-b", "-r", "model.raw", "model.cir"], cwd=folder, stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False, timeout=LONGEST,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise SceneError(f"it has not answered in {LONGEST / 60:g} minutes, and was ended") from None
        said = ran.stdout.decode("utf-8", "replace")
        try:
            if "singular matrix" in said:  # ngspice adds conductances of its own, and goes on
                raise SceneError("")
            _, columns = raw.read(path.read_bytes(), plot)
        except (OSError, SceneError):
            # The line of the netlist and the reason follow.
            signs = r"^(?!note).*(error|singular|fail|too small|undefined|unknown|can't|no such)(.*\n){1,3}"
            wrong = re.search(signs, said, re.IGNORECASE | re.MULTILINE)
            why = f" ({printable(' '.join(wrong[0].split()), 200)})" if wrong else ""
            raise SceneError(f"ngspice has no {plot}{why}") from None
    return {column.name: replace(column, unit=None) for column in columns}
