"""What the `validate` command takes."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from typing import NoReturn

from scenes.errors import SceneError, nearest, printable

_ACCURACY = "1e-3"


class _Parser(argparse.ArgumentParser):
    """A parser whose complaints are one sentence, raised as SceneError."""

    def error(self, message: str) -> NoReturn:
        raise SceneError(f"{printable(message, 300)} (see {self.prog} --help)")


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """The arguments as ``command`` and its options; raises SceneError for any that are wrong."""
    parser, commands = _parsers()
    joined = _join_negative(argv)
    name = next((argument for argument in joined if not argument.startswith("-")), None)
    if name is None and not {"-h", "--help", "--version"} & set(joined):
        parser.error(f"no command is given: give {' or '.join(commands)}")
    if name is not None and name not in commands:
        near = nearest(name, commands)
        hint = f', did you mean "{near}"?' if near else ""
        parser.error(f'"{printable(name)}" is not a command: give {" or ".join(commands)}{hint}')
    found, unknown = parser.parse_known_args(joined)
    if unknown:
        _refuse(commands[found.command], unknown[0])
    return found


def _refuse(parser: argparse.ArgumentParser, argument: str) -> NoReturn:
    if not argument.startswith("-"):
        parser.error(f'"{printable(argument)}" is one argument too many')
    options = [option for option in parser._option_string_actions if option.startswith("--")]
    near = nearest(argument.partition("=")[0], options)
    hint = f', did you mean "{near}"?' if near else ""
    parser.error(f'unknown option "{printable(argument)}"{hint}')


def _join_negative(argv: Sequence[str]) -> list[str]:
    """With "--voltage -2V" as "--voltage=-2V": argparse takes what has a dash and is no number for an option."""
    joined: list[str] = []
    for argument in argv:
        if joined and joined[-1] in ("--voltage", "--accuracy") and re.match(r"-[\d.]", argument):
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from compare.summary import version

        parser.exit(0, f"validate {version()}\n")


def _parsers() -> tuple[argparse.ArgumentParser, dict[str, argparse.ArgumentParser]]:
    parser = _Parser(
        prog="validate", allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="How far to trust a 1D model of a heated microstructure: the same scene in 3D, with error bounds.",
        epilog="example:\n  validate sink --voltage 1   the paper's active sink at 1 V, equation by equation\n"
        "  validate device             the whole sensor in 1D, what the paper says of it\n\n"
        "exit status: 0 every check came out as the scene declares, 1 one did not, 2 bad input, 3 the numerics failed",
    )  # fmt: skip
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and leave")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=_Parser)
    return parser, {"sink": _sink(commands), "device": _device(commands), "scene": _scene(commands)}


def _sink(commands: argparse._SubParsersAction) -> argparse.ArgumentParser:
    sink: argparse.ArgumentParser = commands.add_parser(
        "sink", allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter,
        help="compare the 1D model of the active sink with 3D",
        description="Solve the paper's active sink in 3D and with its 1D reduction, and say how far they agree:\n"
        "a verdict for equations 12 to 18 and Figures 4 to 7, with the estimated numerical error.",
        epilog="examples:\n"
        "  validate sink --voltage 1\n"
        "  validate sink --voltage 2V --set sink.width=20um --set drive.electrodes=pad-edge\n"
        "  validate scene sink > mine.toml; validate sink mine.toml --accuracy 1e-4 --strict\n\n"
        "results: summary.json, traces.csv and figures in results/<scene>-<what distinguishes it>/\n"
        "exit status: 0 every check came out as the scene declares, 1 one did not, 2 bad input, 3 the numerics failed",
    )  # fmt: skip
    add = sink.add_argument
    _common(
        sink, "sink", "sink.width=20um", f"relative accuracy of the 3D solution (default {_ACCURACY} or the scene's)"
    )
    add("--voltage", metavar="V", help='voltage across the electrodes: 1, 2V or "500 mV"; for --set drive.voltage=V')
    add("--steady", action="store_true", help="the steady state only, no transient")
    add("--only", choices=("3d", "1d"), help="one model only")
    add("--fields", action="store_true", help="write the 3D temperature fields (fem3d.pvd with .vtu files)")
    return sink


def _device(commands: argparse._SubParsersAction) -> argparse.ArgumentParser:
    device: argparse.ArgumentParser = commands.add_parser(
        "device", allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter,
        help="simulate the whole sensor in 1D and check what the paper says of it",
        description="Simulate the paper's whole sensor in 1D, sink, insulator, sensor, polymer and their controllers,\n"
        "and say what of Figures 9 to 13 comes out; with the limits of gains, range and resolution.",
        epilog="examples:\n"
        "  validate device\n"
        "  validate device --figure 11 --set control.sample_time=2ms\n"
        "  validate device --scheme paper --figure 9\n"
        "  validate device --max-power 20mW --meter PXI-4070\n\n"
        "results: summary.json, traces.csv and figures in results/<scene>-<what distinguishes it>/\n"
        "exit status: 0 every check came out as the scene declares, 1 one did not, 2 bad input, 3 the numerics failed",
    )  # fmt: skip
    add = device.add_argument
    _common(device, "device", "control.sample_time=1ms", "accuracy of the temperatures, relative to the set rise")
    add("--figure", action="append", default=[], choices=("9", "10", "11", "12", "13"), dest="about",
        help="this figure and its checks only, as often as needed")  # fmt: skip
    add("--scheme", choices=("accurate", "paper"), default="accurate",
        help="the accurate scheme (default), or the paper's own and how far it is off")  # fmt: skip
    add("--meter", choices=("PXI-4070", "MAX1367"), help="round the resistances to what a meter resolves")
    add("--max-voltage", metavar="V", help="the sensor's largest voltage, for the range: 100mV")
    add("--max-power", metavar="W", help="the sensor's largest power, for the range: 20mW")
    return device


def _common(parser: argparse.ArgumentParser, scene: str, example: str, accuracy: str) -> None:
    """What the commands that solve a scene have in common."""
    add = parser.add_argument
    add("scene", nargs="?", default=scene, metavar="SCENE.toml",
        help=f'a scene file (default: the built-in "{scene}")')  # fmt: skip
    add("--set", action="append", default=[], metavar="KEY=VALUE", dest="settings",
        help=f"override a key of the scene, as often as needed: {example}")  # fmt: skip
    add("--accuracy", metavar="A", help=accuracy)
    add("--out", metavar="DIR", help="the results folder; a run that is there is replaced")
    add("--no-figures", action="store_false", dest="figures", help="no figures")
    add("--explain", action="store_true", help="print first what will be solved and what is skipped, and why")
    add("--strict", action="store_true",
        help="exit with 1 for any check not as declared (undeclared: expected to agree), or unresolved")  # fmt: skip
    add("--quiet", action="store_true", help="print the verdict only, one line")
    add("--json", action="store_true", help="print summary.json in place of the tables")


def _scene(commands: argparse._SubParsersAction) -> argparse.ArgumentParser:
    scene: argparse.ArgumentParser = commands.add_parser(
        "scene", allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter,
        help="print a built-in scene as TOML",
        description="Print a built-in scene as commented TOML, to copy and edit.",
        epilog="example:\n  validate scene sink > mine.toml",
    )  # fmt: skip
    scene.add_argument("name", metavar="NAME", help="the scene: sink or device")
    return scene
