"""A bar that is heated throughout and cold at one end, whose tip and mean have closed forms; and files of models of
it."""

import pytest

from compare.worker import Worker
from tests.validate.conftest import no_field

__all__ = ["no_field"]

SCENE = """
scene = {name = "bar", initial_temperature = 300}
material = [{name = "film", thermal_conductivity = 50, density = 2500, specific_heat = 800}]
boundary = [{name = "end", lower = [0, 0, 0], upper = [0, "10 um", "2 um"], temperature = 300}]
probe = [
  {name = "tip", at = ["100 um", "5 um", "1 um"]},
  {name = "bar mean", lower = [0, 0, 0], upper = ["100 um", "10 um", "2 um"]},
  {name = "heat out", quantity = "heat_flow", lower = [0, 0, 0], upper = [0, "10 um", "2 um"]},
]

[[box]]
name = "bar"
material = "film"
lower = [0, 0, 0]
upper = ["100 um", "10 um", "2 um"]
heat_source = 1e12

[run]
accuracy = 1e-3
"""


@pytest.fixture
def in_this_process(monkeypatch):
    """Models that do not end their process are run without one of their own, which takes a second to start."""
    monkeypatch.setattr(Worker, "run", lambda self, seconds, function, *arguments: function(*arguments))


@pytest.fixture
def steady(tmp_path):
    """The scene in its steady state: the tip rises by g L^2/2k = 100 K."""
    path = tmp_path / "bar.toml"
    path.write_text(SCENE + "steady = true\n", encoding="utf-8")
    return path


@pytest.fixture
def transient(tmp_path):
    """The same over three of its slowest time constants, (2 L/pi)^2/D = 0.16 ms."""
    path = tmp_path / "heating.toml"
    path.write_text(SCENE + 'end_time = "0.5 ms"\n', encoding="utf-8")
    return path


@pytest.fixture
def model(tmp_path):
    """A lumped model of the bar as a Python file, with functions that misbehave."""
    path = tmp_path / "lumped.py"
    path.write_text(
        '''"""One thermal resistance and one capacity."""
import sys
import time

import numpy as np

TAU = 1.6e-4


def bar(scene, times):
    print("asked")
    source = next(box for box in scene["box"] if box["name"] == "bar")["heat_source"]
    top = 1e-10 * source
    rise = top if times is None else top * (1 - np.exp(-times / TAU))
    return {"tip": 300 + rise, "heat out": -2e-5 * rise}


def asleep(scene, times):
    open("sleeping", "w").close()
    time.sleep(1000)


class Mute(Exception):
    def __str__(self):
        return 1 / 0


def mute(scene, times):
    raise Mute


def alone(scene):
    return {"tip": 400.0}


silent = lambda scene, times: {}
wrong = lambda scene, times: {"tip": 1 / 0}
leaves = lambda scene, times: sys.exit(3)
other = lambda scene, times: {"tipp": 1.0}
shape = lambda scene, times: {"tip": [1.0, 2.0]}
ragged = lambda scene, times: {"tip": [1.0, [2.0]]}
tensor = lambda scene, times: {"tip": type("Tensor", (), dict.fromkeys(("__array__", "__repr__"), lambda *_: 1 / 0))()}
empty = lambda scene, times: {"tip": float("nan")}
yes = lambda scene, times: {"tip": True}
tuple_ = lambda scene, times: (1.0, 2.0)
masked = lambda scene, times: {"tip": np.ma.masked_array([400.0], [True])}
number = 3
''',
        encoding="utf-8",
    )
    return path
