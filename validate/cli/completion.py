"""Print a script with which a shell completes commands, options and their values.

to use it:
  eval "$(validate completion bash)"          in ~/.bashrc
  eval "$(validate completion zsh)"           in ~/.zshrc, after compinit
"""

from __future__ import annotations

import argparse
import re
from importlib import import_module
from pathlib import Path

from reduced1d.ladder import REDUCTIONS
from scenes.checks import DEFAULT_TOLERANCES
from scenes.keys import TYPES
from scenes.loading import known_names
from validate.cli.arguments import COMMANDS
from validate.cli.common import add
from validate.cli.terminal import FINE, show

OPTIONS = {"shell {bash,zsh}": "the shell"}


def run(arguments: argparse.Namespace) -> int:
    show(script(arguments.shell))
    return FINE


def script(shell: str) -> str:
    """Return the completion script; zsh reads bash's through bashcompinit."""
    after = cases = ""
    for command in COMMANDS:
        words, values = completions(command)
        takes_any = [f"{command}:{option}" for option, choices in values.items() if choices == []]
        for option, choices in values.items():
            after += f'    {command}:{option}) words="{" ".join(choices)}"; files=0 ;;\n' if choices else ""
        after += f"    {'|'.join(takes_any)}) ;;\n" if takes_any else ""
        cases += f'        {command}) words="{" ".join([*words, *values])}" ;;\n'
    text = Path(__file__).with_suffix(".bash").read_text(encoding="utf-8").rstrip("\n")
    marks = {"commands": " ".join(COMMANDS), "after": after, "cases": cases}
    text = re.sub("@(" + "|".join(marks) + ")", lambda mark: marks[mark[1]], text)
    return f"autoload -U +X bashcompinit && bashcompinit\n{text}" if shell == "zsh" else text


def completions(command: str) -> tuple[list[str], dict[str, list[str] | None]]:
    """The words that a command takes without an option; by option its values: [] for any text, None for a switch."""
    parser = argparse.ArgumentParser()
    add(parser, import_module(f"validate.cli.{command}").OPTIONS)
    # Most designs that are swept are of the sink.
    kind = TYPES.get("sink" if command in ("sweep", "map") else command)
    keys = kind.schema.paths if kind else {}
    physical = [path for path, key in keys.items() if key.physical]
    known = {
        "--set": [f"{path}=" for path in keys],
        "--vary": [f"{path}=" for path in physical],
        "--uncertain": ["materials", *(f"{path}=" for path in physical)] if keys else [],
        "--calibrate": physical,
        "--reduction": list(REDUCTIONS),
        "--check": [*DEFAULT_TOLERANCES],
    }
    words: list[str] = []
    values: dict[str, list[str] | None] = {}
    for action in parser._actions:
        choices = [str(choice) for choice in action.choices or ()]
        if action.option_strings:
            name = action.option_strings[-1]
            values[name] = None if action.nargs == 0 else choices or known.get(name, [])
        elif choices or not ("SCENE" in str(action.metavar) or command == "scene"):
            words += choices
        else:
            words += [command] if command in TYPES else known_names()
    return words, values
