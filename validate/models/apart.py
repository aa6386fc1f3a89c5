"""A Python file's function as a model, run in a process of its own: whatever it does to that, as to leave it, to copy
it or never to answer, ends in a sentence here.

What it prints goes to standard error. The process, and all that it starts, ends with the model, and with this process.
"""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import warnings
import weakref
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from queue import SimpleQueue
from threading import Lock
from typing import Any

import numpy as np

from compare.processes import with_parent
from scenes.errors import SceneError, printable
from validate.models import LONGEST, Answer, Asked, command_of, too_long

LOOK = 0.1  # s from one look at whether the process is still there to the next, while its answer is waited for


@dataclass
class Apart:
    """The function of FILE.py:FUNCTION by its ``name``; the ``process`` that has it, the ``channel`` to that, and the
    sentence ``over`` with which it ended, if it has."""

    name: str
    process: subprocess.Popen[bytes]
    channel: Connection
    over: str = field(default="", init=False)
    _asking: Lock = field(default_factory=Lock, init=False, repr=False)

    def __post_init__(self) -> None:
        weakref.finalize(self, _end, self.process)

    def rows(self, question: Asked) -> np.ndarray:
        return np.empty(0)

    def steady(self, question: Asked) -> Answer:
        return self._answer(question, None), {}

    def over_time(self, question: Asked, times: np.ndarray) -> Answer:
        return self._answer(question, times), {}

    def _answer(self, question: Asked, times: np.ndarray | None) -> dict[str, np.ndarray]:
        with self._asking:
            with suppress(OSError):  # of a process that is gone
                if not self.over:
                    self.channel.send((question, times))
            answer: dict[str, np.ndarray] = self.received()
            return answer

    def received(self) -> Any:
        """What the process has to say. Raises SceneError for a refusal, and where it ends or is too long."""
        if self.over:
            raise SceneError(self.over)
        try:
            waited = 0.0
            while not self.channel.poll(LOOK):
                waited += LOOK
                if self.process.poll() is not None and not self.channel.poll():
                    raise EOFError
                if waited >= LONGEST:
                    self.over = too_long(self.name)
                    raise SceneError(self.over)
            refusal, answer = self.channel.recv()
        except (EOFError, OSError):
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(1.0)
            _end(self.process)
            status = self.process.returncode
            how = f"status {status}" if status >= 0 else f"the signal {signal.Signals(-status).name}"
            self.over = f"--model {self.name} failed: it ended its process, with {how}"
            raise SceneError(self.over) from None
        except BaseException:
            _end(self.process)
            self.over = self.over or f"--model {self.name} was interrupted"
            raise
        if refusal:
            raise SceneError(refusal)
        return answer


def opened(given: str, folder: str) -> Apart:
    """The function of FILE.py:FUNCTION, loaded; the same as before where that still serves. Raises SceneError."""
    path = Path(folder, given.rpartition(":")[0]).resolve()
    key = given, folder, str(path), path.stat().st_mtime_ns if path.is_file() else None, os.getcwd()
    model = _loaded(*key)
    if model.over or model.process.poll() is not None:
        _loaded.cache_clear()
        model = _loaded(*key)
    return model


@lru_cache(maxsize=1)
def _loaded(given: str, folder: str, path: str, saved: int | None, cwd: str) -> Apart:
    """The function of a file that was ``saved`` then (ns), in the folder that this process is in."""
    channel, its_own = Pipe()
    with its_own:
        process = subprocess.Popen(
            command_of("validate.models.apart:serve", str(its_own.fileno()), given, folder),
            stdin=subprocess.DEVNULL, stdout=2, pass_fds=[its_own.fileno()], start_new_session=True,
        )  # fmt: skip
    model = Apart(f"{Path(path).name}:{given.rpartition(':')[2]}", process, channel)
    model.received()
    return model


def _end(process: subprocess.Popen[bytes]) -> None:
    """Ends a process and all that it has started."""
    with suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def serve(number: str, given: str, folder: str) -> None:
    """What that process does: it loads the function and answers questions from the channel that is open under a
    ``number``, until that is closed."""
    from validate.models.asked import checked
    from validate.models.function import opened as loaded

    with_parent()
    os.set_inheritable(int(number), False)
    warnings.filterwarnings("ignore", category=RuntimeWarning)  # of numpy, where a sentence says what is not finite
    channel, questions = Connection(int(number)), SimpleQueue[Any]()
    in_threads: list[BaseException] = []
    threading.excepthook = lambda raised: in_threads.append(raised.exc_value or raised.exc_type())

    def listen() -> None:
        with suppress(EOFError, OSError):
            while True:
                questions.put(channel.recv())
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    try:
        function = loaded(given, folder, in_threads)
        channel.send(("", None))
        while True:
            question, times = questions.get()
            try:
                asked = question.steady if times is None else question.over_time
                answer = function.steady(question) if times is None else function.over_time(question, times)
                channel.send(("", checked(function, answer, asked, times)[0]))
            except SceneError as error:
                channel.send((str(error), None))
    except SceneError as error:
        channel.send((str(error), None))
    except BaseException as error:
        channel.send((f"--model {printable(given)} failed: {type(error).__name__}", None))
    os._exit(0)  # without waiting for threads that the model has left
