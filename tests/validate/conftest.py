"""Each test runs in a folder of its own."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def _somewhere_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def no_field(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of figures all but the field's picture, which a process of its own renders for longer than all else takes."""
    monkeypatch.setattr("validate.report.output.draws_field", lambda *_: False)
