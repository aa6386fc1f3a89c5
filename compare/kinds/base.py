"""The interface of a kind of scene: its models, checks and reports."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, Generic

import numpy as np
from numpy.typing import NDArray

from compare import against, hottest
from compare.options import Options
from compare.outcome import Outcome, Progress, S
from compare.slopes import Slopes
from compare.verdict import Check, Definition, judged
from scenes.model import AnyScene
from scenes.result import Result, Step, skipped_together, step
from scenes.varied import neighbour

STEADY = "only the steady state was asked for"


class Kind(ABC, Generic[S]):
    """A kind of scene: how to solve, compare and report its scenes. Instances have no state.

    The kinds are the sink, the device and free scenes; a new one is entered in `compare.kinds.KINDS`. Abstract methods
    must be overridden; the others have defaults.

    Attributes
    ----------
    shown : quantities that tables on a terminal have room for; empty: the first ones
    step : largest relative step of a key for `nearby`; the uncertainty of the key where that is smaller
    """

    shown: ClassVar[tuple[str, ...]] = ()
    step: ClassVar[float] = 1e-4

    @abstractmethod
    def quantities(self, scene: S) -> dict[str, tuple[str, str]]:
        """Return the label and the unit of steady quantities, by their names."""

    def refuse(self, scene: S, options: Options) -> None:
        """Raise SceneError for options that this scene cannot have."""

    def declared(self, scene: S, options: Options) -> S:
        """Return the scene as it is solved: with probes, and without expected verdicts where the run uses another
        model than they are for."""
        return scene

    @abstractmethod
    def solve(self, scene: S, options: Options, progress: Progress, fem3d: Result | None = None) -> dict[str, Result]:
        """Solve the models that the options ask for and the kind has, except the user's own, by name: "fem3d",
        "reduced1d", and "single", 3D of one span of a row. A result in 3D of this scene is taken where it is given.
        Raises SceneError and ArithmeticError."""

    def definitions(self, scene: S, options: Options) -> Mapping[str, Definition[Outcome[S]]]:
        """Return the checks that such a run may have, in the order of the report; none by default, for a kind with its
        own ``of_models``."""
        return {}

    @abstractmethod
    def absent(self, scene: S, options: Options) -> dict[str, str]:
        """Return by need of checks, figures and files why this run lacks the needed thing; empty where it does not."""

    def skipped(self, scene: S, options: Options) -> dict[str, str]:
        """Return the checks that a run cannot make, each with the reason."""
        absent = self.absent(scene, options)
        reasons = {name: lack(absent, *needs) for name, (_, needs) in self.definitions(scene, options).items()}
        return {name: why for name, why in reasons.items() if why}

    def made(self, scene: S, options: Options) -> tuple[str, ...]:
        """Return the checks that lack nothing; a user's own model may have fewer."""
        skipped = self.skipped(scene, options)
        return tuple(name for name in self.definitions(scene, options) if name not in skipped)

    def of_models(self, outcome: Outcome[S]) -> dict[str, Check]:
        """Compare one model with the other, or with the paper, by the ids of checks; without checks of quantities that
        a model lacks."""
        definitions = self.definitions(outcome.scene, outcome.options)
        made = {name: definitions[name][0](outcome) for name in self.made(outcome.scene, outcome.options)}
        return {name: comparison for name, comparison in made.items() if comparison is not None}

    def comparisons(self, outcome: Outcome[S], like: Result | None = None) -> dict[str, Check]:
        """Compare the models, and the user's data with 3D, by the ids of checks; the data where they are furthest from
        3D, or from a result ``like`` it."""
        data = outcome.options.against
        of_data = {} if data is None else against.comparisons(outcome.scene, data, outcome.solved, like)
        return self.of_models(outcome) | of_data

    def checks(self, outcome: Outcome[S]) -> tuple[Check, ...]:
        """Judge the comparisons."""
        return tuple(judged(name, each, outcome.scene) for name, each in self.comparisons(outcome).items())

    def check_steps(self, scene: S, options: Options) -> list[Step]:
        """The lines of the plan for checks."""
        made = self.made(scene, options)
        lines = [step("checks", ", ".join(made))] if made else []
        return lines + skipped_together("checks", self.skipped(scene, options))

    def alarms(self, outcome: Outcome[S]) -> tuple[str, ...]:
        """Remarks on results that no real part can have: temperatures past a material's limit."""
        return hottest.warnings(hottest.reached(outcome.scene, outcome.fem3d or outcome.reduced))

    def warnings(self, outcome: Outcome[S]) -> tuple[str, ...]:
        """Return remarks on the results."""
        results = filter(None, (outcome.fem3d, outcome.reduced1d))
        return tuple(text for result in results for text in result.details.get("warnings", ()))

    def answer(self, outcome: Outcome[S]) -> str:
        """The difference between the models in a sentence."""
        return ""

    @abstractmethod
    def slopes(self, outcome: Outcome[S], keys: Sequence[str] | None) -> dict[str, Slopes]:
        """How the results follow all or some keys, by the results' names."""

    def nearby(self, outcome: Outcome[S], key: str, step: float) -> Outcome[S]:
        """The outcome with one key larger by a relative step; SceneError where there is no scene."""
        moved = {name: each.moved(outcome.results[name], key, step) for name, each in outcome.slopes.items()}
        return replace(outcome, scene=neighbour(outcome.scene, key, step), results=outcome.results | moved)

    @abstractmethod
    def plan_3d(self, scene: S, options: Options) -> Sequence[Step]:
        """The plan of the 3D model before it is solved."""

    @abstractmethod
    def describe_1d(self, scene: S, options: Options) -> str:
        """The 1D model in words; empty without one."""

    def steps(self, scene: S, options: Options, outcome: Outcome[S] | None = None) -> list[Step]:
        """The plan of models and checks, as carried out where there is an outcome."""
        absent = self.absent(scene, options)
        no_3d, no_1d = (lack(absent, model) for model in ("3D", "1D"))
        carried_out = () if outcome is None or no_3d else outcome.solved.details.get("plan", ())
        lines = [step("3D model", "", no_3d)] if no_3d else [*(carried_out or self.plan_3d(scene, options))]
        described = "" if no_1d else self.describe_1d(scene, options)
        lines += [step("1D model", described, no_1d)] * bool(described or no_1d)
        return lines + self.check_steps(scene, options)

    def exported(self, scene: S, options: Options) -> AnyScene | None:
        """Return the scene, of boxes or on a mesh, that a compact model is made of; None for a kind with its own
        ``compact``. Raises SceneError for a scene that has none."""
        return None

    def compact(self, outcome: Outcome[S], progress: Progress) -> dict[str, object]:
        """Return the document of the compact model, with warnings where its accuracy is not reached; a given number of
        states is taken whatever its error. Raises NumericsError where the scene has no solution."""
        from fem3d.runs.compact import compact

        scene, export = self.exported(outcome.scene, outcome.options), outcome.options.export
        assert scene is not None
        seconds, earlier = progress.processor_time.get("fem3d", 0.0), outcome.fem3d if scene is outcome.scene else None
        return compact(scene, export.states, export.accuracy, progress, seconds, earlier)

    def columns(self, outcome: Outcome[S]) -> dict[str, NDArray[np.float64]]:
        """Return time_s and <model>_<quantity>_<unit> for traces.csv, as far as all models go; temperatures in kelvin,
        every 1D model "reduced1d". Empty without a transient."""
        results = {"fem3d": outcome.fem3d, "reduced1d": outcome.reduced1d}
        traces = {name: each.traces for name, each in results.items() if each is not None and each.traces is not None}
        if not traces:
            return {}
        time = max((each.time for each in traces.values()), key=len)
        time = time[time <= min(each.time[-1] for each in traces.values())]
        columns = {"time_s": time}
        for name, each in traces.items():
            columns |= {f"{name}_{key}": np.interp(time, each.time, v) for key, v in each.values.items()}
        return columns


def lack(absent: Mapping[str, str], *needs: str) -> str:
    """Return why the first of some needs is absent; empty where none is."""
    return next(filter(None, map(absent.get, needs)), "")
