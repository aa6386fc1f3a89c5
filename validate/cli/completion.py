"""`validate completion`: what a shell needs to complete the command's words."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module

from reduced1d.ladder import REDUCTIONS
from scenes.keys import TYPES
from scenes.loading import known_names
from validate.cli.arguments import COMMANDS
from validate.cli.terminal import FINE, show

_HOW = {
    "bash": 'eval "$(validate completion bash)"          in ~/.bashrc',
    "zsh": 'eval "$(validate completion zsh)"           in ~/.zshrc, after compinit',
    "fish": "validate completion fish | source           in ~/.config/fish/config.fish",
}


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.description = "Print a script with which a shell completes commands, options, their values and scene keys."
    parser.epilog = "to use it:\n" + "\n".join(f"  {line}" for line in _HOW.values())
    parser.add_argument("shell", choices=tuple(_HOW), help="the shell")


def run(arguments: argparse.Namespace) -> int:
    """Prints the script."""
    show(script(arguments.shell))
    return FINE


@dataclass(frozen=True)
class Option:
    """An option with its help, the words that may follow it, and whether a value or file may."""

    name: str
    help: str
    words: tuple[str, ...]
    takes_value: bool


@dataclass(frozen=True)
class Command:
    """A command with its help, options, and the words that may stand without one; files may besides."""

    name: str
    help: str
    options: tuple[Option, ...]
    words: tuple[str, ...]


def script(shell: str) -> str:
    """The script for "bash", "zsh" or "fish"."""
    return {"bash": _bash, "zsh": _zsh, "fish": _fish}[shell](_commands())


def _commands() -> tuple[Command, ...]:
    found = []
    for name, text in COMMANDS.items():
        parser = argparse.ArgumentParser(prog=name, add_help=True)
        import_module(f"validate.cli.{name}").describe(parser)
        options: list[Option] = []
        words: list[str] = []
        for action in parser._actions:
            choices = tuple(str(c) for c in action.choices or ())
            if not action.option_strings:
                words += choices or (_scenes(name) if "SCENE" in str(action.metavar) or name == "scene" else ())
                continue
            known = {"--set": _keys(name), "--reduction": tuple(REDUCTIONS)}.get(action.option_strings[-1], ())
            options += [
                Option(o, action.help or "", choices or known, action.nargs != 0)
                for o in action.option_strings
                if o.startswith("--")
            ]
        found.append(Command(name, text, tuple(options), tuple(words)))
    return tuple(found)


def _keys(command: str) -> tuple[str, ...]:
    """The keys that --set takes, with the sign that follows."""
    kind: Mapping[str, object] = TYPES[command].schema.paths if command in TYPES else {}
    return tuple(f"{path}=" for path in kind)


def _scenes(command: str) -> tuple[str, ...]:
    """The scenes that may be named in place of a file."""
    return (command,) if command in TYPES else tuple(known_names())


_BASH = """_validate() {{
  local cur="${{COMP_WORDS[COMP_CWORD]}}" prev="${{COMP_WORDS[COMP_CWORD-1]}}" words="" files=1
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "{commands} --help --version" -- "$cur"))
    return
  fi
  case "${{COMP_WORDS[1]}}:$prev" in
{after}    *)
      case "${{COMP_WORDS[1]}}" in
{own}      esac ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$cur"))
  case "${{COMPREPLY[0]}}" in *=) type compopt > /dev/null 2>&1 && compopt -o nospace ;; esac
  case "$cur" in
    -*) ;;
    *) [ "$files" -eq 1 ] && COMPREPLY+=($(compgen -f -- "$cur")) ;;
  esac
}}
complete -o filenames -F _validate validate"""


def _bash(commands: tuple[Command, ...]) -> str:
    after, own = [], []
    for command in commands:
        for option in command.options:
            if option.words:
                after.append(f'    {command.name}:{option.name}) words="{" ".join(option.words)}"; files=0 ;;\n')
        plain = [o.name for o in command.options if o.takes_value and not o.words]
        if plain:
            after.append(f"    {'|'.join(f'{command.name}:{name}' for name in plain)}) ;;\n")
        words = " ".join([*command.words, *(o.name for o in command.options)])
        own.append(f'        {command.name}) words="{words}" ;;\n')
    names = " ".join(command.name for command in commands)
    return _BASH.format(commands=names, after="".join(after), own="".join(own))


def _zsh(commands: tuple[Command, ...]) -> str:
    return f"autoload -U +X bashcompinit && bashcompinit\n{_bash(commands)}"


def _fish(commands: tuple[Command, ...]) -> str:
    lines = []
    for command in commands:
        lines.append(f"complete -c validate -n __fish_use_subcommand -f -a {command.name} -d {_quoted(command.help)}")
        seen = f"-n '__fish_seen_subcommand_from {command.name}'"
        if command.words:
            lines.append(f"complete -c validate {seen} -a {_quoted(' '.join(command.words))}")
        for option in command.options:
            line = f"complete -c validate {seen} -l {option.name.removeprefix('--')} -d {_quoted(option.help)}"
            if option.words:
                line += f" -x -a {_quoted(' '.join(option.words))}"
            elif option.takes_value:
                line += " -r"
            lines.append(line)
    return "\n".join(lines)


def _quoted(text: str) -> str:
    return "'" + text.replace("%%", "%").replace("\\", "\\\\").replace("'", "\\'") + "'"
