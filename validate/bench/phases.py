"""How long the phases of one solve take."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Phases:
    """Seconds of processor time by phase, and the unknowns."""

    seconds: dict[str, float] = field(default_factory=dict)
    unknowns: int = 0

    @contextmanager
    def timed(self, name: str, repeats: int = 1) -> Iterator[None]:
        """What is done inside counts for the phase, as one of so many repeats."""
        started = time.process_time()
        yield
        self.seconds[name] = (time.process_time() - started) / repeats

    def read(self) -> dict[str, Any]:
        """For a worker's report."""
        return {"phases": self.seconds, "unknowns": self.unknowns}
