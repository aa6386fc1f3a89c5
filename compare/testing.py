"""Assertions for your own tests: how far the 1D model, or your own data, may be from 3D.

    def test_my_sink():
        assert_reduction_agrees(scenes.load("my-sink.toml"), peak=0.05)

A failure shows both values, their difference with its error bound, and the tolerance.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import compare
from compare import quantities
from compare.sink_checks import at_rest
from compare.verdict import COVERS, Check, amount, judge
from scenes import load
from scenes.checks import DEFAULT_TOLERANCES, OVER_TIME
from scenes.errors import SceneError, unknown
from scenes.formats import difference_text, percent, sink_text
from scenes.kinds import Quantity
from scenes.model import OVER_TIME as PROBE_OVER_TIME
from scenes.model import AnyScene
from scenes.sink import OF_A_SINK, Sink
from scenes.units import NUMBER

QUANTITIES = {name: entry for name, entry in OF_A_SINK.items() if name != "heat_out"}
"""What can be asserted of the steady state, beside the checks by their ids."""


def assert_reduction_agrees(
    scene: Sink | str | Path = "sink",
    *,
    voltage: float | None = None,
    accuracy: float | None = None,
    uncertain: Mapping[str, str] | None = None,
    **tolerances: float | str,
) -> compare.Run:
    """Assert that the 1D model of a sink is within relative tolerances of 3D; return the run.

    ``tolerances`` are by quantity (``peak=0.05`` or ``peak="5 %"``, rises relative to the 3D rise) or by check
    (``eq13=0.001``, ``fig6_peak=0.4``), at most 1. With ``uncertain`` inputs, {"sink.width": "1%"}, twice the u_input
    of the difference (95 %) counts with the error of 3D. Raises AssertionError where a tolerance is exceeded or the
    errors leave it open, and SceneError for an unknown name or a bad tolerance.
    """
    __tracebackhide__ = True
    allowed = _read(tolerances, (*QUANTITIES, *DEFAULT_TOLERANCES))
    steady = not set(allowed) & set(OVER_TIME)
    run = compare.run(scene, voltage=voltage, accuracy=accuracy, steady=steady, uncertain=uncertain)
    checks = {name: _steady(run, name) if name in QUANTITIES else run.check(name) for name in allowed}
    _assert(f"the 1D model of {sink_text(run.scene)}", [(checks[name], allowed[name]) for name in allowed])
    return run


def assert_model_agrees(
    scene: AnyScene | str | Path,
    model: str | Path | Callable[..., Any],
    *,
    accuracy: float | None = None,
    uncertain: Mapping[str, str] | None = None,
    **tolerances: float | str,
) -> compare.Run:
    """Assert that your own 1D model of any scene is within relative tolerances of 3D; return the run.

    ``model`` is a function f(scene, times) -> {probe: values}, or the argument of `validate solve --model`.
    ``tolerances`` are by probe, which then holds in the steady state and over time (``heater=0.05``, ``**{"beam mean":
    "5 %"}``), or by check (``heater_over_time=0.1``). Raises as `assert_reduction_agrees`, and SceneError for a model
    without an answer.
    """
    __tracebackhide__ = True
    run = compare.solve(scene, model=model, accuracy=accuracy, uncertain=uncertain)
    ids = [check for check in run.checks if not check.startswith("slope_")]
    probes = dict.fromkeys(check.removesuffix(PROBE_OVER_TIME) for check in ids)
    allowed = _read(tolerances, tuple(dict.fromkeys([*probes, *ids])))
    pairs = [(name, check) for name in allowed for check in ids if check in (name, f"{name}{PROBE_OVER_TIME}")]
    name = "the model" if run.reduced1d is None else run.reduced1d.model
    _assert(f"{name} for {run.scene.name}", [(run.checks[check], allowed[name]) for name, check in pairs])
    return run


def assert_traces_agree(
    scene: Sink | AnyScene | str | Path,
    file: str | Path,
    *,
    accuracy: float | None = None,
    columns: Mapping[str, str] | None = None,
    voltage: float | None = None,
    data_uncertainty: str | Sequence[str] = (),
    **tolerances: float | str,
) -> compare.Run:
    """Assert that data in a file (COMSOL table, CSV, ngspice) are within tolerances of 3D, for any scene.

    Returns the run. ``columns`` name the columns of quantities, {"peak": "T (K), Point 1"}; ``data_uncertainty`` counts
    with the error of 3D. ``tolerances`` of a sink: ``peak``, ``end``, ``mean`` relative to the final 3D rise,
    ``current`` to its final change, ``power`` to itself; ``voltage`` is a sink's. Of any other scene by probe, relative
    to its largest 3D rise, or value. Raises as `assert_reduction_agrees`, and SceneError for a quantity that the file
    lacks.
    """
    __tracebackhide__ = True
    loaded: Any = load(scene) if isinstance(scene, (str, Path)) else scene
    allowed = _read(tolerances, tuple(quantities.of(loaded).names))
    solve = partial(compare.run, voltage=voltage) if loaded.kind == "sink" else compare.solve
    run = solve(loaded, accuracy=accuracy, against=file, columns=columns, data_uncertainty=data_uncertainty)
    _assert(f"{Path(file).name} for {loaded.name}", [(run.check(f"against_{n}"), t) for n, t in allowed.items()])
    return run


def _read(tolerances: Mapping[str, float | str], allowed: tuple[str, ...]) -> dict[str, float]:
    """The tolerances as numbers. Raises SceneError for an unknown name or a bad value."""
    if not tolerances:
        raise SceneError("nothing to assert: give at least one tolerance, such as peak=0.05")
    if strange := [name for name in tolerances if name not in allowed]:
        raise unknown("nothing can be asserted of", strange[0], allowed)
    kind = Quantity(NUMBER, 1e-15, 1.0, note="; it is relative: 0.05 is 5 %")
    return {name: float(kind.read(f"the tolerance {name}", value) or 0.0) for name, value in tolerances.items()}


def _steady(run: compare.Run, name: str) -> Check:
    """A steady quantity as a check."""
    entry = QUANTITIES[name]
    check = at_rest(entry.steady, f"steady {entry.called}", run.outcome)
    assert check is not None
    u_input = None if run.uncertain is None else run.uncertain.difference.get(entry.steady)
    return replace(check, id=name, because="", u_input=u_input)


def _assert(name: str, checks: Sequence[tuple[Check, float]]) -> None:
    """Raise AssertionError with a line for each check, the bad ones first, where one is not within its tolerance."""
    __tracebackhide__ = True
    failed, held = list[str](), list[str]()
    for check, tolerance in checks:
        known_to = check.known_to + COVERS * (check.u_input or 0.0)
        verdict = judge(check.difference, tolerance, known_to)
        mark = {"agrees": "within", "differs": "OUTSIDE", "unresolved": "UNDECIDED at"}[verdict]
        off = difference_text(check.difference, known_to, "\N{PLUS-MINUS SIGN}")
        whose = "data" if check.id.startswith("against_") else "1D"
        values = f"{whose} {amount(check.predicted, check.unit, 5)}, 3D {amount(check.measured, check.unit, 5)}"
        error = "numerical error" + f" and {COVERS:g} u_input" * bool(check.u_input)
        line = f"  {check.id}: {check.title}, {values}\n    difference {off} ({error}), {mark} the tolerance of "
        line += percent(tolerance) + "; ask for a smaller accuracy=" * (verdict == "unresolved")
        line += f"\n    {check.because}" * bool(check.because and verdict != "agrees")
        (held if verdict == "agrees" else failed).append(line)
    if failed:
        raise AssertionError("\n".join([f"{name} is not within the tolerances", *failed, *held]))
