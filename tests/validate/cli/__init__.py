from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest


def summary(folder: str | Path = "results/sink-1V") -> dict[str, Any]:
    """What a run has written, in which no number is infinite or none."""
    found = json.loads(Path(folder, "summary.json").read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert isinstance(found, dict)
    return found
