from collections.abc import Callable
from typing import Any

from compare import testing as testing
from compare.interface import Run as Run
from compare.interface import device as device
from compare.interface import run as run
from compare.interface import solve as solve

sweep: Callable[..., Any]
