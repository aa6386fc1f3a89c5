"""Terminals that are narrower than a line."""

import io
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout

import pytest

from compare.report.table import wrapped
from scenes.errors import columns
from validate.cli.terminal import progress

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


def test_elsewhere_a_line_has_80_columns(capsys):
    assert columns(io.StringIO(), 80) == 80
    assert 60 < max(map(len, wrapped("word " * 100).splitlines())) <= 80
