"""The search for an accuracy and its verdicts, on stand-in meshes with given errors."""

from types import SimpleNamespace
from typing import Any

import pytest

from fem3d.adaptivity import nested
from fem3d.adaptivity.adapt import MOST_LEVELS, adapt
from fem3d.solution.newton import CoarseMeshError
from scenes.errors import NumericsError, RunawayError, RunawayInTimeError

ACCURACY = 1e-2


class Meshes:
    """Meshes by number: ``told[k]`` is the relative error of the steady level on mesh k, None where a lower space has
    no steady state, or an exception to raise there; there are no further meshes."""

    def __init__(self, told: list[Any], number: int = 0, way: tuple[str, ...] = ()) -> None:
        self.told, self.number, self.way, self.marched = told, number, way, False

    def problems(self) -> Any:
        told = self.told[self.number]
        if self.marched and isinstance(told, RunawayInTimeError):
            told = NumericsError("inputs that vary have no steady state")
        self.marched = True
        return SimpleNamespace(
            heat=SimpleNamespace(size=10 * 2**self.number), conductor=None, nonlinear=False, told=told,
            driven=lambda factor, by_heat: SimpleNamespace(told=NumericsError("no state below a limit")),
        )  # fmt: skip

    def begin(self) -> "Meshes":
        return self

    def examine(self, study: Any, given: Any, fine: Any) -> Any:
        error = self.told[self.number]
        if error is None:
            raise CoarseMeshError
        each, goals = {"probe": error}, {"probe": []}
        return SimpleNamespace(worst=error, relative=each, errors=each, goals=goals, record=None, fine=fine, low=fine)

    def _next(self, how: str) -> "Meshes | None":
        last = self.number + 1 == len(self.told)
        return None if last else Meshes(self.told, self.number + 1, (*self.way, how))

    def refine_all(self) -> "Meshes | None":
        return self._next("raised")

    def refine(self, indicators: Any, target: float) -> "Meshes | None":
        assert indicators.worst == self.told[self.number] > target
        return self._next("refined")


@pytest.fixture(autouse=True)
def _told(monkeypatch):
    def solve_space(study: Any, given: Any, start: Any = None) -> SimpleNamespace:
        if isinstance(given.told, Exception):
            raise given.told
        return SimpleNamespace(state=None)

    monkeypatch.setattr(nested, "solve_space", solve_space)


def solved(told: list[Any], voltage: float = 1.0) -> Any:
    study: Any = SimpleNamespace(accuracy=ACCURACY, field_accuracy=None, voltage=voltage)
    mesh: Any = Meshes(told)
    return adapt(study, False, mesh=mesh)


def fold(limit: float) -> RunawayError:
    return RunawayError("runaway", limit)


@pytest.mark.parametrize(
    ("told", "way"),
    [
        ([0.009], ()),
        ([0.5, 0.02, 0.009], ("refined", "refined")),
        ([None, 0.009], ("raised",)),
        # A mesh that can't be refined any more is taken as it is.
        ([0.5, 0.02], ("refined",)),
        # A fold on one mesh alone is that mesh's own.
        ([fold(0.9), 0.009], ("raised",)),
        # Two meshes whose folds differ by more than a third of the distance to the voltage don't confirm it.
        ([fold(0.9), fold(0.95), 0.009], ("raised", "raised")),
    ],
)
def test_a_mesh_is_refined_raised_or_accepted(told, way):
    answer = solved(told)
    assert answer.mesh.way == way
    assert answer.levels == len(told)
    assert answer.errors == {"probe": told[-1]}


@pytest.mark.parametrize(
    ("told", "limit"),
    [([fold(0.9), fold(0.91), 0.009], 0.91), ([fold(0.9)], 0.9), ([RunawayInTimeError("runs", 1e-3)], float("inf"))],
)
def test_runaway_is_confirmed_by_another_mesh_unless_mesh_is_last(told, limit):
    with pytest.raises(RunawayError, match="run") as caught:
        solved(told)
    assert caught.value.limit == limit


def test_a_transient_runs_away_where_two_meshes_say_so():
    told = [RunawayInTimeError("first", 1e-3), RunawayInTimeError("second", 2e-3), 0.009]
    with pytest.raises(RunawayInTimeError, match="second"):
        solved(told)
    assert solved(told[1:]).levels == 2


def test_no_mesh_is_left():
    with pytest.raises(NumericsError, match="isn't reached"):
        solved([None])
    # An error that falls by a twentieth from level to level, too slowly to end.
    with pytest.raises(NumericsError, match=r"isn't reached in this scene$"):
        solved([0.5 * 0.95**n for n in range(MOST_LEVELS + 1)])
