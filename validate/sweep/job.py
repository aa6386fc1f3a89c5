"""What a sweep or a map is asked to do, and with what."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from scenes.errors import SceneError, did_you_mean, quoted
from validate.sweep.axes import Axis
from validate.sweep.base import Base
from validate.sweep.design import Design
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

        def axis(given: Axis) -> dict[str, Any]:
            return {"values": given.values, "log": given.log, "range": given.range}

        found = {
            "program": version(),
            "kind": "sweep" if self.solves is None else "map",
            "scene": {"name": self.base.name, "kind": self.base.kind, "document": self.base.document},
            "settings": self.base.settings,
            "vary": {given.key: axis(given) for given in self.design.axes},
            **({} if self.design.sample is None else {"sample": self.design.sample, "seed": self.design.seed}),
            **asdict(self.scope),
            **({} if self.solves is None else {"solves": self.solves}),
        }
        plain: dict[str, Any] = json.loads(json.dumps(found, default=str))
        return plain

    def work(self, numbers: Sequence[int], blamed: bool = True) -> Work:
        """A task."""
        points = tuple(self.design.point(number) for number in numbers)
        return Work(self.base, self.scope, self.design.keys, tuple(numbers), points, blamed)


@dataclass(frozen=True)
class Means:
    """What a job is done with: ``workers`` processes here or those of a ``scheduler``, ``seconds`` for each point."""

    workers: int
    scheduler: str | None = None
    seconds: float | None = None


def checked(base: Base, given: str | None, steady: bool, varied: Collection[str] = ()) -> str:
    """The check that was asked for; SceneError for one that there isn't, or that no design of the sweep has, whose
    ``varied`` keys are these."""
    from compare.plan import checks_of, skipped_checks
    from scenes.checks import DEFAULT_TOLERANCES, ISLAND_TOLERANCES
    from scenes.plan import Request

    scene: Any = base.at(())
    if base.kind == "free":
        probes = [probe.name for probe in scene.probes]
        if given is not None and given not in probes:
            raise SceneError(
                f"{quoted(given)} is no probe of the scene: give {', '.join(probes)}{did_you_mean(given, probes)}"
            )
        return given or next(iter(probes), "")
    check = given or "fig4"
    known = (*DEFAULT_TOLERANCES, *ISLAND_TOLERANCES)
    if check not in known:
        raise SceneError(f"{quoted(check)} is no check: give {', '.join(known)}{did_you_mean(check, known)}")
    if check not in checks_of(scene) and "sink.spans" not in varied:
        own = "several spans, as sink.spans=3" if scene.spans == 1 else "a single span"
        raise SceneError(f"there is no check {quoted(check)} here: it is one of {own}, and sink.spans = {scene.spans}")
    skipped = skipped_checks(scene, Request(transient=not steady))
    if check in skipped:
        raise SceneError(f"there is no check {quoted(check)} here: {skipped[check]}")
    return check
