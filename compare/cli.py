"""The `validate` command: arguments in, text and an exit status out. Nothing heavy is imported until it is needed."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from scenes.errors import SceneError, printable

if TYPE_CHECKING:
    import argparse
    from pathlib import Path

    from compare.device.scope import DeviceRequest
    from compare.table import Style
    from scenes.device import Device
    from scenes.plan import Request, Step
    from scenes.sink import Sink

FINE, DIFFERS, BAD_INPUT, NUMERICS, INTERRUPTED = 0, 1, 2, 3, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status: 0 fine, 1 a check came out other than declared, 2 bad input, 3 the
    numerics failed, 130 interrupted. What goes wrong is one sentence on standard error."""
    try:
        from compare.arguments import parse

        arguments = parse(sys.argv[1:] if argv is None else argv)
        return {"sink": _sink, "device": _device, "scene": _scene}[arguments.command](arguments)
    except SystemExit as leaving:  # argparse, after --help or --version
        return int(leaving.code or 0)
    except KeyboardInterrupt:
        return _complain("interrupted; earlier results are as they were", INTERRUPTED)
    except SceneError as error:
        return _complain(str(error), BAD_INPUT)
    except OSError as error:
        return _complain(f"a file could not be read or written: {error}", BAD_INPUT)
    except ArithmeticError as error:
        return _complain(str(error), NUMERICS)
    except MemoryError:
        return _complain("out of memory: ask for a larger accuracy", NUMERICS)
    except Exception as error:
        if sys.flags.dev_mode:
            raise
        return _complain(
            f"a fault of this program, {type(error).__name__}: {error} (python -X dev shows where)", NUMERICS
        )


def _scene(arguments: argparse.Namespace) -> int:
    from scenes.load import builtin_text

    _print(builtin_text(arguments.name).rstrip("\n"))
    return FINE


def _sink(arguments: argparse.Namespace) -> int:
    from scenes.load import load

    settings = _settings(arguments, ("drive.voltage", arguments.voltage))
    sink = load(arguments.scene, settings)
    request, out = _request(arguments), _out(arguments)

    from compare.run import run

    def plan() -> tuple[Step, ...]:
        from compare.plan import plan

        return plan(sink, request)

    planned = _explained(arguments, plan)
    with _Progress() as progress:
        outcome = run(sink, request, out, progress)

    from compare import table

    return _report(arguments, sink, outcome, table, planned)


def _device(arguments: argparse.Namespace) -> int:
    from dataclasses import replace

    from compare.device import scope
    from scenes.load import load
    from scenes.types import DEVICE

    device = load(arguments.scene, _settings(arguments), of=DEVICE)
    request, out = _device_request(arguments), _out(arguments)
    if request.meter:
        # The scene says nothing about a device with a meter in its loop.
        device = replace(device, expected_to_differ=None)

    from compare.device.run import run

    planned = _explained(arguments, lambda: scope.plan(device, request))
    with _Progress() as progress:
        outcome = run(device, request, out, progress)

    from compare.device import table

    return _report(arguments, device, outcome, table, planned)


def _settings(arguments: argparse.Namespace, *options: tuple[str, str | None]) -> list[str]:
    """The overrides, with the options that stand for some."""
    given = ((key, value) for key, value in (*options, ("run.accuracy", arguments.accuracy)) if value is not None)
    return [*arguments.settings, *(f"{key}={value}" for key, value in given)]


def _out(arguments: argparse.Namespace) -> Path | None:
    from pathlib import Path

    if arguments.out is not None and not arguments.out.strip():
        raise SceneError('--out "" names no folder: give one, such as results/mine')
    return Path(arguments.out) if arguments.out else None


def _explained(arguments: argparse.Namespace, plan: Callable[[], tuple[Step, ...]]) -> tuple[Step, ...] | None:
    """The plan, printed; ``None`` where that is not asked for."""
    if not arguments.explain or arguments.quiet or arguments.json:
        return None
    from compare import table

    planned = plan()
    _print(table.plan_text(planned, _style()) + "\n")
    return planned


def _report(
    arguments: argparse.Namespace, scene: Sink | Device, outcome: Any, table: Any, planned: tuple[Step, ...] | None
) -> int:
    """Prints what a run found, in the words of its kind's ``table`` module, and returns the exit status."""
    from compare.checks import contradicts

    contrary = [check for check in outcome.checks if contradicts(check, scene, arguments.strict)]
    if arguments.json:
        _print((outcome.folder / "summary.json").read_text(encoding="utf-8").rstrip("\n"))
    elif arguments.quiet:
        _print(table.headline(outcome, contrary, _style()))
    else:
        _print(table.outcome_text(outcome, contrary, _style(), planned))
    return DIFFERS if contrary else FINE


def _request(arguments: argparse.Namespace) -> Request:
    from scenes.plan import Request

    models: dict[str | None, Request] = {
        None: Request(),
        "3d": Request(models=("fem3d",)),
        "1d": Request(models=("reduced1d",)),
    }
    return Request(
        models[arguments.only].models,
        transient=not arguments.steady,
        figures=arguments.figures,
        fields=arguments.fields,
    )


def _device_request(arguments: argparse.Namespace) -> DeviceRequest:
    from compare.device.scope import FIGURES, DeviceRequest
    from scenes import dimensions
    from scenes.kinds import Quantity

    def most(option: str, given: str | None, dimension: dimensions.Dimension) -> float:
        value = None if given is None else Quantity(dimension, 1e-12, 1e6).read(option, given)
        return float("inf") if value is None else value

    return DeviceRequest(
        arguments.scheme,
        tuple(name for name in FIGURES if name.removeprefix("figure") in arguments.about),
        arguments.figures,
        arguments.meter,
        most("--max-voltage", arguments.max_voltage, dimensions.VOLTAGE),
        most("--max-power", arguments.max_power, dimensions.POWER),
    )


class _Progress:
    """Says on a terminal's last line what is being done, and clears it at the end; says nothing elsewhere."""

    def __enter__(self) -> Callable[[str], None]:
        self._shown = sys.stderr.isatty()
        return self._say if self._shown else lambda _: None

    def __exit__(self, *_: object) -> None:
        if self._shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def _say(self, text: str) -> None:
        print(f"\r\x1b[K{printable(text, 78)}", end="", file=sys.stderr, flush=True)


def _complain(sentence: str, status: int) -> int:
    with contextlib.suppress(OSError, ValueError):
        print(f"validate: {' '.join(sentence.split())}", file=sys.stderr)
    return status


def _print(text: str) -> None:
    """Prints, and doesn't mind a reader that has had enough (`| head`)."""
    try:
        print(text.encode(_encoding(), "replace").decode(_encoding()), flush=True)
    except BrokenPipeError:
        # Python flushes standard output once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _encoding() -> str:
    return sys.stdout.encoding or "utf-8"


def _style() -> Style:
    """As the terminal can show it: colours unless it is none or NO_COLOR is set, signs where its encoding has them."""
    from compare.table import Style

    colour = sys.stdout.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    try:
        "±✓✗".encode(_encoding())
    except UnicodeEncodeError:
        return Style(colour, ascii_only=True)
    return Style(colour)


if __name__ == "__main__":
    sys.exit(main())
