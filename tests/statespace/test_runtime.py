"""The code that runs a compact model, against a general integrator and by hand."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from statespace.runtime import CompactModel


def document(steady: bool = False) -> dict[str, Any]:
    """A made-up model: three states, two current fields, inputs "V" and "T", the largest of two rows as output."""
    rng = np.random.default_rng(1)
    z, n = 6, 3
    F = np.concatenate([0.1 * rng.normal(size=(n, 3)), -np.diag([1.0, 30.0, 4000.0])], axis=1)
    matrices = {
        "A": np.concatenate([np.eye(2)[..., None], 0.02 * rng.normal(size=(2, 2, z - 1))], axis=-1),
        "S": np.concatenate([[[0.0, 1.0], [0.0, 0.4]], np.zeros((2, z - 2))], axis=1), "F": F,
        "Q": 0.5 * rng.normal(size=(3, n, z)), "Y": rng.normal(size=(2, z)), "W": rng.normal(size=(2, 2)),
        "U": rng.normal(size=(2, 2, z)), "P": rng.normal(size=(3, 2, z)),
    }  # fmt: skip
    matrices["A"] = (matrices["A"] + matrices["A"].transpose(1, 0, 2)) / 2
    entry = {"rest": 0.0, "range": [-9.0, 9.0]}
    volts = entry | {"name": "V", "unit": "V", "kind": "voltage", "value": 1.0, "port": {"row": 0, "unit": "A"}}
    kelvin = entry | {"name": "T", "unit": "K", "kind": "temperature", "value": 0.0, "port": {"row": 1, "unit": "W"}}
    return {
        "scene": "made up", "states": n, "steady_only": steady, "initial_temperature_K": 2.0,
        "range": {"highest_temperature_K": None, "from_s": 0.1, "to_s": 2.0},
        "inputs": [volts, kelvin],
        "outputs": [{"name": "y", "unit": "W", "rows": [0, 1], "reduce": "max"},
                    {"name": "t", "unit": "K", "rows": [0], "reduce": "mean"}],
        "error": {"the scene": {"over time": {"y": {"error": 0.0, "relative": 0.0}}}}, "estimated": {"text": []},
        "matrices": {k: {"shape": list(v.shape), "values": v.ravel().tolist()} for k, v in matrices.items()},
    }  # fmt: skip


def by_hand(model: CompactModel, g: np.ndarray, slope: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """db/dt and the output's rows, by loops over the equations of the docstring."""
    z = np.array([1.0, *g, *b])
    c = np.linalg.solve(model.A @ z, model.S @ z)
    rate, rows, pair = model.F @ z, model.Y @ z + model.W @ slope, 0
    for i in range(2):
        rows = rows + c[i] * (model.U[i] @ z)
        for j in range(i, 2):
            weight = (1 if i == j else 2) * c[i] * c[j]
            rate, rows, pair = rate + weight * (model.Q[pair] @ z), rows + weight * (model.P[pair] @ z), pair + 1
    return rate, rows


def test_over_time_as_a_general_integrator_finds_it():
    """A voltage that jumps and a temperature that ramps."""
    model = CompactModel(document())
    given = {"V": ([0.5, 0.5], [2.0, -1.0]), "T": ([0.2, 1.2], [0.0, 3.0])}
    times = [0.1, 0.4, 0.7, 2.0]

    def drive(t: float) -> tuple[np.ndarray, np.ndarray]:
        inside = 0.2 <= t < 1.2
        ramp = 3.0 * min(max(t - 0.2, 0.0), 1.0)
        return np.array([2.0 if t < 0.5 else -1.0, ramp]), np.array([0.0, 3.0 if inside else 0.0])

    def arrived(b: np.ndarray, start: float, stop: float) -> np.ndarray:
        def rate(t: float, x: np.ndarray) -> np.ndarray:
            return by_hand(model, *drive(min(t, stop - 1e-12)), x)[0]

        return solve_ivp(rate, (start, stop), b, "Radau", rtol=1e-9, atol=1e-9).y[:, -1]

    b, t, expected = np.zeros(3), 0.0, []
    for stop in sorted({*times, 0.2, 0.5, 1.2}):
        b, t = arrived(b, t, stop), stop
        if stop in times:
            expected.append(by_hand(model, *drive(stop), b)[1].max())
    found = model.simulate(times, given)["y"]
    scale = np.abs(expected).max()
    assert np.abs(found - expected).max() < 1e-5 * scale  # each step's error is 1e-6
    model.F[1, 4] *= 1.001
    assert np.abs(model.simulate(times, given)["y"] - expected).max() > 1e-5 * scale


def test_the_steady_state_is_where_nothing_moves():
    model = CompactModel(document())
    g = np.array([1.5, 0.3])
    b = model.rest(g)
    assert np.abs(by_hand(model, g, np.zeros(2), b)[0]).max() < 1e-10
    assert model.steady({"V": 1.5, "T": 0.3})["y"] == pytest.approx(by_hand(model, g, np.zeros(2), b)[1].max())
    late = model.simulate([40.0], {"V": 1.5, "T": 0.3})["y"][0]
    assert late == pytest.approx(model.steady({"V": 1.5, "T": 0.3})["y"], rel=1e-5)


def test_what_it_refuses():
    with pytest.raises(KeyError, match="there is no input 'W'"):
        CompactModel(document()).simulate([1.0], {"W": 1.0})
    with pytest.raises(ValueError, match="steady state"):
        CompactModel(document(steady=True)).simulate([1.0])
    narrow = document()
    narrow["inputs"][0]["range"] = [-1.0, 1.0]
    with pytest.warns(UserWarning, match=r"V = 1.5 V is past the model's range, -1 to 1 V"):
        CompactModel(narrow).steady({"V": 1.5})


@pytest.mark.parametrize("seed", range(5))
def test_a_steady_state_in_which_all_inputs_cancel_out(seed):
    """As where all is of one temperature: the states are rounding errors of large terms."""
    rng, n, warm = np.random.default_rng(seed), 20, np.full(3, 293.15)
    per_kelvin = rng.normal(size=(n, 3))
    F = np.column_stack([-per_kelvin @ warm, per_kelvin, -np.diag(10.0 ** rng.uniform(0, 4, n))])
    z = F.shape[1]
    nothing = {"A": (0, 0, z), "S": (0, z), "Q": (0, n, z), "Y": (1, z), "W": (1, 3), "U": (0, 1, z), "P": (0, 1, z)}
    made = document(steady=True) | {"inputs": [{"name": f"T{k}"} for k in range(3)], "matrices": {
        "F": {"shape": F.shape, "values": F.ravel()},
        **{name: {"shape": shape, "values": np.zeros(shape).ravel()} for name, shape in nothing.items()},
    }}  # fmt: skip
    assert np.abs(CompactModel(made).rest(warm)).max() < 1e-9
