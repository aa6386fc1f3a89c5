"""The `validate` command: arguments in, text and an exit status out. Nothing heavy is imported until it is needed."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module

from scenes.errors import SceneError
from validate.cli.terminal import BAD_INPUT, INTERRUPTED, NUMERICS, complain


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status: 0 fine, 1 a check came out other than declared, 2 bad input, 3 the
    numerics failed, 130 interrupted. What goes wrong is one sentence on standard error."""
    if not sys.flags.dev_mode:
        # What overflows ends in a sentence; numpy's own words about it would stand above that.
        warnings.filterwarnings("ignore", category=RuntimeWarning)
    try:
        from validate.cli.arguments import parse
        from validate.processes import one_thread

        one_thread()
        arguments = parse(sys.argv[1:] if argv is None else argv)
        return import_module(f"validate.cli.{arguments.command}").run(arguments)
    except SystemExit as leaving:  # argparse, after --help or --version
        return int(leaving.code or 0)
    except KeyboardInterrupt:
        return complain("interrupted; earlier results are as they were", INTERRUPTED)
    except SceneError as error:
        return complain(str(error), BAD_INPUT)
    except OSError as error:
        return complain(f"a file could not be read or written: {error}", BAD_INPUT)
    except ArithmeticError as error:
        return complain(str(error), NUMERICS)
    except MemoryError:
        return complain("out of memory: ask for a larger accuracy", NUMERICS)
    except Exception as error:
        if sys.flags.dev_mode:
            raise
        return complain(
            f"a fault of this program, {type(error).__name__}: {error} (python -X dev shows where)", NUMERICS
        )
