"""The `validate` command as the shell starts it, and `python -m validate`."""

# The built-in part of `signal`, which itself is a file to be read: Ctrl-C meanwhile would be a traceback.
import _signal as signal  # type: ignore[import-not-found]
import gc
import sys


def _leave_quietly() -> None:
    """Ctrl-C ends the process without a word: before `main` can say so in a sentence, and after it has."""
    workers = sys.modules.get("multiprocessing.process")
    # Processes that this one starts import this file too, and end by their own handlers.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler and not (workers and workers.parent_process()):
        signal.signal(signal.SIGINT, signal.SIG_DFL)


_leave_quietly()


def _keep_memory() -> None:
    """The C library keeps memory that arrays leave for the next ones, as far as it can be asked to: to return it and
    take it again page by page costs a 3D run up to a tenth of its time."""
    import ctypes
    from contextlib import suppress

    with suppress(AttributeError, OSError, TypeError):  # other systems have no `mallopt`
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(-3, 1 << 25)  # M_MMAP_THRESHOLD, the most that glibc allows
        mallopt(-1, 1 << 28)  # M_TRIM_THRESHOLD


def command() -> int:
    """Runs the command that the shell gave and returns its exit status."""
    from validate.cli import main

    _keep_memory()

    gc.set_threshold(100_000)  # as many objects as imports make, among which there is no garbage to look for
    try:
        return main()
    finally:
        gc.freeze()  # the objects that the process ends with
        _leave_quietly()


if __name__ == "__main__":
    sys.exit(command())
