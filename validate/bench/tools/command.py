"""A whole `validate` command from cold, as its user waits for it, on the wall: ``options`` are its ``arguments``."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any


def prepare(options: dict[str, Any]) -> tuple[Callable[[], float], Callable[[float], dict[str, Any]]]:
    """Run it with its results in a folder that is removed."""

    def solve() -> float:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "validate", *options["arguments"], "--quiet", "--out", folder + "/run"]
            started = time.perf_counter()
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            return time.perf_counter() - started

    return solve, lambda seconds: {"seconds": [seconds]}
