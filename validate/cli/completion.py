"""`validate completion`: what a shell needs to complete the command's words."""

from __future__ import annotations

import argparse

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
    from validate.cli import shells

    show(shells.script(arguments.shell))
    return FINE
