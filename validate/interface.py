"""The public interface from Python: solve a scene, and ask for checks, quantities and traces."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from compare.processes import single_threaded
from scenes import load, overridden
from scenes.device import Device
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.plan import Request
from scenes.sink import Sink
from validate.report import of
from validate.run import kinds
from validate.run.outcome import Outcome
from validate.run.plan import declared

if TYPE_CHECKING:
    import numpy as np

    from compare.against import Data
    from compare.blame import Budget
    from compare.verdict import Check
    from scenes.model import AnyScene
    from scenes.result import Estimate, Result
    from scenes.uncertain import Uncertain
    from validate.inputs.propagation import Propagated
    from validate.inputs.sensitivities import Sensitivities
    from validate.report.table import Style

Overrides = Sequence[str] | Mapping[str, object]
"""Such as ["sink.width=20um"] or {"sink.width": "20um"}."""

S = TypeVar("S")
_LINES = 24  # Lines of a text that a screen holds.


class Columns(dict[str, "np.ndarray"]):
    """Arrays of equal length by name: ``columns["time_s"]``, ``columns["fem3d_peak_K"]``; empty without a transient.

    ``columns("peak_K")`` is (times, 3D, 1D) of one quantity of a sink.
    """

    def __missing__(self, name: str) -> np.ndarray:
        raise KeyError(f"no column {name!r}; there are {', '.join(self) or 'none, as there is no transient'}")

    def __call__(self, quantity: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times (s), 3D and 1D values of a quantity of a sink: "peak_K", "end_K", "mean_K", "current_A", "power_W";
        SceneError where there is none of that name, or no transient."""
        if not self:
            raise SceneError("this run has no transient: leave out steady=True")
        names = tuple(name.removeprefix("fem3d_") for name in self if name.startswith("fem3d_"))
        if quantity not in names:
            raise SceneError(f"{quoted(quantity)} is no trace: give {', '.join(names)}{did_you_mean(quantity, names)}")
        return self["time_s"], self[f"fem3d_{quantity}"], self[f"reduced1d_{quantity}"]

    def __repr__(self) -> str:
        rows = len(next(iter(self.values()), ()))
        return f"<traces, {rows} rows: {', '.join(self)}>" if self else "<no traces: no transient was solved>"

    def to_dataframe(self) -> Any:
        """The columns as a pandas DataFrame; ImportError where pandas is not installed."""
        try:
            import pandas
        except ImportError:
            raise ImportError("to_dataframe needs pandas: pip install pandas") from None
        return pandas.DataFrame(dict(self))


def _part(path: str, said: str) -> Any:
    """A property that is a part of the outcome."""
    return property(attrgetter(f"outcome.{path}"), doc=said)


