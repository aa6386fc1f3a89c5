"""What is asked of a run, and its plan: what will be done and what is skipped, as a value that can be printed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from scenes.uncertain import Uncertain


@dataclass(frozen=True)
class Export:
    """A compact model to make: folder, relative accuracy, number of states (None: as few as hold that)."""

    folder: Path
    accuracy: float
    states: int | None = None


@dataclass(frozen=True)
class Request:
    """What the user asked of a run, of whichever kind of scene; each kind reads what concerns it.

    Of any: ``figures``, ``fields``, a 1D ``model`` of the user's own, and the ``command`` line that asked, if it was
    one. Of a sink: the ``models``, whether the ``transient`` is solved, ``field_times`` (s) beside those that are
    stored anyway, the 1D model (``reduction``, by its canonical name), the budget of its differences from 3D
    (``why``), how both models follow each key (``sensitivities``), what else both
    models leave out (``left_out``), how well the keys are known (``uncertain``) and how many samples of that
    are solved (``monte_carlo``), and what the data are known to (``data_uncertainty``), and which keys are fitted to
    them (``calibrate``). The compact model (``export``). Of a device:
    whether it is solved ``in_3d`` too, the ``scheme``, the figures that the run is ``about`` (all where none are
    named), the ``meter`` in the loop, the sensor's ``largest_voltage`` (V) and ``largest_power`` (W).
    """

    models: tuple[Literal["fem3d", "reduced1d"], ...] = ("fem3d", "reduced1d")
    transient: bool = True
    figures: bool = True
    fields: bool = False
    field_times: tuple[float, ...] = ()
    reduction: str = "paper"
    model: str | Callable[..., Any] = ""
    why: bool = False
    sensitivities: bool = False
    left_out: bool = False
    uncertain: Uncertain | None = None
    monte_carlo: int = 0
    data_uncertainty: tuple[str, ...] = ()
    calibrate: tuple[str, ...] = ()
    export: Export | None = None
    in_3d: bool = False
    scheme: str = "accurate"
    about: tuple[str, ...] = ()
    meter: str | None = None
    largest_voltage: float = float("inf")
    largest_power: float = float("inf")
    command: str = ""


@dataclass(frozen=True)
class Step:
    """One line of a plan: a step, whether it is done or skipped, and why, in words."""

    step: str
    state: Literal["done", "skipped"]
    reason: str


def step(name: str, does: str, skipped: str = "") -> Step:
    """A line: skipped for the reason given, or else done, and what it does."""
    return Step(name, "skipped", skipped) if skipped else Step(name, "done", does)


def skipped_together(kind: str, skipped: Mapping[str, str]) -> list[Step]:
    """One line for all that is skipped for the same reason: "checks fig6_peak, fig6_end"."""
    lines = []
    for reason in dict.fromkeys(skipped.values()):
        names = [name for name, why in skipped.items() if why == reason]
        lines.append(Step(f"{kind} {', '.join(names)}", "skipped", reason))
    return lines


def noted(plan: Iterable[Step], changed: Iterable[Step]) -> tuple[Step, ...]:
    """A plan as it was carried out: with the lines that a run found otherwise, by their names."""
    instead = {line.step: line for line in changed}
    return tuple(instead.get(line.step, line) for line in plan)
