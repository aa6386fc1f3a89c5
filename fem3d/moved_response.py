"""Derivatives of the traces of any scene over time, in the reduced space of its response widened by dual fields.

For each key the problem on the mesh that is there, moved, is assembled anew and projected on the same fields, and the
few states are stepped again: the difference sees the key alone, as nothing is refined and no space changes. The dual
fields make up for what the fields of the response don't know of its derivative, as in `fem3d.sensitivity_over_time`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d import conductor as conductors
from fem3d import level, outputs, probe_quantities, solve_scene, transient
from fem3d.assembly import assemble
from fem3d.conductor import Conductor, independent
from fem3d.domain import Domain, boxes
from fem3d.groups import groups
from fem3d.heat import HeatProblem
from fem3d.motion import speeds
from fem3d.transient import Base, Krylov, Transient
from meshes import symmetry
from meshes.grouped.place import Placed
from scenes.errors import SceneError
from scenes.model import AnyScene, MeshScene
from scenes.varied import varied

STEP = 2.0**-11  # of a key: a difference to one side is off by half of it, for a quantity that goes like a square
STEPPED = 1e-8  # accuracy of time stepping, of which a difference shows 1 / STEP
GENERATIONS, FEWER = 6, 4  # of dual Krylov fields, and how many the error is told from

Traces = dict[str, np.ndarray]


class Moved:
    """The response of a scene, solved whole, in a space of its own in which others beside it are solved too."""

    def __init__(self, scene: AnyScene, answer: Transient, times: np.ndarray) -> None:
        self._scene, self._answer, self._times = scene, answer, times
        self._base, self._domain = answer.base, answer.base.heat.domain
        heat = self._base.heat
        self._level = int(np.flatnonzero([own.sum() == heat.size for own in self._domain.space.nested])[0])
        late = answer.rises(times[-1:])[0]
        rows = [level.goal_row(heat, probe, late) for probe in self._domain.scene.probes]
        loads = [row for row in rows if row is not None and row[: heat.free].any()]
        g = transient.shift(answer.end, float(times[0]))
        dual = Krylov(Base(heat, None, [], answer.reduced.basis, loads), g)
        self._spaces = [dual.fields(count) for count in (GENERATIONS, FEWER)]
        # As warm as it gets: what heating does to the pattern of the current shows there most.
        rises = answer.rises(times)
        self._hottest = rises[int(np.abs(rises).max(axis=1).argmax())]
        self._here = self._traces(scene, self._domain)

    def derivatives(self, keys: Mapping[str, Any]) -> Iterator[tuple[str, Traces, dict[str, float]]]:
        """d trace / d ln key (times,), of temperatures above the start, by key and probe, and by how much fewer fields
        have another one. Keys that the scene can't be varied by are left out, with the reason in ``left_out``."""
        self.left_out: dict[str, str] = {}
        for key in keys:
            try:
                other = varied(self._scene, key, 1 + STEP)
                domain = self._moved(other)
            except SceneError as error:
                self.left_out[key] = str(error)
                continue
            pairs = zip(self._traces(other, domain), self._here, strict=True)
            both = [{n: (v - here[n]) / STEP for n, v in there.items()} for there, here in pairs]
            yield key, both[0], {n: float(np.abs(v - both[1][n]).max()) for n, v in both[0].items()}

    def _moved(self, other: AnyScene) -> Domain:
        """The domain of another scene on the cells of this one's."""
        domain: Any = self._domain
        if isinstance(other, MeshScene):
            return groups(Placed(other, domain.placed.mesh))
        grid, there = domain.space.grid, solve_scene.part_of(other, True).scene
        by = speeds(domain, domain.scene, there, STEP)
        breaks = tuple(b + STEP * v for b, v in zip(grid.breaks, by, strict=True))
        return boxes(there, replace(grid, breaks=breaks, boxes=there.boxes))

    def _traces(self, scene: AnyScene, domain: Domain) -> list[Traces]:
        """The traces of a scene above the start, in each of the spaces."""
        part, found = symmetry.uncut(domain.scene, domain.names), []
        study = probe_quantities.study(scene, part)  # type: ignore[arg-type]
        heat, conductor = self._problem(domain)
        patterns = []
        if conductor is not None and self._base.patterns:
            lift = heat.inputs.at(np.zeros(1))[0] @ heat.lifts
            driven = [v for v in conductor.voltages if v.any()]
            potentials = [conductor.solve(lift, v) for v in driven]
            if len(self._base.patterns) > len(driven):
                potentials += [conductor.solve(self._hottest, v) for v in driven]
            patterns = independent(conductor, potentials)
        for fields in self._spaces:
            base = Base(heat, conductor, patterns, fields, [])
            answer = transient.march(base, base.project(fields), study.end, STEPPED)
            values = study.traces(outputs.of_transient(answer, study.part, self._times))
            found.append({n: v - scene.initial_temperature * (n in study.rises) for n, v in values.items()})
        return found

    def _problem(self, domain: Domain) -> tuple[HeatProblem, Conductor | None]:
        heat = assemble(domain)
        conductor = conductors.find(heat)
        if heat.size == self._base.heat.size:
            return heat, conductor
        lower = heat.lower(self._level)
        return lower, conductor and conductor.lower(self._level, lower)
