"""Linear algebra uses one thread, unless the environment says otherwise."""

from __future__ import annotations

import os

import pytest
import scipy.linalg  # noqa: F401 - whose library has threads of its own
from threadpoolctl import threadpool_info, threadpool_limits

from validate.cli import main
from validate.processes import ONE_THREAD, single_threaded


@pytest.fixture
def unsaid(monkeypatch: pytest.MonkeyPatch) -> None:
    """An environment that says nothing of threads."""
    for name in ONE_THREAD:
        monkeypatch.setenv(name, "")  # so that what is set meanwhile goes again
        monkeypatch.delenv(name)


def threads() -> set[int]:
    return {library["num_threads"] for library in threadpool_info()}


def test_inside_and_not_after(unsaid: None) -> None:
    with threadpool_limits(2):
        assert threads() == {2}
        with single_threaded():
            assert threads() == {1}
            assert {os.environ[name] for name in ONE_THREAD} == {"1"}  # for processes that are started
        assert threads() == {2}
    assert not any(name in os.environ for name in ONE_THREAD)


def test_what_the_environment_says_stays(unsaid: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    with threadpool_limits(2), single_threaded():
        assert threads() == {2}
    main(["--version"])
    assert {name: os.environ[name] for name in ONE_THREAD if name in os.environ} == {"OMP_NUM_THREADS": "2"}


def test_the_command_says_so_before_numpy_is_loaded(unsaid: None) -> None:
    main(["--version"])
    assert {os.environ[name] for name in ONE_THREAD} == {"1"}
