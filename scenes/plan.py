"""What a run will do: a value that can be printed, and the only place that decides what to skip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Request:
    """What the user asked of a run."""

    models: tuple[Literal["fem3d", "reduced1d"], ...] = ("fem3d", "reduced1d")
    transient: bool = True
    figures: bool = True
    fields: bool = False
    field_times: tuple[float, ...] = ()
    """Times (s) whose fields are wanted beside those that are stored anyway."""
    command: str = ""
    """The command line that asked, for the record; empty where it was none."""


@dataclass(frozen=True)
class Step:
    """One line of a plan: a step, whether it is done or skipped, and why, in words."""

    step: str
    state: Literal["done", "skipped"]
    reason: str
