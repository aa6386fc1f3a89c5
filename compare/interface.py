"""The public interface from Python: solve a scene, and ask for checks, quantities and traces."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare import scope, sink_run
from compare.asked import SinkRequest
from compare.columns import Columns
from compare.device.outcome import DeviceOutcome
from compare.outcome import Outcome
from compare.solve.outcome import SolveOutcome
from scenes.any import load, overridden
from scenes.device import Device
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.sink import Sink

if TYPE_CHECKING:
    from compare.verdict import Check
    from compare.why import Budget
    from scenes.model import AnyScene
    from scenes.result import Estimate, Result

Overrides = Sequence[str] | Mapping[str, object]
"""Such as ["sink.width=20um"] or {"sink.width": "20um"}."""


@dataclass(frozen=True, repr=False)
class Run:
    """What a run of a sink found. ``outcome`` has everything; the rest are short ways to it."""

    outcome: Outcome

    @property
    def answer(self) -> str:
        """How far the 1D model is from 3D, where, and what is to blame, in a sentence."""
        return self.outcome.answer

    @property
    def scene(self) -> Sink:
        """The sink that was solved."""
        return self.outcome.sink

    @property
    def fem3d(self) -> Result:
        """The 3D model's answer: ``steady["peak_rise_K"].value`` and ``.error``, ``traces``."""
        if self.outcome.fem3d is None:
            raise SceneError("this run has no 3D model")
        return self.outcome.fem3d

    @property
    def reduced1d(self) -> Result:
        """The 1D model's answer, of the same type."""
        if self.outcome.reduced1d is None:
            raise SceneError("this run has no 1D model")
        return self.outcome.reduced1d

    @property
    def checks(self) -> dict[str, Check]:
        """Every check by its id."""
        return _by_id(self.outcome.checks)

    @property
    def why(self) -> Budget | None:
        """The difference in parts, one for each assumption; None unless asked for with ``why=True``."""
        return self.outcome.why

    def check(self, name: str) -> Check:
        """One check: its ``verdict``, ``difference`` (1D or equation against 3D, relative), ``u_num``, ``because``.

        SceneError for an id that there isn't, or that this run did not make, with the reason.
        """
        return _check(name, self.checks, scope.skipped_checks(self.scene, self.outcome.request))

    @property
    def traces(self) -> Columns:
        """Both models over time, by the columns of traces.csv: ``traces["fem3d_peak_K"]``, ``traces.to_dataframe()``;
        ``traces("peak_K")`` is (times, 3D, 1D)."""
        from validate.report.traces import columns_of

        return Columns(columns_of(self.outcome.fem3d, self.outcome.reduced1d))

    def report(self) -> str:
        """What the command prints about the run."""
        from validate.report.table import Style, found_text

        return found_text(self.outcome, self._contrary(), Style())

    def __repr__(self) -> str:
        from validate.report.table import Style, headline, quantities_text

        return f"{headline(self.outcome, self._contrary(), Style())}\n\n{quantities_text(self.outcome, Style())}"

    def _repr_html_(self) -> str:
        from validate.report.summary import document
        from validate.report.table import Style, headline

        return _html(headline(self.outcome, self._contrary(), Style()), document(self.outcome))

    def _contrary(self) -> list[Check]:
        from compare.checks import contradicts

        return [check for check in self.outcome.checks if contradicts(check, self.scene, False)]


@dataclass(frozen=True, repr=False)
class Solution:
    """What a run of a free scene found: ``solution["probe"]`` is a steady value with its error."""

    outcome: SolveOutcome

    @property
    def scene(self) -> AnyScene:
        """The scene that was solved."""
        return self.outcome.scene

    @property
    def steady(self) -> dict[str, Estimate]:
        """Steady values by probe, in K, V, W or A; empty of a transient."""
        return self.outcome.result.steady

    @property
    def traces(self) -> Columns:
        """Probes over time: "time_s" and a column for each; empty of a steady scene."""
        traces = self.outcome.result.traces
        return Columns({} if traces is None else {"time_s": traces.time, **traces.values})

    def __getitem__(self, probe: str) -> Estimate:
        if probe not in self.steady:
            raise KeyError(f"no steady value of {probe!r}; there are {', '.join(self.steady) or 'none: see .traces'}")
        return self.steady[probe]

    def report(self) -> str:
        """The probes with their errors: steady, or at the end of the transient."""
        from validate.report.solve.table import headline, value_text
        from validate.report.table import Style, warnings_text

        result = self.outcome.result
        lines = [f"  {probe.name:<30} {value_text(probe, result, Style())}" for probe in self.scene.probes]
        parts = [headline(self.outcome, Style()), "\n".join(lines), *warnings_text(self.outcome)]
        return "\n\n".join(parts)

    def __repr__(self) -> str:
        return _screen(self.report())

    def _repr_html_(self) -> str:
        from validate.report.solve.summary import document
        from validate.report.solve.table import headline
        from validate.report.table import Style

        return _html(headline(self.outcome, Style()), document(self.outcome), self.report())


