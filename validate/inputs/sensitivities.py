"""How the models of a scene follow each of its keys: d ln quantity / d ln key, of both models side by side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.sink_checks import fig5
from compare.verdict import Check, Models, judge
from scenes.device import Device
from scenes.formats import percent
from scenes.model import AnyScene
from scenes.parameters import SECTION
from scenes.result import Estimate, Result
from scenes.sink import OF_A_SINK, Sink
from scenes.varied import made_of_parameters, numbers, zeros

if TYPE_CHECKING:
    from compare.models import Model as OwnModel
    from fem3d.device.solve import Model

QUANTITIES = {entry.steady: entry.called for entry in OF_A_SINK.values()}
PREFIX = "slope_"
TEMPERATURE = "_temperature"
"""How keys of temperatures end."""
NONE = 1e-6  # Smaller slopes count as zero.
PART = 1e-5  # Step of a place along a profile, over its span; the error of a central difference is its square.


@dataclass(frozen=True)
class Slope:
    """d ln quantity / d ln key in 3D, with its error, and in 1D; ``None`` of a model that was not asked for."""

    fem3d: Estimate | None
    reduced1d: float | None

    @property
    def size(self) -> float:
        """The larger of both."""
        return max(abs(self.fem3d.value) if self.fem3d else 0.0, abs(self.reduced1d or 0.0))


@dataclass(frozen=True)
class Course:
    """d ln quantity (of rises) / d ln key at ``times`` (s) by model, key and quantity, and the errors of 3D's."""

    times: np.ndarray
    fem3d: dict[str, dict[str, np.ndarray]]
    errors: dict[str, dict[str, float]]
    reduced1d: dict[str, dict[str, np.ndarray]]

    def columns(self) -> dict[str, np.ndarray]:
        """As columns of a file: time_s, then <model>_<quantity>_by_<key>."""
        models = {"fem3d": self.fem3d, "reduced1d": self.reduced1d}
        return {"time_s": self.times} | {
            f"{model}_{name}_by_{key}": values
            for model, by_key in models.items() for key, by_name in by_key.items() for name, values in by_name.items()
        }  # fmt: skip


@dataclass(frozen=True)
class Sensitivities:
    """``keys`` with their values (SI units); ``steady`` by key and quantity (of a free scene over time of the largest
    size of each); ``course`` where the run went over time; ``left_out`` says why a key, or a quantity, has none in 3D.
    Of a free scene ``values`` are what the quantities come to, temperatures as rises, and ``zeros`` the keys that
    have no logarithm. ``misfit``: what the 3D profile's distance from a parabola, fig5, changes with each key. Of a
    user's own model ``of_model`` is what the same quantities come to, and ``moved`` by check and key what the check's
    difference changes by, d / d ln key. Tables leave out the keys that are ``made`` of parameters."""

    keys: dict[str, float]
    steady: dict[str, dict[str, Slope]]
    course: Course | None = None
    left_out: dict[str, str] = field(default_factory=dict)
    values: dict[str, Estimate] = field(default_factory=dict)
    zeros: tuple[str, ...] = ()
    misfit: dict[str, float] = field(default_factory=dict)
    of_model: dict[str, Estimate] = field(default_factory=dict)
    moved: dict[str, dict[str, float]] = field(default_factory=dict)
    made: set[str] = field(default_factory=set)

    def remarks(self) -> tuple[str, ...]:
        """What is left out, in a sentence for each reason."""
        reasons = dict.fromkeys(self.left_out.values())
        together = {why: [name for name, other in self.left_out.items() if other == why] for why in reasons}
        return tuple(f"no sensitivity to or of {', '.join(names)}: {why}" for why, names in together.items())

    def document(self) -> dict[str, Any]:
        """What summary.json says of it: {key: {quantity: {"fem3d": {"value", "error"}, "reduced1d": {"value"}}}}."""
        return {
            key: {name: _document(slope) for name, slope in by_name.items()} for key, by_name in self.steady.items()
        }

    def largest(self, quantity: str) -> float:
        """The largest slope of a quantity by any key, in 3D where that is there; but for temperatures, of which a
        percent is kelvins, however few the rises are, and for parameters, whose slopes are sums of those of keys."""
        keys = [key for key in self.steady if not key.endswith(TEMPERATURE) and not key.startswith(f"{SECTION}.")]
        slopes = [self.steady[key][quantity] for key in keys if quantity in self.steady[key]]
        return max((abs(s.fem3d.value) if s.fem3d else s.size for s in slopes), default=0.0)

    def sorted(self, quantities: Iterable[str]) -> list[str]:
        """The keys that any of the quantities follows, that which one follows most first."""
        names = list(quantities)
        sizes = {
            key: max((by_name[n].size for n in names if n in by_name), default=0.0)
            for key, by_name in self.steady.items()
            if key not in self.made
        }
        return sorted((key for key, size in sizes.items() if size > NONE), key=lambda key: -sizes[key])


