"""Packages that can be called: ``compare.solve(...)`` is a function's name, and ``compare.solve`` holds its parts."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    """A package; calling it calls the function of its name in ``compare.interface``."""

    def __call__(self, *given: Any, **named: Any) -> Any:
        from compare import interface

        return getattr(interface, self.__name__.rpartition(".")[2])(*given, **named)


def make_callable(name: str) -> None:
    """Makes the package of a name callable."""
    sys.modules[name].__class__ = _Callable
