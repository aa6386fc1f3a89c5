"""What a run of the device found."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from compare.device.design import Design
    from compare.device.runs import Runs
    from compare.device.scope import DeviceRequest
    from compare.verdict import Check
    from scenes.device import Device
    from scenes.plan import Step


@dataclass(frozen=True)
class DeviceOutcome:
    """What a run found: the plan, the model's runs, the checks, a designer's answers (``None`` where not asked for),
    how long each stage took (s), the folder with its files, and remarks."""

    device: Device
    request: DeviceRequest
    plan: tuple[Step, ...]
    runs: Runs
    checks: tuple[Check, ...]
    design: Design | None = None
    timing: dict[str, float] = field(default_factory=dict)
    folder: Path = Path()
    replaced: str = ""
    files: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