def _document(slope: Slope) -> dict[str, Any]:
    document: dict[str, Any] = {}
    if slope.fem3d is not None:
        document["fem3d"] = {"value": slope.fem3d.value, "error": slope.fem3d.error}
    if slope.reduced1d is not None:
        document["reduced1d"] = {"value": slope.reduced1d}
    return document


def of_sink(
    sink: Sink, fem3d: Result | None, reduced1d: Result | None, with_profile: bool = False,
    own_model: OwnModel | None = None,
) -> Sensitivities:  # fmt: skip
    """The sensitivities of what a run has solved; ``with_profile`` also that of fig5.

    Those of reductions that stand on the plate are of the steady state alone: each costs a plate. The user's
    ``own_model`` is followed by differences. Raises what
    `fem3d.runs.sink_sensitivity.of_sink` and `reduced1d.slopes.of_sink` raise.
    """
    keys = numbers(sink)
    steady: dict[str, dict[str, Slope]] = {key: {} for key in keys}
    times = None
    course3d: dict[str, dict[str, np.ndarray]] = {}
    errors: dict[str, dict[str, float]] = {}
    left_out, misfit = dict[str, str](), dict[str, float]()
    if fem3d is not None:
        from fem3d.runs import sink_sensitivity

        weights = misfit_weights(sink, fem3d) if with_profile and sink.spans == 1 else None
        in_3d = sink_sensitivity.of_sink(sink, fem3d, weights=weights)
        left_out, misfit = in_3d.left_out, in_3d.profile
        for key, by_name in in_3d.steady.items():
            steady[key] = {name: Slope(estimate, None) for name, estimate in by_name.items()}
        if in_3d.course is not None:
            times, course3d, errors = in_3d.course.times, in_3d.course.values, in_3d.course.errors
    elif reduced1d is not None and reduced1d.traces is not None:
        times = reduced1d.traces.time[1:]
    course1d: dict[str, dict[str, np.ndarray]] = {}
    if reduced1d is not None:
        if own_model is not None and fem3d is not None:
            from compare.models.slopes import of_sink as slopes_of

            by_key, course1d, silent = slopes_of(own_model, sink, fem3d, reduced1d, times)
            left_out |= silent
        else:
            from reduced1d import slopes

            over_time = times if reduced1d.model == "paper" else None
            by_key, course1d = slopes.of_sink(sink, reduced1d.model, keys, over_time)
        for key, values in by_key.items():
            before = steady[key]
            steady[key] = before | {
                name: Slope(before[name].fem3d if name in before else None, value) for name, value in values.items()
            }
    course = None if times is None else Course(times, course3d, errors, course1d)
    return Sensitivities(keys, steady, course, left_out, misfit=misfit, made=made_of_parameters(sink))


def misfit_weights(sink: Sink, fem3d: Result) -> np.ndarray:
    """(places,): how fig5 follows the 3D rise at each place of the profile (1/K)."""
    profile = fem3d.details["profile"]
    rise = np.asarray(profile["rise_K"], float)

    def at(changed: np.ndarray) -> float:
        return fig5(Models(sink, replace(fem3d, details={"profile": profile | {"rise_K": changed}}), None)).difference

    step = PART * float(np.ptp(rise))
    return np.array([at(rise + shift) - at(rise - shift) for shift in step * np.eye(len(rise))]) / (2 * step)


