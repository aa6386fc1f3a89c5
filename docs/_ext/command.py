"""A directive that runs a command of this project and shows what it prints, so that no number on a page is typed.

    ```{command} validate sink --voltage 1
    :from: check
    :until: Why
    ```

shows it from the first line that has "check" in it to the one before "Why"; a word that is not there is a warning too.

The commands of one page run one after the other in one folder, which is gone afterwards. A command that ends with
another status than ``:status:`` (0 by default) is a warning, and so an error of a strict build. Where a program that
it ``:needs:`` is not installed the command alone is shown.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[2]
PATIENCE = 300
_folders: dict[str, tempfile.TemporaryDirectory[str]] = {}


class Command(SphinxDirective):
    """The directive."""

    required_arguments = 1
    final_argument_whitespace = True
    option_spec = {  # noqa: RUF012
        "from": directives.unchanged,
        "until": directives.unchanged,
        "status": directives.nonnegative_int,
        "hide-command": directives.flag,
        "needs": directives.unchanged,
    }

    def run(self) -> list[nodes.Node]:
        """The command and what it printed, as one block."""
        shown = self.arguments[0]
        folder = _folders.setdefault(self.env.docname, tempfile.TemporaryDirectory())
        words = shlex.split(shown)
        command = {"validate": [sys.executable, "-m", "validate"], "python": [sys.executable]}[words[0]]
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        env = {**os.environ, "PYTHONPATH": path, "PYTHONIOENCODING": "utf-8"}
        if "needs" in self.options and shutil.which(self.options["needs"]) is None:
            return [nodes.literal_block(shown, f"$ {shown}", language="text")]
        words = [str(ROOT / word) if word.startswith("examples/") else word for word in words[1:]]
        process = subprocess.run(
            [*command, *words],
            cwd=folder.name,
            env=env,
            capture_output=True,
            encoding="utf-8",
            timeout=PATIENCE,
            check=False,
        )
        if process.returncode != self.options.get("status", 0):
            logging.getLogger(__name__).warning(
                "%s ended with %d: %s", shown, process.returncode, process.stderr.strip(), location=self.get_location()
            )
        lines = (process.stdout or process.stderr).rstrip().splitlines()
        first = self._line(lines, "from", 0, shown)
        last = self._line(lines, "until", first + 1, shown) or len(lines)
        lines = "\n".join(lines[first:last]).rstrip().splitlines()
        text = "\n".join(lines)
        if "hide-command" not in self.options:
            text = f"$ {shown}\n{text}"
        block = nodes.literal_block(text, text, language="text")
        return [block]

    def _line(self, lines: list[str], option: str, start: int, shown: str) -> int:
        """The number of the first line from ``start`` on that has an option's text; 0 where none is asked for."""
        if option not in self.options:
            return 0
        text = self.options[option]
        number = next((k for k in range(start, len(lines)) if text in lines[k]), None)
        if number is None:
            logging.getLogger(__name__).warning("%s prints no %r", shown, text, location=self.get_location())
        return number or 0


def setup(app: Any) -> dict[str, Any]:
    """Registers the directive; a page's folder goes with the build."""
    app.add_directive("command", Command)

    def clean(*_: object) -> None:
        for folder in _folders.values():
            folder.cleanup()
        _folders.clear()

    app.connect("build-finished", clean)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
