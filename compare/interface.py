"""The public interface from Python: solve a scene, and read checks, quantities and traces."""

from collections.abc import Mapping, Sequence
from inspect import Parameter, Signature
from pathlib import Path
from typing import Any

import numpy as np

from compare import pipeline
from compare.analyses.sensitivities import Propagated
from compare.blame import Budget
from compare.kinds import kind_of
from compare.options import FREE, as_text, check, of_kind, read, settings, texts
from compare.outcome import Outcome
from compare.pipeline import plugin
from compare.processes import single_threaded
from compare.slopes import Slopes
from compare.verdict import Check
from scenes import load, overridden
from scenes.errors import SceneError, quoted, unknown
from scenes.result import Estimate, Result

Overrides = Sequence[str] | Mapping[str, object]
"""Such as ["sink.width=20um"] or {"sink.width": "20um", "run.steady": True}."""


class Columns(dict[str, np.ndarray]):
    """Arrays of equal length by name: ``columns["time_s"]``, ``columns["fem3d_peak_K"]``; empty without a transient.

    ``columns("peak_K")`` is (times, 3D, 1D) of one quantity.
    """

    def __missing__(self, name: str) -> np.ndarray:
        raise KeyError(f"no column {name!r}; there are {', '.join(self) or 'none, as there is no transient'}")

    def __call__(self, quantity: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return times (s), 3D and 1D values of a quantity: of a sink "peak_K" ..., else a probe's name.

        Raises SceneError for a name that both models lack, with the names that they have.
        """
        for three, one in ((f"fem3d_{quantity}", f"reduced1d_{quantity}"), (quantity, f"reduced1d {quantity}")):
            if three in self and one in self:
                return self["time_s"], self[three], self[one]
        names = [name.removeprefix("reduced1d_").removeprefix("reduced1d ") for name in self if "reduced1d" in name]
        raise unknown("3D and 1D have no common transient", quantity, names)


class Run:
    """A run of a scene of any kind: ``run["peak_rise_K"]`` is a steady value of 3D with its error.

    Of a free scene the key is the probe's name.

    Attributes
    ----------
    outcome : everything; the others are short ways
    scene : the scene that was solved
    answer : how far the 1D model is off, where, and why, in a sentence; empty without a model
    reduced1d : the 1D result, of the type of the 3D result; None without a 1D model
    checks : every check by its id
    why : the difference in parts, one for each assumption; with ``why=True``
    sensitivities : how models follow keys, such as ``["fem3d"].relative["sink.width"]["end_rise_K"]``, if asked for
    uncertain : the u_input of quantities, and of the differences of models; with ``uncertain={...}``
    """

    def __init__(self, outcome: Outcome[Any]) -> None:
        self.outcome, self.scene, self.answer = outcome, outcome.scene, outcome.answer
        self.reduced1d, self.checks = outcome.reduced1d, {check.id: check for check in outcome.checks}
        self.why: Budget | None = outcome.analyses.get("why")
        self.sensitivities: dict[str, Slopes] = outcome.slopes
        self.uncertain: Propagated | None = outcome.analyses.get("uncertain")

    @property
    def fem3d(self) -> Result:
        """The 3D result: ``steady["peak_rise_K"].value`` and ``.error``, ``traces``."""
        return self.outcome.solved

    @property
    def steady(self) -> dict[str, Estimate]:
        """Steady values of 3D."""
        return self.fem3d.steady

    @property
    def traces(self) -> Columns:
        """Every quantity over time, by the columns of traces.csv; empty without a transient."""
        return Columns(kind_of(self.scene).columns(self.outcome))

    def __getitem__(self, name: str) -> Estimate:
        if name not in self.steady:
            raise KeyError(f"no steady value of {name!r}; there are {', '.join(self.steady) or 'none: see .traces'}")
        return self.steady[name]

    def check(self, name: str) -> Check:
        """Return one check: its ``verdict``, ``difference`` (relative, against 3D), ``u_num``, ``because``.

        Raises SceneError for an id that there is not, or that this run did not make, with the reason.
        """
        if name in self.checks:
            return self.checks[name]
        if why := kind_of(self.scene).skipped(self.scene, self.outcome.options).get(name):
            raise SceneError(f"this run made no check {quoted(name)}: {why}")
        raise unknown("this run made no check", name, self.checks)

    def report(self) -> str:
        """Return the report that the command prints."""
        return str(plugin("report")(self.outcome))

    __repr__ = report

    def _repr_html_(self) -> str:
        return str(plugin("excerpt")(self.outcome))


def run(scene: Any = "sink", *, overrides: Overrides = (), out: str | Path | None = None, **options: Any) -> Run:
    """Solve a sink in 3D and in 1D, and compare."""
    return _run("sink", scene, overrides, out, options)


def solve(scene: Any, *, overrides: Overrides = (), out: str | Path | None = None, **options: Any) -> Run:
    """Solve any scene of boxes, or on a mesh, in 3D: heat, current or both, steady or over time."""
    return _run(FREE, scene, overrides, out, options)


def device(scene: Any = "device", *, overrides: Overrides = (), out: str | Path | None = None, **options: Any) -> Run:
    """Simulate the whole sensor in 1D, with ``in_3d`` in 3D too, and check the paper's claims."""
    return _run("device", scene, overrides, out, options)


def _document(function: Any, kind: str) -> None:
    """Give a function the keywords and their texts of the options table."""
    rows = [option for option in of_kind(kind) if option.keyword != ""]
    lines = [f"    {o.key} : {o.help.replace('%%', '%')} ({o.name})" for o in rows]
    function.__doc__ = "\n".join([
        function.__doc__, "",
        "    Files are written only into ``out``. Raises SceneError for bad input, and ArithmeticError where the",
        "    numerics fail (a thermal runaway names its voltage).", "", "    Parameters", "    ----------",
        "    scene : a scene that `scenes.load` returns, or a name or file that it takes",
        "    overrides : keys of the scene, {\"sink.width\": \"20um\"}", "    out : the results folder", *lines,
    ])  # fmt: skip
    fixed = [p for p in Signature.from_callable(function).parameters.values() if p.kind is not Parameter.VAR_KEYWORD]
    more = [Parameter(o.key, Parameter.KEYWORD_ONLY, default=o.default if o.key != "figures" else False) for o in rows]
    function.__signature__ = Signature([*fixed, *more])


_FUNCTIONS = {"sink": run, FREE: solve, "device": device}
for _kind, _function in _FUNCTIONS.items():
    _document(_function, _kind)


def _run(kind: str, given: Any, overrides: Overrides, out: str | Path | None, options: dict[str, Any]) -> Run:
    """Load, solve, and write into a folder where one is given."""
    known = {option.key: option for option in of_kind(kind) if option.keyword != ""}
    if strange := [name for name in options if name not in known]:
        raise unknown("there is no option", strange[0], known)
    chosen = {
        name: as_text(known[name], value)
        for name, value in options.items() if value is not None and value is not False
    }  # fmt: skip
    check(kind, chosen)
    listed = settings(kind, chosen, texts(overrides))
    if not isinstance(given, (str, Path)) and not hasattr(given, "kind"):
        raise SceneError(f"{quoted(given)} is no scene: give a name, a file, or what scenes.load returns")
    scene = load(given, listed) if isinstance(given, (str, Path)) else overridden(given, listed)
    if scene.kind != kind:
        wrong, right = (_FUNCTIONS[each].__name__ for each in (kind, scene.kind))
        raise SceneError(f"{quoted(scene.name)} is no scene for compare.{wrong}: use compare.{right}")
    values = read(kind, chosen, scene).but(figures=bool(options.get("figures")))
    with single_threaded():
        if out is None:
            if values.figures or values.fields or values.export:
                raise SceneError("figures, fields and exported models need a folder to go to: give out=")
            outcome = pipeline.solve(scene, values)
        else:
            outcome = plugin("write")(scene, values, Path(str(out)))
    if outcome.failure is not None:
        raise outcome.failure
    return Run(outcome)
