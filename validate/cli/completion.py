"""Print a script with which a shell completes commands, options, their values and scene keys.

to use it:
  eval "$(validate completion bash)"          in ~/.bashrc
  eval "$(validate completion zsh)"           in ~/.zshrc, after compinit
  validate completion fish | source           in ~/.config/fish/config.fish
"""

from __future__ import annotations

import argparse
import re
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from reduced1d.ladder import REDUCTIONS
from scenes.checks import DEFAULT_TOLERANCES
from scenes.errors import SceneError
from scenes.keys import TYPES
from scenes.loading import examples, known_names
from validate.cli.arguments import COMMANDS
from validate.cli.common import add
from validate.cli.terminal import FINE, show

OPTIONS = {
    "shell {bash,zsh,fish,keys}": "the shell; or keys, which prints those of a scene, as the scripts ask for them",
    "[scene SCENE.toml]": "of keys: the scene",
}
OF_A_SCENE = "--set --vary --uncertain --calibrate"
"""The options that are followed by keys of a scene."""


def run(arguments: argparse.Namespace) -> int:
    if (arguments.shell == "keys") != (arguments.scene is not None):
        raise SceneError("keys are of a scene, and scripts are not: give validate completion keys SCENE.toml")
    show("\n".join(keys(arguments.scene)) if arguments.scene else script(arguments.shell))
    return FINE


def keys(source: str) -> list[str]:
    """The keys of a scene that may be overridden; of each of its boxes, boundaries and so on all that it may have,
    places by coordinate. Raises SceneError for what can't be read."""
    from scenes.condition_kinds import Surroundings
    from scenes.free import schema_of
    from scenes.kinds import Place
    from scenes.loading import document, type_of_file
    from scenes.schema import label_of

    given, _, _ = document(source, known_names())
    kind = type_of_file(given)
    if kind:
        return list(kind.schema.paths)
    schema = schema_of(given)
    paths = [*schema.paths, *(f"parameters.{name}" for name in given.get("parameters", ()))]
    for table, allowed in schema.lists.items():
        for number, item in enumerate(given.get(table, ()), 1):
            for key, form in allowed.items():
                ends = "xyz" if isinstance(form, Place) else form.names if isinstance(form, Surroundings) else ()
                name = f"{table}.{label_of(table, number, item)[0]}.{key}"
                paths += [f"{name}.{end}" for end in ends] or [name] * (key != "name")
    return paths


def script(shell: str) -> str:
    before = "autoload -U +X bashcompinit && bashcompinit\n" if shell == "zsh" else ""
    return _fish() if shell == "fish" else before + _bash()


class _Option(NamedTuple):
    """An option with its help, the words that may follow it, and whether a value or file may."""

    name: str
    help: str
    words: list[str]
    takes_value: bool


def _words(command: str) -> tuple[list[str], list[_Option]]:
    """The words that may stand without an option, files besides; and the options."""
    parser = argparse.ArgumentParser()
    add(parser, import_module(f"validate.cli.{command}").OPTIONS)
    # Most designs that are swept are of the sink.
    kind = TYPES.get("sink" if command in ("sweep", "map") else command)
    keys = kind.schema.paths if kind else {}
    assignments, varied = [f"{path}=" for path in keys], [f"{path}=" for path, key in keys.items() if key.physical]
    by_option = {
        "--set": assignments,
        "--vary": varied,
        "--uncertain": ["materials", *varied] if keys else [],
        "--calibrate": [path.rstrip("=") for path in varied],
        "--reduction": list(REDUCTIONS),
        "--check": [*DEFAULT_TOLERANCES],
    }
    words: list[str] = []
    options: list[_Option] = []
    for action in parser._actions:
        choices = [str(choice) for choice in action.choices or ()]
        if action.option_strings:
            name = action.option_strings[-1]
            options.append(_Option(name, action.help or "", choices or by_option.get(name, []), action.nargs != 0))
        elif choices or not ("SCENE" in str(action.metavar) or command == "scene"):
            words += choices
        else:
            # The scenes that may be named in place of a file.
            words += [command] if command in TYPES else known_names()
    return words, options


def _bash() -> str:
    after = cases = ""
    for command in COMMANDS:
        words, options = _words(command)
        for option in options:
            if option.words:
                after += f'    {command}:{option.name}) words="{" ".join(option.words)}"; files=0 ;;\n'
        plain = [f"{command}:{option.name}" for option in options if option.takes_value and not option.words]
        if plain:
            after += f"    {'|'.join(plain)}) ;;\n"
        cases += f'        {command}) words="{" ".join([*words, *(option.name for option in options)])}" ;;\n'
    text = Path(__file__).with_suffix(".bash").read_text(encoding="utf-8").rstrip("\n")
    marks = {
        "commands": " ".join(COMMANDS), "after": after, "cases": cases, "examples": "|".join(examples()),
        "of_a_scene": OF_A_SCENE.replace(" ", "|"),
    }  # fmt: skip
    return re.sub("@(" + "|".join(marks) + ")", lambda mark: marks[mark[1]], text)


def _fish() -> str:
    lines = [
        "function _validate_keys",
        "  set -l scene (commandline -opc | string match -r '.*\\.toml$')",
        '  test -n "$scene[1]" && validate completion keys $scene[1] 2> /dev/null',
        "end",
    ]
    for command, said in COMMANDS.items():
        words, options = _words(command)
        lines.append(f"complete -c validate -n __fish_use_subcommand -f -a {command} -d {_quoted(said)}")
        seen = f"complete -c validate -n '__fish_seen_subcommand_from {command}'"
        if words:
            lines.append(f"{seen} -a {_quoted(' '.join(words))}")
        for option in options:
            if option.name in OF_A_SCENE.split():
                lines.append(f"{seen} -l {option.name.removeprefix('--')} -x -a '(_validate_keys)'")
            end = f" -x -a {_quoted(' '.join(option.words))}" if option.words else " -r" if option.takes_value else ""
            lines.append(f"{seen} -l {option.name.removeprefix('--')} -d {_quoted(option.help)}{end}")
    return "\n".join(lines)


def _quoted(text: str) -> str:
    return "'" + text.replace("%%", "%").replace("\\", "\\\\").replace("'", "\\'") + "'"
