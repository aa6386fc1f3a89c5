"""Whether an accuracy is within reach: of the memory, and of the layers that singular edges take."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fem3d.errors import NumericsError
from fem3d.indicators import Indicators
from meshes import grading
from meshes.bricks import BrickMesh
from meshes.grading import Features
from scenes.model import Scene

MOST_ENTRIES = 40_000_000  # of the stiffness matrix: some 10 GB with its factors
MOST_AT_FIRST = 15_000  # nodes of the first mesh, above which it starts poorer
FIRST_LAYER = 1e-5  # of a length of the scene, that of the first mesh at a singular edge at least
HARDLY = 0.25  # exponent of an edge below which its layers take more than there is
FAR_BELOW = 0.1  # of the narrowest length of a scene: layers shorter than that see the edge alone
CLEARLY = 2.0  # times the accuracy: errors above it that no layers take away are reason enough to give up


def first_mesh(scene: Scene, accuracy: float, features: Features) -> BrickMesh:
    """The mesh to start with. Where an edge is so singular that the accuracy would take layers close to rounding, it is
    that of a larger accuracy: not every quantity sees the edge, and what does so is refined for."""
    sharpest = min((s for found in features.exponents for s in found.values()), default=1.0)
    suits = FIRST_LAYER ** (2 * sharpest) / grading.LAYERS  # the accuracy of a first layer that long
    return grading.first_mesh(scene, max(accuracy, min(suits, grading.COARSEST)), MOST_AT_FIRST)


def entries(mesh: BrickMesh) -> int:
    """Entries of the stiffness matrix, before it is there."""
    return sum(int(np.prod([len(part.rows) for part in mesh.parts(block)])) for block in mesh.blocks)


def check_size(mesh: BrickMesh, accuracy: float, features: Features) -> None:
    """Raises NumericsError for a mesh that takes too much memory."""
    if entries(mesh) > MOST_ENTRIES:
        sentence = f"an accuracy of {accuracy:g} takes more memory in this scene than is sensible"
        raise NumericsError(sentence + _because(features))


def check_finer(finer: BrickMesh, mesh: BrickMesh, features: Features, accuracy: float) -> None:
    """Raises NumericsError where nothing is left to refine."""
    if all(a.size == b.size for a, b in zip(finer.axes, mesh.axes, strict=True)):
        raise NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene" + _because(features))


def check_edges(
    mesh: BrickMesh, goals: Mapping[str, Indicators], scales: Mapping[str, float], features: Features, accuracy: float
) -> None:
    """Raises NumericsError where the shortest layers would leave more than the accuracy of what edges cause in a goal:
    an edge's error falls with the length of its layer to the power of twice its exponent, whatever else is refined.

    That holds of layers far shorter than everything else; of longer ones nothing is foreseen.
    """
    asymptotic = FAR_BELOW * _narrowest(mesh, features)
    for name, goal in goals.items():
        least = 0.0
        for axis, found, missing in zip(mesh.axes, features.exponents, goal.missing, strict=True):
            near = np.array(grading.exponents_at(axis, found))
            s = np.minimum(near[:-1], near[1:])
            shrinks = np.minimum(grading.shortest_of(mesh) / np.diff(axis.breaks), 1.0)
            at = np.isfinite(s) & (np.diff(axis.breaks) < asymptotic)
            least += float((missing[at] * shrinks[at] ** (2 * s[at])).sum())
        if least / scales[name] > CLEARLY * accuracy:
            raise NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene" + _because(features))


def _narrowest(mesh: BrickMesh, features: Features) -> float:
    """The least distance (m) of two planes of the scene along any axis, without slivers."""
    found = []
    for axis, inner in zip(mesh.axes, features.planes, strict=True):
        ends = float(axis.breaks[0]), float(axis.breaks[-1])
        gaps = np.diff(sorted({*inner, *ends}))
        found.append(float(gaps[gaps > grading.SLIVER * (ends[1] - ends[0])].min()))
    return min(found)


def _because(features: Features) -> str:
    """Where the solution is so singular that no mesh resolves it, in words; nothing where it isn't."""
    planes = [(s, "xyz"[d], at) for d in range(3) for at, s in features.exponents[d].items()]
    sharpest, axis, at = min(planes, default=(1.0, "", 0.0))
    if sharpest > HARDLY:
        return ""
    return (
        f": at {axis} = {at:.4g} m a given value ends, or good conductors meet along an edge only, and the solution "
        f"behaves as a distance to the power {sharpest:.2f} there; ask for a larger accuracy, or let them end elsewhere"
    )
