"""The public interface from Python: solve a sink in 3D and in 1D, and ask for checks, quantities and traces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from compare import scope, sink_run
from compare.outcome import Outcome
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.loading import check as checked
from scenes.loading import load
from scenes.plan import Request
from scenes.sink import Sink

if TYPE_CHECKING:
    import numpy as np

    from compare.verdict import Check
    from scenes.result import Result


@dataclass(frozen=True)
class Run:
    """What a run found. ``outcome`` has everything; the rest are short ways to it."""

    outcome: Outcome

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
        return {check.id: check for check in self.outcome.checks}

    def check(self, name: str) -> Check:
        """One check: its ``verdict``, ``difference`` (1D or equation against 3D, relative), ``u_num``, ``because``.

        SceneError for an id that there isn't, or that this run did not make, with the reason.
        """
        if name in self.checks:
            return self.checks[name]
        skipped = scope.skipped_checks(self.scene, self.outcome.request)
        if name in skipped:
            raise SceneError(f"this run made no check {quoted(name)}: {skipped[name]}")
        known = tuple(self.checks)
        raise SceneError(f"{quoted(name)} is no check: give {', '.join(known)}{did_you_mean(name, known)}")

    def traces(self, quantity: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times (s), 3D values and 1D values of a quantity over time: "peak_K", "end_K", "mean_K", "current_A",
        "power_W"; SceneError where there is no such quantity, or the run has no transient."""
        three, one = self.fem3d.traces, self.reduced1d.traces
        if three is None or one is None:
            raise SceneError("this run has no transient: leave out steady=True")
        if quantity not in three.values:
            known = tuple(three.values)
            raise SceneError(f"{quoted(quantity)} is no trace: give {', '.join(known)}{did_you_mean(quantity, known)}")
        return three.time, three.values[quantity], one.values[quantity]

    def report(self) -> str:
        """What the command prints about the run."""
        from compare.table import Style, checks_text, reasons_text

        parts = [checks_text(self.outcome.checks, Style()), reasons_text(self.outcome.checks, (), Style())]
        return "\n\n".join(part for part in parts if part)


def run(
    scene: Sink | str | Path = "sink",
    *,
    voltage: float | None = None,
    accuracy: float | None = None,
    steady: bool = False,
    against: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    out: str | Path | None = None,
    figures: bool = False,
    fields: bool = False,
) -> Run:
    """Solve a sink in 3D and in 1D, and compare.

    ``scene`` is what ``scenes.load`` returns, or what it takes; ``voltage`` (V) and ``accuracy`` replace the scene's.
    ``steady`` leaves out the transient, ``against`` is a file with traces of your own, of which
    ``columns`` may name some: {"peak": "T (K), Point 1"}. Nothing is written but into the
    folder ``out``, where ``figures`` and ``fields`` go too. Raises SceneError for bad input, ArithmeticError where the
    numerics fail (a thermal runaway names its voltage).
    """
    sink = changed(scene if isinstance(scene, Sink) else load(scene), voltage, accuracy)
    if (figures or fields) and out is None:
        raise SceneError("figures and fields need a folder to go to: give out=")
    if steady and against is not None:
        raise SceneError("against compares over time: leave out steady=True")
    request = Request(transient=not steady, figures=figures, fields=fields)
    data = None
    if against is not None:
        from compare.against.data import read

        data = read(Path(against), sink, [f"{name}={column}" for name, column in (columns or {}).items()])
    if out is None:
        return Run(sink_run.answer(sink, request, against=data))
    return Run(sink_run.run(sink, request, Path(out), against=data))


def changed(sink: Sink, voltage: float | None, accuracy: float | None) -> Sink:
    """The sink with another voltage or accuracy, checked. What it says of its checks holds for its own voltage only."""
    if voltage is not None and float(voltage) != sink.voltage:
        sink = replace(sink, voltage=float(voltage), expected_to_differ=None)
    if accuracy is not None:
        sink = replace(sink, accuracy=float(accuracy))
    return checked(sink)
