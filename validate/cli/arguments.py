"""The arguments of the `validate` command."""

from __future__ import annotations

import argparse
import re
import shlex
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any, NoReturn

from scenes.errors import SceneError, did_you_mean, printable
from validate.cli.common import add
from validate.cli.terminal import show

COMMANDS = {
    "sink": "compare the 1D model of the active sink with 3D",
    "device": "simulate the whole sensor in 1D and check what the paper says of it",
    "solve": "solve any scene of boxes, or on a mesh file, in 3D",
    "sweep": "compare at many designs: keys that vary, on a grid or sampled, on one machine or a cluster",
    "map": "find the line over two keys on which the 1D model leaves a tolerance",
    "view": "look at the 3D fields of a run, or write pictures and films of them",
    "verify": "verify the code: orders, exact solutions, benchmarks, a second path",
    "stress": "test numerical stability and robustness",
    "bench": "run time against error, beside other programs",
    "scene": "print a built-in scene as TOML",
    "completion": "print what a shell needs to complete this command",
}
"""The commands, one file each: its docstring is the text of its help, `OPTIONS` has its arguments, as
`common.add` reads them, and `run` does the work. Only the module of the command that is asked for gets imported."""


class _Parser(argparse.ArgumentParser):
    """A parser whose complaints are one sentence, raised as SceneError."""

    def error(self, message: str) -> NoReturn:
        raise SceneError(f"{printable(message, 300)} (see {self.prog} --help)")


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """The arguments as ``command`` and its options; raises SceneError for any that are wrong."""
    joined: list[str] = []
    for argument in argv:
        # argparse takes a word with a dash that is no number, such as -1K, for an option.
        if joined and re.fullmatch(r"--[\w-]+", joined[-1]) and re.match(r"-[\d.]", argument):
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    name = next((argument for argument in joined if not argument.startswith("-")), None)
    parser, commands = _parsers(name)
    if name is None and not {"-h", "--help", "--version"} & set(joined):
        parser.error(f"no command is given: give {' or '.join(commands)}")
    if name is not None and name not in commands:
        choices = f"give {' or '.join(commands)}{did_you_mean(name, commands)}"
        parser.error(f'"{printable(name)}" is not a command: {choices}')
    arguments, unknown = parser.parse_known_args(joined)
    if arguments.version:
        from validate.report.summary import version

        show(f"validate {version()}")
        parser.exit()
    if unknown:
        subparser, argument = commands[arguments.command], unknown[0]
        if not argument.startswith("-"):
            subparser.error(f'"{printable(argument)}" is one argument too many')
        options = [option for option in subparser._option_string_actions if option.startswith("--")]
        subparser.error(f'unknown option "{printable(argument)}"{did_you_mean(argument.partition("=")[0], options)}')
    for name in ("model", "reduction"):
        # As a shell leaves it of a variable that is not set.
        if getattr(arguments, name, None) == "":
            commands[arguments.command].error(f'--{name} "" names no model: give one, or leave the option out')
    # Bytes that the system could not decode, as in a file name of another encoding, are spelled out.
    command_line = shlex.join(["validate", *argv]).encode("utf-8", "surrogateescape")
    arguments.command_line = command_line.decode("utf-8", "backslashreplace")
    return arguments


def _parsers(chosen: str | None) -> tuple[argparse.ArgumentParser, Mapping[str, argparse.ArgumentParser]]:
    """Return the parser and the parsers of the commands; only the chosen command gets its options."""
    parser = _Parser(
        prog="validate", allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="How far to trust a 1D model of a heated microstructure: the same scene in 3D, with errors.",
        epilog="example:\n  validate sink --voltage 1   the paper's active sink at 1 V, equation by equation\n"
        "  validate device             the whole sensor in 1D, what the paper says of it\n"
        "  validate solve mine.toml    any structure of boxes in 3D (validate scene bridge > mine.toml)\n\n"
        "exit status: 0 every check came out as the scene declares, 1 one did not, 2 bad input, 3 the numerics failed",
    )  # fmt: skip
    parser.add_argument("--version", action="store_true", help="print the version and leave")
    adder = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=_Parser)
    look: dict[str, Any] = {"allow_abbrev": False, "formatter_class": argparse.RawDescriptionHelpFormatter}
    commands = {name: adder.add_parser(name, help=said, **look) for name, said in COMMANDS.items()}
    if chosen in commands:
        module = import_module(f"validate.cli.{chosen}")
        commands[chosen].description, _, commands[chosen].epilog = (module.__doc__ or "").partition("\n\n")
        add(commands[chosen], module.OPTIONS)
    return parser, commands
