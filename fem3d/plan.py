"""Lines that the plans of the 3D model have in common."""

from __future__ import annotations

from fem3d import currents
from meshes.symmetry import Symmetry
from scenes import physics
from scenes.model import AnyScene
from scenes.plan import Step, step

STEADY_ONLY = "only the steady state was asked for"


def symmetry_step(part: Symmetry) -> Step:
    """Which part is solved, and by which mirror planes."""
    names = " and ".join(f"{'xyz'[axis]} ({parity})" for axis, _, parity in part.planes)
    none = "" if part.planes else "the scene has no mirror plane; the whole is solved"
    return step("symmetry", f"{part.part} is solved: mirror planes across {names}", none)


def of_free(
    scene: AnyScene, heat: str, current: str, no_current: str, steady: str, transient: str
) -> tuple[Step, ...]:  # fmt: skip
    """The lines of heat, currents and time of a free scene, each with what it ``does`` on bricks or on a mesh;
    ``no_current`` is why there is no electric problem, empty where there is one."""
    warm = physics.heat(scene)
    steps = (
        step("heat", heat, "" if warm else "nothing thermal is asked for: the currents at the initial temperature"),
        step("electric problem", current, no_current),
    )
    if not (scene.steady or warm):
        return *steps, *currents.plan(scene)
    return (
        *steps,
        step("steady state", steady, "" if scene.steady else "only the transient was asked for"),
        step("transient", f"to {scene.end_time:g} s, {transient}", STEADY_ONLY if scene.steady else ""),
    )
