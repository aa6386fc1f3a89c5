"""Sweeps over a design space, and maps of where a reduction is within a tolerance, on Dask.

A sweep is a `Design` (which points) of a `Base` (what is solved at each) with a `Request` (how). Points are solved in
processes of their own, each row is stored when it is there, and tables, figures and a page are made of the stored rows.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    """`validate.sweep` is this package and the function that it is for."""

    def __call__(self, *given: Any, **named: Any) -> Any:
        from validate.sweep.interface import sweep

        return sweep(*given, **named)


sys.modules[__name__].__class__ = _Callable
