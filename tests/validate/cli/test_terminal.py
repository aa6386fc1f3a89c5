"""The terminal: completion scripts, run by the shells where they are installed, progress, and lines that are longer
than the terminal is wide."""

import os
import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from select import select

import pytest

from validate.cli import terminal
from validate.cli.arguments import COMMANDS
from validate.cli.completion import script
from validate.report.text import wrapped

ASKED = {
    "validate ": set(COMMANDS),
    "validate si": {"sink"},
    "validate sink --vol": {"--voltage"},
    "validate sink --only ": {"3d", "1d"},
    "validate sink --reduction ": {"paper", "anchored", "fin-massless", "fin", "plate", "moments"},
    "validate sink --reduction pl": {"plate"},
    "validate sink --set sink.wid": {"sink.width="},
    "validate map sink --vary drive.v": {"drive.voltage="},
    "validate sweep sink --check fig6": {"fig6_peak", "fig6_end"},
    "validate sink --uncertain materials.oxide.den": {"materials.oxide.density="},
    "validate sink --calibrate anchor.oxide_l": {"anchor.oxide_length"},
    "validate view --show pot": {"potential"},
    "validate completion ": {"bash", "zsh"},
}


def bash(line: str) -> set[str]:
    words = line.split(" ")
    listed = " ".join(f"'{word}'" for word in words)
    asked = f"COMP_WORDS=({listed}); COMP_CWORD={len(words) - 1}; _validate 2> /dev/null"
    code = f"{script('bash')}\n{asked}; printf '%s\\n' \"${{COMPREPLY[@]}}\""
    found = subprocess.run(["bash", "-c", code], capture_output=True, encoding="utf-8", check=True)
    return set(found.stdout.splitlines()) - {""}


@pytest.mark.needs("bash")
@pytest.mark.parametrize("line", ASKED)
def test_bash_completes(line):
    assert bash(line) - {"--help", "--version"} == ASKED[line]


@pytest.mark.needs("bash")
def test_files_are_offered_where_they_fit():
    subprocess.run(["touch", "mine.toml"], check=True)
    assert "mine.toml" in bash("validate sink m")
    assert "mine.toml" in bash("validate sink --against m")
    assert "mine.toml" not in bash("validate sink --only m")
    subprocess.run(["touch", "my own scene.toml"], check=True)
    assert {"my own scene.toml", "mine.toml"} <= bash("validate solve m")


@pytest.mark.needs("zsh")
def test_the_script_is_the_shells_language():
    found = subprocess.run(["zsh", "-n"], input=script("zsh"), capture_output=True, encoding="utf-8", check=False)
    assert (found.returncode, found.stderr) == (0, "")


pty = pytest.importorskip("pty", reason="terminals as Unix has them")
fcntl, termios = pytest.importorskip("fcntl"), pytest.importorskip("termios")


@contextmanager
def on_a_terminal(columns: int) -> Iterator[int]:
    """Standard output and errors on a terminal of so many columns: the full text can be read."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    with os.fdopen(theirs, "w", encoding="utf-8") as stream, redirect_stderr(stream), redirect_stdout(stream):
        yield ours
    os.close(ours)


def test_a_terminal_shows_the_step_and_its_time_on_one_line(monkeypatch):
    """One that the terminal breaks could not be cleared; in the end the line is wiped off."""
    monkeypatch.setattr(terminal, "_SLOW", 0.1)
    with on_a_terminal(20) as ours:
        with terminal.progress() as say:
            say("solving in 3D on level 4 with 123456 unknowns")
            time.sleep(0.6)
        said = ""
        while select([ours], [], [], 0.2)[0]:
            said += os.read(ours, 4096).decode()
    lines = [part.strip("\r") for part in said.split("\x1b[K")]
    assert any("solving in 3D" in line for line in lines)
    assert any("(1 s)" in line for line in lines)
    assert max(map(len, lines)) <= 20
    assert said.endswith("\r\x1b[K")


@pytest.mark.parametrize(("quiet", "seconds", "lines"), [(False, 0.6, 2), (False, 0.05, 0), (True, 0.3, 0)])
def test_a_pipe_gets_whole_lines_every_now_and_then(quiet, seconds, lines, monkeypatch, capsys):
    """For a log: none for short steps, and none if quiet."""
    monkeypatch.setattr(terminal, "_SLOW", 0.1)
    monkeypatch.setattr(terminal, "_EVERY", 0.25)
    with terminal.progress(quiet=quiet) as say:
        say("solving in 3D")
        time.sleep(seconds)
    said = capsys.readouterr().err.splitlines()
    assert (len(said), said[:1]) == (lines, ["solving in 3D (0 s)"] * bool(lines))


def test_sentences_are_broken_where_the_terminal_ends():
    with on_a_terminal(20):
        lines = wrapped("The 3D model has its peak 20.33 K and its ends 4.405 K above room.").splitlines()
    assert max(map(len, lines)) <= 20
    assert any("20.33 K" in line for line in lines)
