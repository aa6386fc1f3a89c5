"""A sweep, or the map of a tolerance's line: what is asked for."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from scenes.errors import SceneError, did_you_mean, quoted
from validate.sweep.design import Base, Design
from validate.sweep.point import Scope, Work


@dataclass(frozen=True)
class Job:
    """What is asked for: a ``design`` of a ``base``, and the ``scope`` of each point. Of a map the design is the cells,
    and not many more than ``solves`` of them are solved."""

    base: Base
    design: Design
    scope: Scope
    solves: int | None = None

    def document(self) -> dict[str, Any]:
        """All of it as JSON types: what a folder's earlier run must have been asked as well."""
        from validate.report.summary import version

        base, design = self.base, self.design
        found = {
            "program": version(),
            "kind": "sweep" if self.solves is None else "map",
            "scene": {"name": base.name, "kind": base.kind, "document": base.document},
            "settings": base.settings,
            "vary": {axis.key: {"values": axis.values, "log": axis.log, "range": axis.range} for axis in design.axes},
            **({} if design.sample is None else {"sample": design.sample, "seed": design.seed}),
            **asdict(self.scope),
            **({} if self.solves is None else {"solves": self.solves}),
        }
        plain: dict[str, Any] = json.loads(json.dumps(found, default=str))
        return plain

    def work(self, numbers: Sequence[int], blamed: bool = True) -> Work:
        """A task."""
        points = tuple(self.design.point(number) for number in numbers)
        scope = replace(self.scope, blame=self.scope.blame and blamed)
        return Work(self.base, scope, self.design.keys, tuple(numbers), points)


def checked(base: Base, given: str | None, steady: bool, varied: Collection[str] = ()) -> str:
    """The check that was asked for; SceneError for one that there isn't, or that no design of the sweep has, whose
    ``varied`` keys are these."""
    from compare.plan import checks_of, skipped_checks
    from scenes.checks import DEFAULT_TOLERANCES, ISLAND_TOLERANCES
    from scenes.plan import Request

    scene: Any = base.at(())
    free = base.kind == "free"
    known = [probe.name for probe in scene.probes] if free else [*DEFAULT_TOLERANCES, *ISLAND_TOLERANCES]
    if given is not None and given not in known:
        what = "probe of the scene" if free else "check"
        raise SceneError(f"{quoted(given)} is no {what}: give {', '.join(known)}{did_you_mean(given, known)}")
    if free:
        return given or next(iter(known), "")
    check = given or "fig4"
    if check not in checks_of(scene) and "sink.spans" not in varied:
        own = "several spans, as sink.spans=3" if scene.spans == 1 else "a single span"
        raise SceneError(f"there is no check {quoted(check)} here: it is one of {own}, and sink.spans = {scene.spans}")
    skipped = skipped_checks(scene, Request(transient=not steady))
    if check in skipped:
        raise SceneError(f"there is no check {quoted(check)} here: {skipped[check]}")
    return check
