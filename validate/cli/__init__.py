"""The `validate` command: arguments in, text and an exit status out. Nothing heavy is imported until it is needed."""

from __future__ import annotations

import signal
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from scenes.errors import SceneError, printable, reason
from validate.cli.terminal import BAD_INPUT, INTERRUPTED, NUMERICS, complain, fill_streams

_PACKAGES = {"skfem": "scikit-fem", "vtkmodules": "vtk", "PIL": "pillow"}
"""The package that has to be installed for a module of another name."""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status: 0 fine, 1 a check came out other than declared, 2 bad input, 3 the
    numerics failed, 130 interrupted. An error is one sentence on standard error."""
    if not sys.flags.dev_mode:
        # An overflow ends in a sentence; the warning of numpy would stand above it.
        warnings.filterwarnings("ignore", category=RuntimeWarning)
        # A picture has a box for a sign that its font lacks.
        warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from")
    try:
        if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:  # as `validate.__main__` leaves it
            signal.signal(signal.SIGINT, signal.default_int_handler)
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:  # kill, or a batch system whose time is up
            with suppress(ValueError):  # another thread than the main one
                signal.signal(signal.SIGTERM, signal.default_int_handler)
        fill_streams()
        from compare.processes import one_thread
        from validate.cli.arguments import parse

        one_thread()
        arguments = parse(sys.argv[1:] if argv is None else argv)
        return import_module(f"validate.cli.{arguments.command}").run(arguments)
    except SystemExit as leaving:  # argparse, after --help or --version
        return int(leaving.code or 0)
    except KeyboardInterrupt:
        return complain("interrupted; earlier results are as they were", INTERRUPTED)
    except SceneError as error:
        return complain(str(error), BAD_INPUT)
    except ModuleNotFoundError as error:
        module = (error.name or "").partition(".")[0]
        if not module or (Path(__file__).parents[2] / module).is_dir():
            return _fault(error)
        package = _PACKAGES.get(module, module)
        return complain(f"the package {package} is missing: pip install {package}", BAD_INPUT)
    except OSError as error:
        which = "a file" if error.filename is None else f'"{printable(str(error.filename), 200)}"'
        return complain(f"{which} could not be read or written: {reason(error)}", BAD_INPUT)
    except ArithmeticError as error:
        return complain(str(error), NUMERICS)
    except MemoryError:
        return complain("out of memory: ask for a larger accuracy", NUMERICS)
    except Exception as error:
        return _fault(error)


def _fault(error: Exception) -> int:
    if sys.flags.dev_mode:
        raise error
    return complain(
        f"a fault of this program, {type(error).__name__}: {error} (python -X dev shows where)", NUMERICS
    )  # fmt: skip