@dataclass(frozen=True, repr=False)
class DeviceRun:
    """What a run of the device found; ``outcome.runs.base.result`` is the model's own answer."""

    outcome: DeviceOutcome

    @property
    def scene(self) -> Device:
        """The device that was simulated."""
        return self.outcome.device

    @property
    def checks(self) -> dict[str, Check]:
        """Every check by its id."""
        return _by_id(self.outcome.checks)

    def check(self, name: str) -> Check:
        """One check of what the paper says; SceneError for one that there isn't, or that was not made."""
        from compare.device.scope import skipped_checks

        return _check(name, self.checks, skipped_checks(self.scene, self.outcome.request))

    @property
    def traces(self) -> Columns:
        """A row for each controller sample: "time_s", "reduced1d_sink_K" ... as in traces.csv."""
        from scenes.loop.result import QUANTITIES

        result = self.outcome.runs.base.result
        return Columns({"time_s": result.time_s, **{f"reduced1d_{name}": result.trace(name) for name in QUANTITIES}})

    def report(self) -> str:
        """What the command prints about the run."""
        from validate.report.device.table import found_text
        from validate.report.table import Style

        return found_text(self.outcome, self._contrary(), Style())

    def __repr__(self) -> str:
        return self._headline()

    def _repr_html_(self) -> str:
        from validate.report.device.summary import document

        return _html(self._headline(), document(self.outcome))

    def _headline(self) -> str:
        from validate.report.device.table import headline
        from validate.report.table import Style

        return headline(self.outcome, self._contrary(), Style())

    def _contrary(self) -> list[Check]:
        from compare.checks import contradicts

        return [check for check in self.outcome.checks if contradicts(check, self.scene, False)]


def run(
    scene: Sink | str | Path = "sink",
    *,
    voltage: float | None = None,
    accuracy: float | None = None,
    overrides: Overrides = (),
    steady: bool = False,
    reduction: str = "paper",
    why: bool = False,
    against: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    out: str | Path | None = None,
    figures: bool = False,
    fields: bool = False,
) -> Run:
    """Solve a sink in 3D and in 1D, and compare.

    ``scene`` is what ``scenes.load`` returns, or takes; ``voltage`` (V), ``accuracy`` and ``overrides`` change it.
    ``reduction`` is the 1D model, ``why`` splits its difference by assumption, ``steady`` leaves out the transient,
    ``against`` is a file with traces of your own, of which ``columns`` may name some: {"peak": "T (K), Point 1"}. Only
    into the folder ``out`` is anything written; ``figures`` and ``fields`` go there. Raises SceneError for bad input,
    ArithmeticError where the numerics fail (a thermal runaway names its voltage).
    """
    from reduced1d.ladder import canonical

    sink = _scene(scene, Sink, overrides, {"drive.voltage": voltage, "run.accuracy": accuracy})
    _refuse_without(out, figures or fields)
    if steady and against is not None:
        raise SceneError("against compares over time: leave out steady=True")
    request = SinkRequest(
        transient=not steady, figures=figures, fields=fields, reduction=canonical(reduction), why=why
    )  # fmt: skip
    if request.reduction != "paper":
        # What a scene declares is of the paper's model.
        sink = replace(sink, expected_to_differ=None)
    data = None
    if against is not None:
        from compare.against.data import read

        data = read(Path(against), sink, [f"{name}={column}" for name, column in (columns or {}).items()])
    if out is None:
        return Run(sink_run.answer(sink, request, against=data))
    return Run(sink_run.run(sink, request, Path(out), against=data))