def of_free(scene: AnyScene, result: Result, keys: Sequence[str] | None = None) -> Sensitivities:
    """Sensitivities of a free scene's probes, solved whole, to all or some ``keys``. Raises ConvergenceError."""
    from fem3d.runs import scene_sensitivity

    in_3d = scene_sensitivity.of_scene(scene, result, keys)
    steady = {
        key: {n: Slope(estimate, None) for n, estimate in by_name.items()} for key, by_name in in_3d.table.items()
    }
    course = None if in_3d.times is None else Course(in_3d.times, in_3d.course, in_3d.errors, {})
    made = made_of_parameters(scene)
    return Sensitivities(numbers(scene), steady, course, in_3d.left_out, in_3d.values, zeros(scene), made=made)


def of_device(device: Device, in_3d: Model | None) -> Sensitivities:
    """The sensitivities of the device's steady state in 1D and, with its few states, in 3D."""
    from reduced1d import slopes

    in_1d, left_out, by_key_3d = slopes.of_device(device), dict[str, str](), dict[str, dict[str, Estimate]]()
    if in_3d is not None:
        from fem3d.device import sensitivity

        by_key_3d, left_out = sensitivity.of_device(device, in_3d)
    steady = {
        key: {name: Slope(by_key_3d.get(key, {}).get(name), value) for name, value in by_name.items()}
        for key, by_name in in_1d.items()
    }
    return Sensitivities(numbers(device), steady, left_out=left_out, made=made_of_parameters(device))


def checks(scene: Any, sensitivities: Sensitivities, called: Mapping[str, str]) -> tuple[Check, ...]:
    """For each key that any of the quantities (``called`` so) follows the check whether 1D follows it as 3D does: the
    largest difference of their slopes over quantities, of the largest slope of that quantity."""
    made = []
    largest = {name: sensitivities.largest(name) for name in called}
    tolerance = scene.tolerance("slope")
    for key in sensitivities.sorted(called):
        slopes = sensitivities.steady[key].items()
        both = {
            n: (s.fem3d, s.reduced1d)
            for n, s in slopes
            if s.fem3d is not None and s.reduced1d is not None and largest.get(n, 0.0) > NONE
        }
        if not both:
            continue
        off = {n: (in_1d - in_3d.value) / largest[n] for n, (in_3d, in_1d) in both.items()}
        name = max(off, key=lambda n: abs(off[n]))
        in_3d, in_1d = both[name]
        u_num = in_3d.error / largest[name]
        verdict = judge(off[name], tolerance, u_num)
        because = "" if verdict == "agrees" else _said(called[name], key, in_3d.value, in_1d)
        title = f"{called[name]}, d ln / d ln key"
        made.append(
            Check(
                f"{PREFIX}{key}", title, in_1d, in_3d.value, "1", off[name], tolerance, u_num, verdict,
                because=because, relative_to="the largest slope of the quantity",
            )
        )  # fmt: skip
    return tuple(made)


def worst(made: Iterable[Check]) -> Check | None:
    """Of the checks of slopes that differ the one that does most, which the sentence is of."""
    differ = [check for check in made if check.id.startswith(PREFIX) and check.verdict == "differs"]
    return max(differ, key=lambda check: abs(check.difference), default=None)


def sentence(made: Iterable[Check]) -> str:
    """The worst of the checks of slopes in a sentence; empty where there are none."""
    slopes = [check for check in made if check.id.startswith(PREFIX)]
    if not slopes:
        return ""
    if (check := worst(slopes)) is not None:
        return f"The 1D model {check.because}."
    open_ = sum(check.verdict == "unresolved" for check in slopes)
    said = "The 1D model follows every key as 3D does"
    return f"{said}, as far as the errors tell: {open_} of {len(slopes)} are open." if open_ else f"{said}."


def _said(called: str, key: str, in_3d: float, in_1d: float) -> str:
    how = f"how the {called} follows {key}"
    slopes = f"{in_1d:+.3f} in place of {in_3d:+.3f} % for each percent"
    if in_1d * in_3d <= 0:
        if abs(in_1d) <= NONE:
            return f"does not see {how}: {slopes}"
        return f"has {how} the wrong way round: {slopes}" if abs(in_3d) > NONE else f"invents {how}: {slopes}"
    ratio = abs(in_1d / in_3d) - 1
    return f"{'overrates' if ratio > 0 else 'underrates'} {how} by {percent(abs(ratio))}: {slopes}"