class _Found(Generic[S]):
    """What a run found. ``outcome`` has everything; the rest are short ways to it."""

    scene: S = _part("scene", "The scene that was solved.")
    sensitivities: Sensitivities | None = _part(
        "sensitivities",
        """How the models follow each key: ``steady["sink.width"]["end_rise_K"].fem3d.value``, of a free scene
        ``steady["box.beam.upper.z"]["middle"]``; None unless asked for with ``sensitivities=True``.""",
    )
    uncertain: Propagated | None = _part(
        "propagated",
        "The u_input of quantities, and of the differences of models; None unless asked for with ``uncertain={...}``.",
    )

    def __init__(self, outcome: Outcome[S]) -> None:
        self.outcome = outcome
        self._kind = of(outcome.scene)

    @property
    def checks(self) -> dict[str, Check]:
        """Every check by its id."""
        return {check.id: check for check in self.outcome.checks}

    @property
    def traces(self) -> Columns:
        """Every quantity over time, by the columns of traces.csv: ``traces["fem3d_peak_K"]``,
        ``traces.to_dataframe()``; empty without a transient."""
        return Columns(self._kind.columns(self.outcome))

    def check(self, name: str) -> Check:
        """One check: its ``verdict``, ``difference`` (1D or equation against 3D, relative), ``u_num``, ``because``.

        SceneError for an id that there isn't, or that this run did not make, with the reason.
        """
        if name in self.checks:
            return self.checks[name]
        for step in self.outcome.plan:
            kind, _, names = step.step.partition(" ")
            if kind == "checks" and step.state == "skipped" and name in names.split(", "):
                raise SceneError(f"this run made no check {quoted(name)}: {step.reason}")
        ids = tuple(self.checks)
        raise SceneError(f"{quoted(name)} is no check: give {', '.join(ids)}{did_you_mean(name, ids)}")

    def report(self) -> str:
        """What the command prints about the run."""
        from validate.report.table import found_text

        return found_text(*self._told())

    def __repr__(self) -> str:
        return str(self._kind.headline(*self._told()))

    def _repr_html_(self) -> str:
        from validate.report.html.page import of_section

        said = f"<p><strong>{escape(' '.join(_Found.__repr__(self).split()))}</strong></p>"
        return "\n".join([said, *map(of_section, self._kind.sections(*self._told(page=True))[:3])])

    def _told(self, **look: bool) -> tuple[Outcome[Any], list[Check], Style]:
        """What a text about the run is made of."""
        from compare.verdict import contrary
        from validate.report.table import Style

        outcome: Outcome[Any] = self.outcome
        return outcome, contrary(outcome.checks, outcome.scene), Style(**look)


class Run(_Found[Sink]):
    """What a run of a sink found; ``traces("peak_K")`` is (times, 3D, 1D)."""

    answer: str = _part("answer", "How far the 1D model is from 3D, where, and what is to blame, in a sentence.")
    fem3d: Result = _part(
        "solved", 'The 3D model\'s answer: ``steady["peak_rise_K"].value`` and ``.error``, ``traces``.'
    )
    reduced1d: Result = _part("reduced1d", "The 1D model's answer, of the same type.")
    why: Budget | None = _part(
        "why", "The difference in parts, one for each assumption; None unless asked for with ``why=True``."
    )

    def __repr__(self) -> str:
        from validate.report.table import Style

        return f"{super().__repr__()}\n\n{self._kind.quantities(self.outcome, Style()).text(Style())}"


class Solution(_Found["AnyScene"]):
    """What a run of a free scene found: ``solution["probe"]`` is a steady value with its error."""

    answer: str = _part("answer", "How far a model is from 3D, and where, in a sentence; empty without a model.")
    steady: dict[str, Estimate] = _part("solved.steady", "Steady values by probe, in K, V, W or A, if any.")
    reduced1d: Result = _part("reduced1d", "The model's answer, of the same type as 3D's; None without a model.")

    def __getitem__(self, probe: str) -> Estimate:
        if probe not in self.steady:
            raise KeyError(f"no steady value of {probe!r}; there are {', '.join(self.steady) or 'none: see .traces'}")
        return self.steady[probe]

    def report(self) -> str:
        """The probes with their errors: steady, or at the end of the transient."""
        from validate.report.table import Style, warnings_text

        result, of_probe = self.outcome.solved, self._kind.value_text
        lines = [f"  {probe.name:<30} {of_probe(probe, result, Style())}" for probe in self.scene.probes]
        return "\n\n".join([super().__repr__(), "\n".join(lines), *warnings_text(self.outcome)])

    def __repr__(self) -> str:
        lines = self.report().splitlines()
        more = len(lines) - _LINES
        return "\n".join(lines if more <= 0 else [*lines[:_LINES], f"  ... and {more} more: see .report()"])


class DeviceRun(_Found[Device]):
    """What a device's run found; ``outcome.runs.base.result`` is the answer, ``traces`` have a row per sample."""


