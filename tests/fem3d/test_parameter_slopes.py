"""Slopes by parameters of a scene: the sum over the faces, properties and conditions that they move; and differences of
solutions."""

from dataclasses import replace

import pytest

from fem3d.runs import scene as scene_run
from fem3d.runs.differences import STEP, Sensitivities
from fem3d.runs.sensitivities import of_scene
from scenes.free import from_dict
from scenes.loading import load, load_free, written
from scenes.model import Scene
from scenes.varied import neighbour, numbers, of_free

SUM = 1e-3  # what is asked of the sums, of the largest slope of each quantity


def solved(scene: Scene) -> Sensitivities:
    return of_scene(scene, scene_run.solve(scene, whole=True))


@pytest.fixture(scope="module")
def bridge():
    """The bridge whose voltage and foot conductivity are parameters too, the latter not in proportion to one."""
    found = written(load("bridge"))
    found["parameters"] |= {"U": "1 V", "d": "2 um"}
    found["boundary"][1]["voltage"] = "U"
    found["material"][1]["thermal_conductivity"] = "1.4 W/(m K)*(2 um/d)**2"
    scene = replace(from_dict(found, "bridge"), accuracy=1e-2)
    return scene, solved(scene)


def moves(scene: Scene, parameter: str) -> dict[str, float]:
    """How each key of a scene changes with the logarithm of a parameter: of a face over the size of its box, of all
    else of its logarithm."""
    there = neighbour(scene, parameter, STEP)
    here, other = of_free(scene), of_free(there)
    found = {}
    for key, number in here.items():
        name, _, axis = key.removeprefix("box.").rpartition(".")
        if axis in ("x", "y", "z") and key.startswith("box."):
            name, _, end = name.rpartition(".")
            both = [getattr(next(b for b in s.boxes if b.name == name), end)["xyz".index(axis)] for s in (there, scene)]
            found[key] = (both[0] - both[1]) / number.value / STEP
        elif number.value:
            found[key] = (other[key].value / number.value - 1) / STEP
    return found


@pytest.mark.long
def test_a_slope_is_the_sum_of_those_of_what_the_parameter_moves(bridge):
    scene, slopes = bridge
    assert not slopes.left_out
    for parameter in (key for key in numbers(scene) if key.startswith("parameters.")):
        by = moves(scene, parameter)
        # A point does not go along with faces, as the parameter takes it: "quarter" has a term of its own.
        for probe in slopes.values.keys() - {"quarter"}:
            largest = max(abs(of[probe].value) for of in slopes.steady.values())
            parts = {key: move * slopes.steady[key][probe].value for key, move in by.items() if key in slopes.steady}
            total, value = sum(parts.values()), slopes.steady[parameter][probe].value
            assert value == pytest.approx(total, abs=SUM * largest), (parameter, probe)
            # The largest part left out would show, unless it is none itself.
            most = max(parts.values(), key=abs)
            if abs(most) > 10 * SUM * largest:
                assert value != pytest.approx(total - most, abs=SUM * largest)


@pytest.mark.long
def test_a_parameter_takes_along_a_point_that_is_read(bridge):
    """Against the difference of two solutions, whose errors are 1e-6 of the potential."""
    _, slopes = bridge
    step, keys = 0.01, ("run.accuracy=1e-5",)
    read = [
        scene_run.solve(load_free("bridge", [*keys, f"parameters.L={200 * (1 + sign * step)}um"])).steady["quarter"]
        for sign in (1, -1)
    ]
    difference = (read[0].value - read[1].value) / (read[0].value + read[1].value) / step
    slope = slopes.steady["parameters.L"]["quarter"]
    assert slope.value == pytest.approx(difference, abs=slope.error + 2e-4)  # and the step's square
    faces = sum(move * slopes.steady[key]["quarter"].value for key, move in moves(bridge[0], "parameters.L").items())
    assert faces != pytest.approx(difference, abs=0.1)