def solve(
    scene: AnyScene | str | Path,
    *,
    accuracy: float | None = None,
    overrides: Overrides = (),
    out: str | Path | None = None,
    figures: bool = False,
    fields: bool = False,
) -> Solution:
    """Solve any scene of boxes, or on a mesh, in 3D: heat, current or both, steady or over time.

    ``scene`` is what ``scenes.load`` returns, or takes; ``accuracy`` and ``overrides`` change it. Only into the folder
    ``out`` is anything written. Raises SceneError for bad input, ArithmeticError where the numerics fail.
    """
    from compare.solve import run as solve_run
    from compare.solve.scope import SolveRequest

    found = _scene(scene, None, overrides, {"run.accuracy": accuracy})
    _refuse_without(out, figures or fields)
    if out is None:
        return Solution(solve_run.answer(found))
    return Solution(solve_run.run(found, SolveRequest(figures, fields), Path(out)))


def device(
    scene: Device | str | Path = "device",
    *,
    accuracy: float | None = None,
    overrides: Overrides = (),
    out: str | Path | None = None,
    figures: bool = False,
    **asked: Any,
) -> DeviceRun:
    """Simulate the whole sensor in 1D, and check what the paper says of it.

    ``scene`` is what ``scenes.load`` returns, or takes; ``accuracy`` and ``overrides`` change it. ``asked`` are
    ``scheme`` ("accurate" or "paper"), ``about`` (the figures it is about), ``meter``, ``largest_voltage``,
    ``largest_power``. Only into the folder ``out`` is anything written. Raises SceneError for bad input,
    ArithmeticError where the numerics fail.
    """
    from dataclasses import fields as fields_of

    from compare.device import run as device_run
    from compare.device.scope import DeviceRequest

    found = _scene(scene, Device, overrides, {"run.accuracy": accuracy})
    known = tuple(field.name for field in fields_of(DeviceRequest) if field.name not in ("figures", "command"))
    for name in asked:
        if name not in known:
            raise SceneError(f"device takes no {quoted(name)}: give {', '.join(known)}{did_you_mean(name, known)}")
    _refuse_without(out, figures)
    request = DeviceRequest(figures=figures, **asked)
    if out is None:
        return DeviceRun(device_run.answer(found, request))
    return DeviceRun(device_run.run(found, request, Path(out)))


def _scene(given: Any, kind: type | None, overrides: Overrides, more: Mapping[str, float | None]) -> Any:
    """The scene, with overrides, of the kind wanted (None for a free one)."""
    listed = [f"{k}={v}" for k, v in overrides.items()] if isinstance(overrides, Mapping) else list(overrides)
    listed += [f"{key}={float(value)!r}" for key, value in more.items() if value is not None]
    found = load(given, listed) if isinstance(given, (str, Path)) else overridden(given, listed)
    own: type | None = type(found) if isinstance(found, (Sink, Device)) else None
    if own is not kind:
        use: dict[type | None, str] = {Sink: "compare.run", Device: "compare.device", None: "compare.solve"}
        raise SceneError(f"{quoted(found.name)} is no scene for {use[kind]}: use {use[own]}")
    return found


def _refuse_without(out: str | Path | None, wanted: bool) -> None:
    if wanted and out is None:
        raise SceneError("figures and fields need a folder to go to: give out=")


def _by_id(checks: Iterable[Check]) -> dict[str, Check]:
    return {check.id: check for check in checks}


def _check(name: str, made: Mapping[str, Check], skipped: Mapping[str, str]) -> Check:
    if name in made:
        return made[name]
    if name in skipped:
        raise SceneError(f"this run made no check {quoted(name)}: {skipped[name]}")
    known = tuple(made)
    raise SceneError(f"{quoted(name)} is no check: give {', '.join(known)}{did_you_mean(name, known)}")


_LINES = 24


def _screen(text: str) -> str:
    """At most a screen of a text."""
    lines = text.splitlines()
    more = len(lines) - _LINES
    return text if more <= 0 else "\n".join([*lines[:_LINES], f"  ... and {more} more: see .report()"])


def _html(said: str, document: Mapping[str, Any], instead: str = "") -> str:
    """For notebooks: the answer, the quantities and the checks; ``instead`` where the document has neither."""
    from validate.report.html.checks import checks
    from validate.report.html.numbers import quantities

    tables = quantities(document) + checks(document) or f"<pre>{escape(instead)}</pre>"
    return f"<p><strong>{escape(' '.join(said.split()))}</strong></p>\n{tables}"