def run(
    scene: Sink | str | Path = "sink",
    *,
    voltage: float | None = None,
    accuracy: float | None = None,
    overrides: Overrides = (),
    steady: bool = False,
    reduction: str | Path | Callable[..., Any] = "paper",
    why: bool = False,
    sensitivities: bool = False,
    left_out: bool = False,
    uncertain: Mapping[str, str] | None = None,
    against: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    data_uncertainty: str | Sequence[str] = (),
    out: str | Path | None = None,
    figures: bool = False,
    fields: bool = False,
) -> Run:
    """Solve a sink in 3D and in 1D, and compare.

    ``scene`` is what ``scenes.load`` returns, or takes; ``voltage`` (V), ``accuracy`` and ``overrides`` change it.
    ``reduction`` is the 1D model, one of this program's by its name or one of your own, a function f(scene, times) or
    what `--reduction` takes; ``why`` splits its difference by assumption, ``steady`` leaves out the transient,
    ``sensitivities`` says how both models follow each key, ``left_out`` what
    both models leave out, ``uncertain`` how well keys are known: {"sink.width": "1%"}, ``against`` is a file with
    traces of your own, of which ``columns`` may name some: {"peak": "T (K), Point 1"}, and which are known to
    ``data_uncertainty``: "0.5K". Only into the folder ``out``
    is anything written; ``figures`` and ``fields`` go there. Raises SceneError for bad input, ArithmeticError where the
    numerics fail (a thermal runaway names its voltage).
    """
    from compare.models import parse_reduction

    sink = _scene(scene, Sink, overrides, {"drive.voltage": voltage, "run.accuracy": accuracy})
    if steady and against is not None:
        raise SceneError("against compares over time: leave out steady=True")
    name, model = parse_reduction(str(reduction) if isinstance(reduction, Path) else reduction)
    if model and why:
        raise SceneError("why splits the differences of this program's own 1D models: leave it out")
    request = Request(
        transient=not steady, figures=figures, fields=fields, reduction=name, model=model, why=why,
        sensitivities=sensitivities, left_out=left_out,
        uncertain=_uncertain(sink, uncertain),
        data_uncertainty=(data_uncertainty,) if isinstance(data_uncertainty, str) else tuple(data_uncertainty),
    )  # fmt: skip
    return Run(_outcome(sink, request, out, _data(sink, against, columns, data_uncertainty)))


def solve(
    scene: AnyScene | str | Path,
    *,
    accuracy: float | None = None,
    overrides: Overrides = (),
    model: str | Path | Callable[..., Any] | None = None,
    sensitivities: bool = False,
    uncertain: Mapping[str, str] | None = None,
    against: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    data_uncertainty: str | Sequence[str] = (),
    out: str | Path | None = None,
    figures: bool = False,
    fields: bool = False,
) -> Solution:
    """Solve any scene of boxes, or on a mesh, in 3D: heat, current or both, steady or over time.

    ``scene`` is what ``scenes.load`` returns, or takes; ``accuracy`` and ``overrides`` change it. ``model`` is a 1D
    model of it to be judged: a function f(scene, times) -> {probe: number or (n,) numbers}, or what `--model` takes;
    then there are ``checks``, and ``answer`` says how far it is off. ``sensitivities`` says how the probes follow each
    number of the scene, ``uncertain`` how well some are known: {"box.beam.upper.z": "0.1um"}, ``against``, ``columns``
    and ``data_uncertainty`` are of your own data, as of `run`: traces, or rows "probe, value" of a steady state. Only
    into the folder ``out`` is anything written. Raises SceneError for bad input, ArithmeticError where the numerics
    fail.
    """
    from validate.run.kinds.free import reported

    loaded = _scene(scene, None, overrides, {"run.accuracy": accuracy})
    # Without a folder a scene without probes reports every part's mean temperature.
    scene = reported(loaded, Request(fields=fields or out is None))
    request = Request(
        figures=figures, fields=fields, model=str(model) if isinstance(model, Path) else model or "",
        sensitivities=sensitivities, uncertain=_uncertain(loaded, uncertain),
        data_uncertainty=(data_uncertainty,) if isinstance(data_uncertainty, str) else tuple(data_uncertainty),
    )  # fmt: skip
    return Solution(_outcome(scene, request, out, _data(scene, against, columns, data_uncertainty)))


