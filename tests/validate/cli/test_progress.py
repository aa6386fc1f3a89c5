"""What a terminal is told while something takes long, and that nothing else is."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
CODE = """
import sys, time
from validate.cli import terminal
terminal._SLOW = 0.2
with terminal.progress(quiet={quiet}) as say:
    say("solving in 3D")
    time.sleep({seconds})
print("done")
"""


def command(quiet: bool, seconds: float) -> list[str]:
    return [sys.executable, "-c", CODE.format(quiet=quiet, seconds=seconds)]


def on_a_terminal(quiet: bool, seconds: float) -> str:
    """What appears on a terminal that standard error is."""
    pty = pytest.importorskip("pty", reason="terminals as Unix has them")
    ours, theirs = pty.openpty()
    process = subprocess.Popen(command(quiet, seconds), stderr=theirs, stdout=subprocess.PIPE, cwd=ROOT)
    os.close(theirs)
    said = b""
    while True:
        try:
            more = os.read(ours, 4096)
        except OSError:
            break
        if not more:
            break
        said += more
    os.close(ours)
    assert process.communicate()[0] == b"done\n"
    return said.decode()


def test_a_terminal_is_told_what_and_for_how_long() -> None:
    said = on_a_terminal(False, 0.8)
    assert "solving in 3D" in said
    assert "(1 s)" in said
    # It is wiped off in the end.
    assert said.endswith("\r\x1b[K")


def test_quiet_is_quiet() -> None:
    assert on_a_terminal(True, 0.1) == ""


def test_a_pipe_is_told_nothing() -> None:
    found = subprocess.run(command(False, 0.1), capture_output=True, text=True, cwd=ROOT, check=True)
    assert (found.stdout, found.stderr) == ("done\n", "")
