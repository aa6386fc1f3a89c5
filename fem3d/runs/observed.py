"""Read probes on the mesh of a steady state that is refined for other probes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

from fem3d.adaptivity import choice
from fem3d.runs import probe_quantities
from fem3d.runs.scene import part_of
from scenes.errors import NumericsError
from scenes.model import Probe, Scene
from scenes.result import Estimate


def observe(
    scene: Scene, probes: Sequence[Probe], chosen: Callable[[dict[str, float]], Collection[Probe]] | None = None
) -> dict[str, Estimate]:
    """Solve the steady state of a scene of boxes and read further probes on its last mesh.

    Parameters
    ----------
    scene : Scene
        The scene; its own probes decide where the mesh is refined.
    probes : sequence of Probe
        Further probes, whose error bounds do not refine the mesh.
    chosen : callable, optional
        Takes all values and returns the needed further probes (default: all), each at the cost of a dual problem.

    Returns
    -------
    dict
        Value and error bound of the scene's and of the chosen probes by name.

    Raises
    ------
    RunawayError, NumericsError
        Where the steady state does not exist or is not reached.
    """
    every = replace(scene, probes=(*scene.probes, *probes))
    study, whole = (probe_quantities.study(scene, part_of(every, uncut)) for uncut in (False, True))
    study, mesh = choice.choose(replace(study, field=None), replace(whole, field=None))
    study, answer = choice.solve(study, mesh, lambda: replace(whole, field=None), False, lambda _: None)
    values = probe_quantities.study(every, study.part).steady(answer.fine.out)
    needed = probes if chosen is None else chosen({name: float(value) for name, value in values.items()})
    full = probe_quantities.study(replace(scene, probes=(*scene.probes, *needed)), study.part)
    problems = answer.mesh.problems()
    fine = replace(answer.fine, quantities=full.steady(answer.fine.out))
    problems.states[len(problems.heats) - 1] = fine.state
    level = answer.mesh.examine(full, problems, fine)
    if level is None:
        raise NumericsError("the errors of the further probes are not known: a lower degree has no steady state")
    return {name: Estimate(float(v), level.errors[name]) for name, v in level.fine.quantities.items()}
