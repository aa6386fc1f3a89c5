"""The terminal: completion scripts, run by the shells where they are installed, progress, and lines that are longer
than the terminal is wide."""

import os
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from compare.report.table import wrapped
from validate.cli.arguments import COMMANDS
from validate.cli.completion import script
from validate.cli.terminal import progress

ASKED = {
    "validate ": set(COMMANDS),
    "validate si": {"sink"},
    "validate sink --vol": {"--voltage"},
    "validate sink --only ": {"3d", "1d"},
    "validate sink --reduction ": {"paper", "anchored", "fin-massless", "fin", "plate", "moments"},
    "validate sink --reduction pl": {"plate"},
    "validate sink --set sink.wid": {"sink.width="},
    "validate device --set control.samp": {"control.sample_time="},
    "validate sweep sink --vary sink.wid": {"sink.width="},
    "validate map sink --vary drive.v": {"drive.voltage="},
    "validate sweep sink --check fig6": {"fig6_peak", "fig6_end"},
    "validate sink --uncertain materials.oxide.den": {"materials.oxide.density="},
    "validate sink --calibrate anchor.oxide_l": {"anchor.oxide_length"},
    "validate device --uncertain device.pol": {"device.polymer_thickness="},
    "validate view --sho": {"--show"},
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


ROOT = Path(__file__).parents[3]
CODE = """
import sys, time
from validate.cli import terminal
terminal._SLOW, terminal._EVERY = 0.1, 0.25
with terminal.progress(quiet={quiet}) as say:
    say("solving in 3D")
    time.sleep({seconds})
print("done")
"""


def command(quiet: bool, seconds: float) -> list[str]:
    return [sys.executable, "-c", CODE.format(quiet=quiet, seconds=seconds)]


def on_a_terminal(quiet: bool, seconds: float) -> str:
    """Return the output on standard error, which is a terminal."""
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


def test_a_terminal_is_told_what_and_for_how_long():
    said = on_a_terminal(False, 0.8)
    assert "solving in 3D" in said
    assert "(1 s)" in said
    # It is wiped off in the end.
    assert said.endswith("\r\x1b[K")


def test_quiet_is_quiet():
    assert on_a_terminal(True, 0.1) == ""


def in_a_pipe(quiet: bool, seconds: float) -> str:
    return subprocess.run(command(quiet, seconds), capture_output=True, encoding="utf-8", cwd=ROOT, check=True).stderr


def test_a_pipe_is_told_every_now_and_then():
    """Whole lines, for a log: none for short steps, and none if quiet."""
    lines = in_a_pipe(False, 0.6).splitlines()
    assert lines[0] == "solving in 3D (0 s)"
    assert len(lines) == 2
    assert in_a_pipe(False, 0.05) == ""
    assert in_a_pipe(True, 0.3) == ""


pty = pytest.importorskip("pty", reason="terminals as Unix has them")
fcntl, termios = pytest.importorskip("fcntl"), pytest.importorskip("termios")


@contextmanager
def narrow() -> Iterator[int]:
    """Standard output and errors on a terminal of 20 columns: the full text can be read."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 20, 0, 0))
    with os.fdopen(theirs, "w", encoding="utf-8") as stream, redirect_stderr(stream), redirect_stdout(stream):
        yield ours
    os.close(ours)


def test_progress_stays_on_its_line():
    """One that the terminal breaks could not be cleared."""
    with narrow() as terminal:
        with progress() as say:
            say("solving in 3D on level 4 with 123456 unknowns")
        said = os.read(terminal, 1000).decode().split("\x1b[K")
    assert any("solving in 3D" in part for part in said)
    assert max(map(len, said)) <= 20


def test_sentences_are_broken_where_the_terminal_ends():
    with narrow():
        lines = wrapped("The 3D model has its peak 20.33 K and its ends 4.405 K above room.").splitlines()
    assert max(map(len, lines)) <= 20
    assert any("20.33 K" in line for line in lines)
