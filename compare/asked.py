"""What a user asks of `validate sink` beyond what the 3D model has to know."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

from scenes.plan import Request


@dataclass(frozen=True)
class SinkRequest(Request):
    """``reduction`` is the 1D model, by its canonical name; ``why`` asks for the budget of its differences from 3D;
    ``export`` is the folder for the few-state model."""

    reduction: str = "paper"
    why: bool = False
    export: Path | None = None


def whole(request: Request) -> SinkRequest:
    """Any request with what it leaves open at its defaults."""
    if isinstance(request, SinkRequest):
        return request
    return SinkRequest(**{f.name: getattr(request, f.name) for f in fields(Request)})
