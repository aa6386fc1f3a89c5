"""The rule of the verdict, the propagation of errors, and what counts as declared."""

from __future__ import annotations

from dataclasses import replace

import pytest

from compare.verdict import Check, contradicts, expected, judge, relative, spread
from scenes.result import Estimate
from scenes.sink import Sink


@pytest.mark.parametrize(
    ("difference", "u_num", "verdict"),
    [
        (0.01, 0.005, "agrees"), (-0.01, 0.005, "agrees"), (0.03, 0.005, "differs"), (-0.03, 0.005, "differs"),
        (0.02, 0.0, "agrees"), (0.0200001, 0.0, "differs"), (0.018, 0.005, "unresolved"), (0.022, 0.005, "unresolved"),
        (0.0, 0.03, "unresolved"), (float("inf"), 0.0, "differs"), (float("nan"), 0.0, "unresolved"),
        (float("inf"), float("inf"), "unresolved"),
    ],
)  # fmt: skip
def test_judge(difference: float, u_num: float, verdict: str) -> None:
    assert judge(difference, 0.02, u_num) == verdict


def test_spread_adds_what_each_error_moves() -> None:
    inputs = {"a": Estimate(2.0, 0.1), "b": Estimate(4.0, 0.2)}
    assert spread(lambda a, b: 3 * a - 5 * b, inputs) == pytest.approx(0.3 + 1.0)
    # Of an input's two directions the worse one counts: 1/(4 - 0.2) is farther from 1/4 than 1/(4 + 0.2).
    assert spread(lambda b: 1 / b, {"b": inputs["b"]}) == pytest.approx(1 / 3.8 - 1 / 4)
    assert spread(lambda: 1.0, {}) == 0.0


def test_relative() -> None:
    assert relative(3.0, 4.0) == -0.25
    assert relative(1.0, 0.0) == float("inf")
    assert relative(0.0, 0.0) == 0.0


CHECK = Check("eq14", "", 1.0, 2.0, "K/W", -0.5, 0.02, 1e-4, "differs")


@pytest.mark.parametrize(
    ("verdict", "declared", "tolerances", "loose", "strict"),
    [
        ("differs", None, {}, False, True), ("agrees", None, {}, False, False), ("unresolved", None, {}, False, True),
        ("differs", None, {"eq14": 0.1}, True, True), ("unresolved", None, {"eq14": 0.1}, False, True),
        ("differs", None, {"eq13": 0.1}, False, True),
        ("differs", ("eq14",), {}, False, False), ("agrees", ("eq14",), {}, True, True),
        ("unresolved", ("eq14",), {}, False, True), ("differs", ("eq18",), {}, True, True),
        ("differs", (), {}, True, True), ("differs", ("eq14",), {"eq14": 0.1}, False, False),
    ],
)  # fmt: skip
def test_what_contradicts_the_scene(
    verdict: str, declared: tuple[str, ...] | None, tolerances: dict[str, float], loose: bool, strict: bool
) -> None:
    sink = Sink(tolerances=tolerances, expected_to_differ=declared)
    check = replace(CHECK, verdict=verdict, expected=expected(sink, "eq14"))  # type: ignore[arg-type]
    assert contradicts(check, sink, strict=False) is loose
    assert contradicts(check, sink, strict=True) is strict
