"""Each test runs in a folder of its own."""

import pytest


@pytest.fixture(autouse=True)
def _somewhere_else(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def no_field(monkeypatch):
    """Of figures all but the field's picture, which a process of its own renders for longer than all else takes."""
    monkeypatch.setattr("validate.report.output.draws_field", lambda *_: False)