def device(
    scene: Device | str | Path = "device",
    *,
    accuracy: float | None = None,
    overrides: Overrides = (),
    out: str | Path | None = None,
    figures: bool = False,
    **options: Any,
) -> DeviceRun:
    """Simulate the whole sensor in 1D, and in 3D where asked for, and check what the paper says of it.

    ``scene`` is what ``scenes.load`` returns, or takes; ``accuracy`` (in 3D where that is asked for) and
    ``overrides`` change it. ``options`` are ``in_3d``, ``scheme`` ("accurate" or "paper"), ``about`` (the figures it
    is about), ``meter``, ``largest_voltage``, ``largest_power``, and as of `run` ``sensitivities``, ``left_out`` and
    ``uncertain``.
    Only into the folder ``out`` is anything written. Raises SceneError for bad input, ArithmeticError where the
    numerics fail.
    """
    loaded = _scene(scene, Device, overrides, {f"run.accuracy{'_3d' * bool(options.get('in_3d'))}": accuracy})
    known = ("in_3d", "left_out", "sensitivities", "uncertain", "scheme", "about", "meter", "largest_voltage",
             "largest_power")  # fmt: skip
    for name in options:
        if name not in known:
            raise SceneError(f"device takes no {quoted(name)}: give {', '.join(known)}{did_you_mean(name, known)}")
    options["uncertain"] = _uncertain(loaded, options.get("uncertain"))
    return DeviceRun(_outcome(loaded, Request(figures=figures, **options), out))


def _scene(given: Any, kind: Any, overrides: Overrides, more: Mapping[str, float | None]) -> Any:
    """The scene, with overrides, of the kind wanted (None for a free one)."""
    listed = [f"{k}={v}" for k, v in overrides.items()] if isinstance(overrides, Mapping) else list(overrides)
    listed += [f"{key}={float(value)!r}" for key, value in more.items() if value is not None]
    scene = load(given, listed) if isinstance(given, (str, Path)) else overridden(given, listed)
    call, wanted = kinds.of(scene).PYTHON, "free" if kind is None else kind.kind
    if scene.kind != wanted:
        use = import_module(f"validate.run.kinds.{wanted}").PYTHON
        raise SceneError(f"{quoted(scene.name)} is no scene for {use}: use {call}")
    return scene


def _uncertain(scene: object, given: Mapping[str, str] | None) -> Uncertain | None:
    """Standard uncertainties by key, {"sink.width": "1%"}, correlations by pairs, {"sink.width,sink.length": "0.9"};
    {"materials": ""} is the scene's own table."""
    if not given:
        return None
    from scenes.uncertain import read

    singles = [f"{key}={value}" if str(value) else key for key, value in given.items() if "," not in key]
    return read(scene, singles, [f"{key}={value}" for key, value in given.items() if "," in key])


def _data(
    scene: Any, against: str | Path | None, columns: Mapping[str, str] | None, known_to: str | Sequence[str]
) -> Data | None:  # fmt: skip
    """The user's own data, if there are any."""
    if against is None:
        return None
    from compare.data import read

    named = [f"{name}={column}" for name, column in (columns or {}).items()]
    return read(Path(against), scene, named, [known_to] if isinstance(known_to, str) else known_to)


@single_threaded()
def _outcome(scene: Any, request: Request, out: str | Path | None, data: Data | None = None) -> Outcome[Any]:
    """What a run finds, written into a folder where one is given."""
    scene = declared(scene, request)
    if out is None:
        if request.figures or request.fields:
            raise SceneError("figures and fields need a folder to go to: give out=")
        from validate.run.pipeline import answer

        outcome = answer(scene, request, data=data)
    else:
        from validate.report.output import run as kept

        outcome = kept(scene, request, Path(out), data=data)
    if outcome.failed is not None:
        raise outcome.failed
    return outcome
