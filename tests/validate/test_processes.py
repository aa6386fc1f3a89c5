"""Linear algebra uses one thread, unless the environment sets another number; a pool of processes."""

import os
import subprocess
import sys

import pytest
import scipy.linalg  # noqa: F401 - whose library has threads of its own
from threadpoolctl import threadpool_info, threadpool_limits

from compare.processes import ONE_THREAD, single_threaded
from compare.worker import map_tasks
from validate.cli import main


@pytest.fixture
def unsaid(monkeypatch):
    """An environment without a number of threads."""
    for name in ONE_THREAD:
        monkeypatch.setenv(name, "")  # so that what is set meanwhile goes again
        monkeypatch.delenv(name)


def threads() -> set[int]:
    return {library["num_threads"] for library in threadpool_info()}


def test_inside_and_not_after(unsaid):
    with threadpool_limits(2):
        assert threads() == {2}
        with single_threaded():
            assert threads() == {1}
        assert threads() == {2}


def test_what_the_environment_says_stays(unsaid, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    with threadpool_limits(2), single_threaded():
        assert threads() == {2}
    main(["--version"])
    assert {name: os.environ[name] for name in ONE_THREAD if name in os.environ} == {"OMP_NUM_THREADS": "2"}


def test_the_command_says_so_before_numpy_is_loaded(unsaid):
    main(["--version"])
    assert {os.environ[name] for name in ONE_THREAD} == {"1"}


def test_a_script_needs_no_guard_around_a_pool(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        """import math
print("begins")
from compare.worker import map_tasks
print(sorted(map_tasks(math.factorial, [3, 4], 2, int)))
""",
        encoding="utf-8",
    )
    run = subprocess.run([sys.executable, script], capture_output=True, encoding="utf-8", timeout=60)
    assert (run.stdout, run.stderr) == ("begins\n[(3, 6), (4, 24)]\n", "")


def test_a_process_that_is_ended_is_told_of_its_number():
    """As the system ends one where the memory is used up."""
    outcomes = dict(map_tasks(os._exit, [3], 2, lambda number: -number))
    assert outcomes == {3: -3}
